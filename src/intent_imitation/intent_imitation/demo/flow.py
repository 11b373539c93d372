"""The whole process as one picture, after Fig. 6 of the paper, drawn from a real run."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from intent_imitation.demo.charts import figure, object_bars, posterior_bars
from intent_imitation.demo.mesh_pictures import INK, SOFT, Image
from intent_imitation.planner.plan import GraspPlan
from intent_inference.intention.task_posterior import TaskPosterior

_WIDTH, _HEIGHT = 13.6, 7.4  # inches
_TOP, _BOTTOM = 0.535, 0.035  # lower edges of the two rows
_ROW = 0.40


def draw_flow(
    path: Path,
    demonstration: Image | None,
    posterior: TaskPosterior | None,
    robot_table: Image | None,
    plan: GraspPlan | None,
    hypotheses: Sequence[Image],
    grasp: Image | None,
) -> None:
    """Draw demonstration -> intention -> object -> hypotheses -> grasp.

    Args:
        path: PNG file to write.
        demonstration: the tracked hand at the grasp.
        posterior: the conclusion of BN^H.
        robot_table: what the robot sees.
        plan: the choice of BN^R.
        hypotheses: up to four ranked grasps.
        grasp: the best grasp, drawn large.
    """
    with figure(path, _WIDTH, _HEIGHT) as canvas:
        canvas.set_layout_engine("none")
        _backdrop(canvas)
        _photo(canvas, (0.02, _TOP, 0.292, _ROW), demonstration, "1   The human's grasp, tracked")
        task = "" if posterior is None or posterior.best is None else f":  t* = {posterior.best}"
        axes = _panel(canvas, (0.455, _TOP + 0.05, 0.17, _ROW - 0.09), f"2   Intention{task}")
        if posterior is not None:
            posterior_bars(axes, posterior)
        else:
            _nothing(axes, "no stable grasp was seen")
        _photo(canvas, (0.692, _TOP, 0.292, _ROW), robot_table, "3   The robot's own table")
        axes = _panel(canvas, (0.825, _BOTTOM + 0.05, 0.14, _ROW - 0.09), "4   Object:  p(o | t*)")
        if plan is not None and any(choice.judged for choice in plan.objects):
            object_bars(axes, plan)
        else:
            _nothing(axes, why_no_object(plan))
        _hypotheses(canvas, hypotheses, plan)
        _photo(canvas, (0.02, _BOTTOM, 0.22, _ROW), grasp, "6   The robot's grasp")
        _arrows(canvas)


def _backdrop(canvas: Figure) -> None:
    """Tint the human's half and the robot's half of the process."""
    for corner, width, height, color in (
        ((0.004, 0.508), 0.664, 0.486, "#f0f5fb"),
        ((0.676, 0.508), 0.320, 0.486, "#eff8f3"),
        ((0.004, 0.006), 0.992, 0.494, "#eff8f3"),
    ):
        box = FancyBboxPatch(
            corner, width, height, boxstyle="round,pad=0,rounding_size=0.008",
            facecolor=color, edgecolor="none", transform=canvas.transFigure, zorder=-5,
        )  # fmt: skip
        canvas.add_artist(box)


def _panel(canvas: Figure, place: tuple[float, float, float, float], title: str) -> Axes:
    """Return axes with the step's title above, in line with the pictures' titles."""
    axes = canvas.add_axes(place)
    axes.patch.set_alpha(0.0)
    canvas.text(place[0] - 0.09, place[1] + place[3] + 0.048, title, fontsize=12, weight="bold")
    return axes


def _photo(
    canvas: Figure, place: tuple[float, float, float, float], image: Image | None, title: str
) -> None:
    """Show a picture with its title; a missing one is named."""
    axes = canvas.add_axes((place[0], place[1], place[2], place[3]))
    axes.set_axis_off()
    axes.set_title(title, fontsize=12, pad=6)
    if image is None:
        _nothing(axes, "not reached in this run")
        return
    axes.imshow(image, interpolation="antialiased")
    axes.set_anchor("NW")


def _hypotheses(canvas: Figure, pictures: Sequence[Image], plan: GraspPlan | None) -> None:
    """Show the ranked hypotheses, the best one next to the grasp."""
    title = canvas.add_axes((0.275, _BOTTOM, 0.435, _ROW))
    title.set_axis_off()
    title.set_title("5   Grasps ranked by p(a | o*, t*) and stability", fontsize=12, pad=6)
    if not pictures:
        refused = "no grasp was planned"
        if plan is not None and plan.grasps:
            refused = f"{len(plan.grasps)} grasps; the hand's shape is not known"
        if plan is not None and plan.nothing_recognised:
            refused = "nothing was recognised here"
        elif plan is not None and plan.nothing_affords:
            refused = "nothing here affords the task"
        _nothing(title, refused)
    elif plan is not None:
        words = f"best first, of {len(plan.grasps)} that the hand can reach among its neighbours"
        title.text(0.0, 0.035, words, color=SOFT, fontsize=10.5, transform=title.transAxes)
    width = 0.435 / 4
    for index, picture in enumerate(pictures[:4]):
        axes = canvas.add_axes((0.275 + width * index, _BOTTOM + 0.055, width * 0.97, 0.335))
        axes.set_axis_off()
        axes.imshow(picture, interpolation="antialiased")


def why_no_object(plan: GraspPlan | None) -> str:
    """Return why there is no bar of an object."""
    if plan is None:
        return "no task to choose for"
    return "nothing was recognised" if plan.nothing_recognised else "nothing could be judged"


def _nothing(axes: Axes, words: str) -> None:
    axes.set_axis_off()
    axes.text(0.5, 0.5, words, ha="center", va="center", color=SOFT, transform=axes.transAxes)


def _arrows(canvas: Figure) -> None:
    """Draw the way through the steps."""
    for start, end in (
        ((0.322, 0.72), (0.352, 0.72)),
        ((0.648, 0.72), (0.686, 0.72)),
        ((0.84, 0.528), (0.84, 0.478)),
        ((0.745, 0.255), (0.715, 0.255)),
        ((0.270, 0.255), (0.242, 0.255)),
    ):
        canvas.add_artist(
            FancyArrowPatch(
                start,
                end,
                arrowstyle="-|>",
                mutation_scale=20,
                linewidth=2.2,
                color=INK,
                transform=canvas.transFigure,
                zorder=10,
            )
        )
