"""How far one labelled demonstration moves what the networks say (`train add`, Sec. IV-B.2)."""

from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.intention.estimator import InferenceConfig, least_deviations
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_variables
from intent_inference.quantisation.variables import ACTION, OBJECT, OBJECT_CLASS
from intent_inference.workshop.training.labelled_table import GraspTable, deviations_of, read_grasps
from intent_inference.workshop.training.updating import add_demonstrations
from intent_perception.basics.arrays import Array

_WEIGHTS = (1.0, 10.0, 100.0)
_DOUBTFUL = (0.2, 0.8)
"""Grasps whose p lies between these are settled by a row; of others the model is sure."""


def one_row_figures(
    model: TaskModel, folder: Path, count: int, seed: int
) -> dict[str, dict[str, Any]] | None:
    """Return how far a row labelled against the model's leaning moves p; C is not observed.

    Args:
        model: BN^H.
        folder: with demonstrations.csv.gz; None comes back where it is absent.
        count: most rows of each task.
        seed: of the choice of rows.

    Returns:
        Per task the number of `rows`, and for each weight the mean move of p of `that_grasp` and
        of the `others` of its class.
    """
    path = folder / "demonstrations.csv.gz"
    if not path.is_file():
        return None
    grasps = read_grasps(path, model.tasks)
    features = select_variables(grasps.features, (*OBJECT, *ACTION))
    table = GraspTable(features, grasps.labels, grasps.columns)
    before = told_chances(model, table)
    rng, figures = np.random.default_rng(seed), {}
    for column, task in enumerate(model.tasks):
        low, high = _DOUBTFUL
        doubtful = np.flatnonzero((before[:, column] > low) & (before[:, column] < high))
        rows = rng.permutation(doubtful)[:count]
        moves: dict[str, Any] = {"rows": len(rows)}
        for weight in _WEIGHTS:
            each = [row_moves(model, table, before, task, int(row), weight) for row in rows]
            own, others = np.mean(each, axis=0) if each else (None, None)
            moves[f"weight_{weight:g}"] = {"that_grasp": own, "others": others}
        figures[task] = moves
    return figures


def told_chances(model: TaskModel, table: GraspTable) -> Array:
    """Return p (N, tasks) of grasps as the inference node says it, their deviations counted."""
    deviations = least_deviations(table.features, InferenceConfig(), deviations_of(table))
    return np.asarray(model.posterior(table.features, deviations))


def row_moves(
    model: TaskModel, table: GraspTable, before: Array, task: str, row: int, weight: float
) -> tuple[float, float]:
    """Return by how much one row, labelled against the model's leaning, moves p of its task.

    Args:
        model: before it is taught.
        table: N grasps.
        before: (N, tasks) what the model says of them.
        task: that the label is of.
        row: of the table.
        weight: of the row.

    Returns:
        The move of p of that grasp, and the mean move of the others of its class; without others 0.
    """
    column = model.tasks.index(task)
    label = {task: np.array([float(before[row, column] < 0.5)])}
    one = GraspTable(table.select(np.array([row])).features, label, {})
    after = told_chances(add_demonstrations(model, one, weight), table)
    moved = np.abs(after[:, column] - before[:, column])
    classes = table.features[OBJECT_CLASS]
    alike = np.asarray(classes == classes[row])
    alike[row] = False
    return float(moved[row]), float(moved[alike].mean()) if alike.any() else 0.0
