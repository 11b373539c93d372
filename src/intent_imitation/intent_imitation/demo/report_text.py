"""The report's words and numbers, from the record alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_imitation.demo.run_record import DemoRecord

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
        return "No stable grasp was seen in this recording, so no intention was inferred."
    name = record.grasps[0].object_id.replace("_", " ")
    if final.best is None:
        return f"The human grasped {name}; no known task explains how."
    chance = float(final.probability[final.tasks.index(final.best)])
    purpose = GERUNDS.get(final.best, f"do the task “{final.best}” with it")
    text = f"The human grasped {name}, most likely to {purpose} (p = {chance:.2f}). "
    if plan is None:
        return text + "The robot's own table was not seen, so it has no answer yet."
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
    shown.append(Figure(f"{record.seconds:.0f} s", "from the first frame to the plan"))
    return shown


def object_rows(record: DemoRecord) -> Rows | None:
    """Return the robot's objects, ranked."""
    if record.plan is None or not record.plan.objects:
        return None
    rows = tuple(
        (
            choice.id,
            choice.object_class or "unknown",
            f"{choice.probability:.3f}",
            "yes" if choice.affords else "no",
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
