"""Diagrams of the report: posterior over time, evidence, choice of the object."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from intent_imitation.demo.mesh_pictures import (
    GRID,
    INK,
    SOFT,
    SPARE_COLORS,
    TASK_COLORS,
    task_color,
)
from intent_imitation.planner.plan import GraspPlan, ObjectChoice
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import written_beside

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 11.0,
    "text.color": INK,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.titlesize": 12.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "figure.facecolor": "white",
}
VARIABLE_NAMES = {
    "obcl": "object class",
    "object_class": "object class",
    "size": "object size",
    "conv": "convexity",
    "dir": "hand orientation",
    "npos": "hand position",
    "fcon": "finger posture",
    "fvol": "free volume",
    "coc": "contact centre",
    "gbvl": "grasped part",
}


@contextmanager
def figure(path: Path, width: float, height: float) -> Iterator[Figure]:
    """Give an empty figure of width x height inches and write it to a PNG file afterwards."""
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(width, height), layout="constrained")
        yield canvas
        with written_beside(path) as part:
            canvas.savefig(part, dpi=140, bbox_inches="tight", pad_inches=0.12)


def draw_timeline(
    path: Path,
    posteriors: Sequence[TaskPosterior],
    grasp_stamps: Sequence[int],
    start: int,
    true_task: str | None,
) -> None:
    """Draw the probability of each task over time; the grasp splits guess from conclusion.

    Args:
        path: PNG file to write.
        posteriors: preliminary and final ones.
        grasp_stamps: moments of stable grasps [ns].
        start: stamp of time zero [ns].
        true_task: the demonstrated task where known; it is marked at its line.
    """
    with figure(path, 9.2, 4.0) as canvas:
        timeline(canvas.subplots(), posteriors, grasp_stamps, start, true_task)


def timeline(
    axes: Axes,
    posteriors: Sequence[TaskPosterior],
    grasp_stamps: Sequence[int],
    start: int,
    true_task: str | None = None,
) -> None:
    """Draw what is afforded (solid) and meant (dotted) over time; dashed lines mark grasps."""
    posteriors = in_order(posteriors)
    seconds = np.array([(p.stamp - start) * 1e-9 for p in posteriors])
    tasks = posteriors[-1].tasks if posteriors else ()
    labels: list[tuple[float, str, str]] = []
    for task in tasks:
        values = np.array([_probability(p, task) for p in posteriors])
        color = task_color(task, tasks)
        grasped = np.array([p.stamp in grasp_stamps and not p.preliminary for p in posteriors])
        axes.plot(seconds, values, color=color, linewidth=2.0, alpha=0.75, zorder=3)
        axes.scatter(
            seconds[grasped], values[grasped], s=58, color=color, zorder=4, edgecolor="white"
        )
        meant = np.array([_of_task(p, task, p.intends) for p in posteriors])
        axes.plot(seconds, meant, color=color, linewidth=1.4, linestyle=":", zorder=3)
        words = f"{task}  {values[-1]:.2f}" + ("  (demonstrated)" if task == true_task else "")
        labels.append((float(values[-1]), words, color))
    for index, stamp in enumerate(grasp_stamps):
        moment = (stamp - start) * 1e-9
        axes.axvline(moment, color=INK, linestyle=(0, (4, 3)), linewidth=1.2, zorder=2)
        axes.annotate(
            "stable grasp" if index == 0 else f"grasp {index + 1}",
            (moment, 1.02),
            xycoords=("data", "axes fraction"),
            ha="center",
            color=INK,
            fontsize=10,
        )
    if grasp_stamps and seconds.size:
        axes.axvspan(
            min(seconds[0], 0.0), (grasp_stamps[0] - start) * 1e-9, color="#f3f5f8", zorder=0
        )
    _label_ends(axes, float(seconds[-1]) if seconds.size else 1.0, labels)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlabel(
        "time [s]   (shaded: the hand still reaches, the guess is preliminary)\n"
        "solid: what the grasp affords; dotted: what the person means with it"
    )
    axes.set_ylabel("p(task | observation)")
    axes.grid(axis="y", color=GRID, zorder=1)


def in_order(posteriors: Sequence[TaskPosterior]) -> list[TaskPosterior]:
    """Return the posteriors by stamp, without forecasts that a conclusion has overtaken.

    A grasp is recognised a few frames after it happened; forecasts of those frames were already
    out when the conclusion came, though their stamps are later.
    """
    kept: list[TaskPosterior] = []
    for posterior in posteriors:
        if not posterior.preliminary:
            kept = [p for p in kept if not p.preliminary or p.stamp < posterior.stamp]
        kept.append(posterior)
    return sorted(kept, key=lambda p: p.stamp)


def _label_ends(axes: Axes, end: float, labels: list[tuple[float, str, str]]) -> None:
    """Write the labels beside the lines' ends, pushed apart so that none covers another."""
    places: list[float] = []
    for value, text, color in sorted(labels):
        places.append(max(value, places[-1] + 0.085 if places else -1.0))
        axes.annotate(
            text,
            (end, value),
            xytext=(1.015, places[-1]),
            textcoords=axes.get_yaxis_transform(),
            color=color,
            fontweight="bold",
            va="center",
            annotation_clip=False,
        )


