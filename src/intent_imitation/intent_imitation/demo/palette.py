"""Colours that mean the same in every picture."""

from collections.abc import Sequence

TASK_COLORS = {
    "hand-over": "#0072B2",
    "pouring": "#009E73",
    "tool-use": "#D55E00",
    "dish-washing": "#8A5FBF",
}
SPARE_COLORS = ("#B8860B", "#56748C", "#A0466B", "#4E7D3A")
"""For tasks that a user has added."""
INK, SOFT, GRID = "#1f2933", "#66727f", "#e3e8ed"


def task_color(task: str, tasks: Sequence[str]) -> str:
    """Return the colour of a task, the same in every picture."""
    spare = [name for name in tasks if name not in TASK_COLORS]
    if task in TASK_COLORS or task not in spare:
        return TASK_COLORS.get(task, SOFT)
    return SPARE_COLORS[spare.index(task) % len(SPARE_COLORS)]


def rgb(code: str) -> tuple[int, int, int]:
    """Return the bytes of a colour such as #0072B2."""
    red, green, blue = (int(code[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue
