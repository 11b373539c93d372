"""The report's words and numbers, from the record alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_imitation.demo.panels import Moment
from intent_imitation.demo.run_record import DemoRecord
from intent_imitation.planner.plan import GraspPlan

GERUNDS = {
    "hand-over": "hand it over",
    "pouring": "pour from it",
    "tool-use": "use it as a tool",
    "dish-washing": "wash it up",
}


@dataclass(frozen=True)
class Figure:
    """One number that a reader wants first."""

    value: str
    caption: str


@dataclass(frozen=True)
class Rows:
    """A small table."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def summary(record: DemoRecord) -> str:
    """Return what happened in two or three sentences."""
    final, plan = record.final, record.plan
    if final is None or not record.grasps:
        seen = sum(state.hand_tracked for state in record.states)
        text = "No stable grasp was seen in this recording, so no intention was inferred."
        return text if seen else f"{text} No hand was tracked in it."
    name = record.grasps[0].object_id.replace("_", " ")
    if final.best is None:
        return f"The human grasped {name}; no known task explains how."
    chance = float(final.probability[final.tasks.index(final.best)])
    purpose = GERUNDS.get(final.best, f"do the task “{final.best}” with it")
    text = f"The human grasped {name}, most likely to {purpose} (p = {chance:.2f}). "
    if plan is None:
        if record.robot_objects is None:
            return text + "The robot's own table was not seen, so it has no answer."
        return text + "The robot has no answer: its network BN^R may not know this task."
    if plan.nothing_recognised:
        return text + (
            "On the robot's table nothing was recognised: give its objects by --models, or see "
            "whether its camera sees the table."
        )
    if plan.nothing_affords:
        return text + "On the robot's table nothing affords this task, and the robot says so."
    best = plan.objects[0]
    return text + (
        f"On its own table the robot takes {best.id.replace('_', ' ')}, "
        f"p(o | t*) = {best.probability:.2f}, with the best of {len(plan.grasps)} grasps that its "
        "hand can reach there."
    )


def figures(record: DemoRecord) -> list[Figure]:
    """Return the numbers at the head of the page."""
    final, truth = record.final, record.truth
    shown = []
    if final is not None and final.best is not None:
        chance = float(final.probability[final.tasks.index(final.best)])
        shown.append(Figure(final.best, f"inferred task, p = {chance:.2f}"))
    if truth is not None and truth.task is not None:
        shown.append(Figure(truth.task, "task that was demonstrated"))
    if record.plan is not None and record.plan.grasps:
        best = record.plan.grasps[0]
        shown.append(Figure(best.object_id.replace("_", " "), "the robot's object"))
    tracked = record.frames_total - record.frames_lost
    shown.append(Figure(f"{tracked} of {record.frames_total}", "frames tracked"))
    if truth is not None and truth.joint_error is not None:
        shown.append(Figure(f"{truth.joint_error * 1e3:.1f} mm", "mean error of the hand's joints"))
    return shown


def origin(record: DemoRecord) -> str:
    """Return which recording this is, what its pixels are, when the run was and by what."""
    parts = [f"Bag {record.bag}"]
    if record.truth is not None and record.truth.synthetic:
        parts.append("synthetic: rendered, not filmed")
    if record.written:
        parts.append(f"run of {record.written}")
    if record.version:
        parts.append(f"Intent {record.version}")
    return " · ".join(parts)


def footer(record: DemoRecord) -> str:
    """Return where the page's content comes from."""
    return (
        "All pictures and numbers are from this run of the five nodes. Poses are in the frame of "
        "the table, z up, in metres. The bag was played frame by frame, each once the nodes had "
        f"dealt with the one before; that took {record.seconds:.0f} s, which says nothing of the "
        "speed with a camera."
    )


def tracking_text(shown: Sequence[Moment]) -> str:
    """Return what the strip of tracked moments shows."""
    moments = "one moment" if len(shown) == 1 else f"{len(shown)} moments"
    return f"Tracked hand and objects drawn over the camera's images at {moments}."


def posterior_text(grasps: int) -> str:
    """Return what the posterior over time shows."""
    text = "Probability of each task over time"
    if not grasps:
        return f"{text}: forecasts while the hand reached; no stable grasp followed."
    lines = "the dashed line marks the stable grasp"
    return f"{text}; {lines if grasps == 1 else 'dashed lines mark the stable grasps'}."


def table_text(plan: GraspPlan | None) -> str:
    """Return what the picture of the robot's table shows."""
    if plan is None:
        return "The robot's table; the number at each object is the recogniser's confidence."
    if plan.nothing_recognised:
        return "The robot's table, on which nothing was recognised."
    text = "The robot's table; the number at each object is p(o | t*)"
    if plan.grasps:
        text += ", and the chosen one is green"
    if not all(choice.judged for choice in plan.objects):
        text += ". Things without a number are of no known class and were not judged"
    return f"{text}."


def grasp_text(plan: GraspPlan | None) -> str:
    """Return what the picture of the grasp shows."""
    hand = "robot's" if plan is None else _hand_name(plan.hand)
    return f"The {hand} hand closed around the chosen object, as it would be executed."


def _hand_name(hand: str) -> str:
    return "Schunk" if hand == "schunk" else hand.replace("_", " ")


EVIDENCE_TEXT = (
    "For each task, how far every observed feature moved the log-odds at the grasp. The grey bar "
    "is the rest: the prior, and what features say only together; all bars together are the "
    "log-odds of p."
)


def object_rows(record: DemoRecord) -> Rows | None:
    """Return the robot's objects, ranked."""
    if record.plan is None or not record.plan.objects:
        return None
    rows = tuple(
        (
            choice.id,
            choice.object_class or "unknown",
            f"{choice.probability:.3f}" if choice.judged else "not judged",
            "yes" if choice.affords else "no" if choice.judged else "",
        )
        for choice in record.plan.objects
    )
    return Rows("Objects on the robot's table", ("object", "class", "p(o | t*)", "fit"), rows)


def grasp_rows(record: DemoRecord, count: int = 8) -> Rows | None:
    """Return the best grasps with their scores, approach and postures."""
    plan = record.plan
    if plan is None or not plan.grasps:
        return None
    names = tuple(plan.grasps[0].score_parts)
    rows = tuple(
        (
            str(rank + 1),
            f"{grasp.score:.3f}",
            *(f"{grasp.score_parts.get(name, float('nan')):.3f}" for name in names),
            "shaken" if grasp.shaken else "static filter",
            _vector(grasp.T_table_hand[:3, 3]),
            _vector(grasp.approach),
            _vector(np.degrees(grasp.grasp_joints), digits=0),
        )
        for rank, grasp in enumerate(plan.grasps[:count])
    )
    head = ("rank", "score", *names, "test", "wrist x y z [m]", "approach", "joints [deg]")
    return Rows("Ranked grasps", head, rows)


def _vector(values: Sequence[float] | np.ndarray, digits: int = 2) -> str:
    return " ".join(f"{float(value):.{digits}f}" for value in values)