def _probability(posterior: TaskPosterior, task: str) -> float:
    """Return the probability that a task is afforded, NaN where the model does not know it."""
    return _of_task(posterior, task, posterior.probability)


def _of_task(posterior: TaskPosterior, task: str, values: Array) -> float:
    """Return a task's own of values (T, …); NaN where the posterior's model does not know it."""
    if task not in posterior.tasks:
        return float("nan")
    return float(values[posterior.tasks.index(task)])


def draw_evidence(path: Path, posterior: TaskPosterior) -> None:
    """Draw for each task how far each piece of evidence moved its log-odds, up to p itself."""
    tasks = posterior.tasks
    with figure(path, 9.2, 4.2) as canvas:
        panels = canvas.subplots(1, max(len(tasks), 1), sharey=True, squeeze=False)[0]
        variables = _variables(posterior)
        rest = [prior_bar(posterior, task) for task in tasks]
        reach = (
            max([abs(c.log_odds) for c in posterior.grasp_explanation] + list(map(abs, rest)))
            * 1.12
        )
        for axes, task in zip(panels, tasks, strict=True):
            evidence(axes, posterior, task, variables, max(reach, 0.5))
        canvas.supxlabel("evidence for (right) and against (left) the task [log-odds]", fontsize=11)


def evidence(
    axes: Axes, posterior: TaskPosterior, task: str, variables: Sequence[str], reach: float
) -> None:
    """Draw one task's contributions as bars from the middle, most important variable on top."""
    moved = {c.variable: c.log_odds for c in posterior.grasp_explanation if c.task == task}
    values = [*(moved.get(variable, 0.0) for variable in variables), prior_bar(posterior, task)]
    color = task_color(task, posterior.tasks)
    places = np.arange(len(values))[::-1]
    shades = [color if value >= 0.0 else "#b9c1ca" for value in values]
    shades[-1] = "#6b7682"
    axes.barh(places, values, color=shades, height=0.66, zorder=3)
    axes.axhline(0.5, color=GRID, linewidth=1.0, zorder=2)
    axes.axvline(0.0, color=INK, linewidth=1.0, zorder=4)
    axes.set_xlim(-reach, reach)
    names = [*(VARIABLE_NAMES.get(v, v) for v in variables), "prior, interplay"]
    axes.set_yticks(places, names, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color=GRID, zorder=0)
    axes.set_title(f"{task}\np = {_probability(posterior, task):.2f}", color=color, fontsize=12)


def prior_bar(posterior: TaskPosterior, task: str) -> float:
    """Return the log-odds that the bars of single variables leave over.

    It holds the prior (0 where a task is as likely as not before any evidence) and what variables
    say only together; with it, the bars of a task sum to the log-odds of its probability.
    """
    chance = float(np.clip(_probability(posterior, task), 1e-4, 1.0 - 1e-4))
    moved = sum(c.log_odds for c in posterior.grasp_explanation if c.task == task)
    return float(np.log(chance / (1.0 - chance))) - moved


def _variables(posterior: TaskPosterior) -> list[str]:
    """Return the variables of the explanation, the one that moved most first."""
    weight: dict[str, float] = {}
    for contribution in posterior.grasp_explanation:
        name = contribution.variable
        weight[name] = max(weight.get(name, 0.0), abs(contribution.log_odds))
    return sorted(weight, key=lambda name: -weight[name])


def posterior_bars(axes: Axes, posterior: TaskPosterior) -> None:
    """Draw the final probability of each task as a bar with its number."""
    places = np.arange(len(posterior.tasks))[::-1]
    colors = [task_color(task, posterior.tasks) for task in posterior.tasks]
    bars(axes, places, [float(p) for p in posterior.probability], colors, posterior.tasks)


def object_bars(axes: Axes, plan: GraspPlan) -> None:
    """Draw p(o | t*) of the objects that were judged, the chosen one in the task's colour."""
    judged = [choice for choice in plan.objects if choice.judged]
    places = np.arange(len(judged))[::-1]
    color = TASK_COLORS.get(plan.task, SPARE_COLORS[0])
    chosen = bool(plan.grasps)
    colors = [color if chosen and index == 0 else "#c3cad2" for index in range(len(judged))]
    names = [object_label(choice) for choice in judged]
    bars(axes, places, [choice.probability for choice in judged], colors, names)


def object_label(choice: ObjectChoice) -> str:
    """Return what a reader calls the object."""
    name = choice.id.replace("_", " ")
    return name if choice.affords else f"{name} (unfit)"


def bars(
    axes: Axes,
    places: "np.ndarray[tuple[int], np.dtype[np.int64]]",
    values: Sequence[float],
    colors: Sequence[str],
    names: Sequence[str],
) -> None:
    """Draw horizontal bars from 0 to 1 with the number at the end of each."""
    axes.barh(places, values, color=list(colors), height=0.62, zorder=3)
    for place, value in zip(places, values, strict=True):
        axes.text(value + 0.02, place, f"{value:.2f}", va="center", color=INK, fontsize=10)
    axes.set_yticks(places, list(names), color=INK)
    axes.set_xlim(0.0, 1.16)
    axes.set_xticks([0.0, 0.5, 1.0])
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color=GRID, zorder=0)
