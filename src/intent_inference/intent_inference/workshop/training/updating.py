"""Labelled demonstrations added to a trained model, without training it again (Sec. IV-B.2)."""

from dataclasses import replace

import numpy as np

from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.training.fitting import assign
from intent_inference.workshop.training.labelled_table import GraspTable

_MOST = 1e6
"""Weight of a grasp beyond which counts lose their digits."""


def add_demonstrations(model: TaskModel, table: GraspTable, weight: float = 1.0) -> TaskModel:
    """Return the model after more labelled grasps: counts add, structure and states stay.

    Adding parts one after the other gives the same tables as adding them together.

    Args:
        model: a trained model.
        table: grasps with labels of some of the model's tasks; variables that the model has and the
            table lacks are unknown there.
        weight: how much a grasp counts; one demonstration among thousands of simulated grasps says
            little at 1.

    Raises:
        ValueError: if no task or no variable of the model is in the table, or the weight is not
            positive.
    """
    if not 0.0 < weight < _MOST:
        raise ValueError(f"weight: expected more than 0 and at most {_MOST:g}, got {weight}")
    tasks = [task for task in model.tasks if task in table.labels]
    if not tasks:
        raise ValueError(f"expected labels of {model.tasks}, got {tuple(table.labels)}")
    if not set(table.features) & set(model.variables):
        raise ValueError(f"expected features of {model.variables}, got {tuple(table.features)}")
    features = {name: v for name, v in table.features.items() if name in model.variables}
    here = {key: q for key, q in model.quantisers.items() if q.variable in features}
    assignments = assign(features, here, model.classes)
    for key, quantiser in model.quantisers.items():
        if key not in assignments:
            assignments[key] = np.zeros((table.rows, quantiser.states))
    if model.classes and OBJECT_CLASS not in assignments:
        assignments[OBJECT_CLASS] = np.zeros((table.rows, len(model.classes)))
    networks = []
    for own in model.networks:
        labels = table.labels.get(own.task, np.full(table.rows, np.nan))
        known = np.isfinite(labels)
        one_hot = np.zeros((table.rows, 2))
        one_hot[known] = np.eye(2)[labels[known].astype(np.int64)]
        weights = np.full(table.rows, weight)
        members = tuple(m.with_rows(assignments, one_hot, weights) for m in own.members)
        networks.append(replace(own, members=members))
    added = int(model.description.get("added", "0")) + table.rows
    return replace(
        model, networks=tuple(networks), description={**model.description, "added": str(added)}
    )
