"""Figs. 2 and 4: the quantisation of one variable, the graphs that were learnt."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from intent_inference.network.structure import TASK, Parents
from intent_inference.quantisation.feature_table import is_observed
from intent_inference.quantisation.quantiser import Quantisation, QuantisationConfig, quantise
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import written_beside

if TYPE_CHECKING:
    from intent_inference.network.task_model import TaskModel

_GROUPS = {"task": "#ef5350", "o": "#90caf9", "a": "#a5d6a7", "c": "#ffe082"}
_PLACES = {
    "task": (0.0, 1.15), "obcl": (-1.1, 0.75), "size": (-1.35, 0.1), "conv": (-1.1, -0.55),
    "dir": (-0.35, -0.95), "npos": (0.35, -0.95), "fcon": (1.1, -0.55),
    "fvol": (1.1, 0.75), "coc": (1.35, 0.1), "gbvl": (0.0, 0.25),
}  # fmt: skip


def _figure(width: float, height: float) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def draw_training(table: GraspTable, rng: np.random.Generator, folder: Path) -> None:
    """Draw Fig. 2 for every continuous variable of a table."""
    for name, values in table.features.items():
        if name != OBJECT_CLASS:
            known = values[is_observed(table.features, name)]
            config = QuantisationConfig(states=tuple(range(2, 17)))
            draw_quantisation(
                quantise(name, known, rng, config), known, folder / f"fig2_{name}.png"
            )


def draw_quantisation(quantisation: Quantisation, values: Array, path: Path) -> None:
    """Draw Fig. 2 of one variable: map, U-matrix, index over K, clusters, density.

    Args:
        quantisation: of the variable.
        values: (N, D) the values.
        path: picture to write.
    """
    figure = _figure(15.0, 3.2)
    axes = figure.subplots(1, 5)
    chosen = quantisation.chosen_by_paper()
    states = min(quantisation.criterion, key=lambda k: quantisation.criterion[k])
    standard = chosen.standardise(values)
    sheet = quantisation.sheet
    if sheet is not None:
        rows, columns = np.mgrid[: sheet.shape[0], : sheet.shape[1]]
        hits = sheet.hits(standard)
        size = 60.0 * hits.ravel() / max(int(hits.max()), 1)
        axes[0].scatter(columns.ravel(), rows.ravel(), s=size)
        axes[0].invert_yaxis()  # as the pictures beside it
        axes[1].imshow(sheet.u_matrix(), cmap="gray", aspect="auto")
        clusters = quantisation.labels[states].reshape(sheet.shape)
        axes[3].imshow(clusters, cmap="tab20", aspect="auto")
    else:
        axes[0].hist(values[:, 0], bins=40)
        for axis in (axes[1], axes[3]):
            axis.text(0.5, 0.5, "scalar: bins of\nequal width", ha="center", va="center")
            axis.set_axis_off()
    axes[2].plot(list(quantisation.criterion), list(quantisation.criterion.values()), "o-")
    axes[2].axvline(states, color="0.6", ls="--")
    _draw_density(axes[4], chosen.mixture.log_density, standard)
    index = "BIC" if sheet is None else "Davies-Bouldin index"
    axes[2].set_xlabel("number of states K", fontsize=8)
    axes[4].set_xlabel("standardised, first principal axes", fontsize=8)
    titles = ("a) values" if sheet is None else "a) map units by hits", "b) U-matrix",
              f"c) {index}, K = {states}", "d) clusters", "e) density")  # fmt: skip
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(f"{quantisation.variable}: {title}", fontsize=9)
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_beside(path) as part:
        figure.savefig(part, dpi=100)


def _draw_density(axis: Any, log_density: Any, standard: Array) -> None:
    if standard.shape[1] == 1:
        grid = np.linspace(standard.min(), standard.max(), 200)[:, None]
        axis.plot(grid[:, 0], np.exp(log_density(grid)))
        return
    centre = standard.mean(axis=0)
    _, _, directions = np.linalg.svd(standard - centre, full_matrices=False)
    plane = (standard - centre) @ directions[:2].T
    axis.scatter(plane[:, 0], plane[:, 1], c=log_density(standard), s=3, cmap="viridis")


def draw_structures(model: "TaskModel", path: Path, member: int = 0) -> None:
    """Draw Fig. 4: the graph of one network of every task."""
    count = len(model.networks)
    figure = _figure(4.2 * count, 4.2)
    axes = np.atleast_1d(figure.subplots(1, count))
    for axis, networks in zip(axes, model.networks, strict=True):
        chosen = networks.members[min(member, len(networks.members) - 1)]
        draw_graph(axis, chosen.parents)
        axis.set_title(f"{networks.task} ({chosen.recipe})", fontsize=9)
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_beside(path) as part:
        figure.savefig(part, dpi=110)


def draw_graph(axis: Any, parents: Parents) -> None:
    """Draw one directed graph at the fixed places of the variables of Table I."""
    for variable, chosen in parents.items():
        for parent in chosen:
            axis.annotate(
                "", xy=_PLACES[variable], xytext=_PLACES[parent],
                arrowprops={"arrowstyle": "-|>", "shrinkA": 15, "shrinkB": 15,
                            "color": "#c62828" if TASK in (parent, variable) else "0.45",
                            "lw": 1.1, "connectionstyle": "arc3,rad=0.08"},
            )  # fmt: skip
    for variable in parents:
        x, y = _PLACES[variable]
        group = TASK if variable == TASK else _group(variable)
        axis.scatter([x], [y], s=760, c=_GROUPS[group], edgecolors="0.3", zorder=3)
        axis.text(x, y, variable, ha="center", va="center", fontsize=8, zorder=4)
    axis.set(xlim=(-1.7, 1.7), ylim=(-1.3, 1.5))
    axis.set_axis_off()


def _group(variable: str) -> str:
    if variable in ("obcl", "size", "conv"):
        return "o"
    return "a" if variable in ("dir", "npos", "fcon") else "c"
