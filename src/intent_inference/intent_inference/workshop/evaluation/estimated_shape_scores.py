"""The demonstrations with objects that nobody modelled: each tracked by its estimated shape.

The films are those of `demonstrations.csv.gz`; a demonstration of which no shape was estimated, or
no grasp found, counts as one without any evidence.
"""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.grasp_cells import Row
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.evaluation.demonstration_maker import (
    stored_demonstration,
    write_rows,
)
from intent_inference.workshop.evaluation.demonstration_scores import task_scores
from intent_inference.workshop.evaluation.tracked_people import estimated_demonstration
from intent_inference.workshop.training.labelled_table import GraspTable, read_grasps
from intent_perception.basics.progress import counted


def estimated_shape_figures(
    model: TaskModel, data: Path, archive: Path, count: int, seed: int
) -> dict[str, Any] | None:
    """Return the contract's `estimated_shapes`; None where there are no demonstrations.

    Args:
        model: BN^H.
        data: folder with demonstrations.csv.gz.
        archive: folder where films that are tracked are kept; they are not tracked again.
        count: of demonstrations, spread evenly over the table.
        seed: of the bootstrap.
    """
    path = data / "demonstrations.csv.gz"
    if not path.is_file():
        return None
    table = read_grasps(path, model.tasks)
    spread = np.linspace(0, table.rows - 1, min(count, table.rows))
    true = table.select(np.unique(spread.round().astype(np.int64)))
    archive.mkdir(parents=True, exist_ok=True)
    numbers = true.columns["demonstration"].astype(int).tolist()
    made = [
        stored_demonstration(number, archive, estimated_demonstration)
        for number in counted("demonstration", numbers)
    ]
    rows = [own["grasp"] or _without_evidence(true, row) for row, own in enumerate(made)]
    write_rows(archive / "estimated.csv.gz", rows)
    estimated = read_grasps(archive / "estimated.csv.gz", model.tasks)
    tracked = np.array([own["grasp"] is not None for own in made])
    told = estimated.features[OBJECT_CLASS] == true.features[OBJECT_CLASS]
    return {
        **task_scores(model, estimated, seed),
        "count": true.rows,
        "of": table.rows,
        "lost": dict(Counter(own["reason"] for own in made if own["reason"])),
        "class_right": float(told[tracked].mean()) if tracked.any() else None,
        "auc_mean_true_shape": task_scores(model, true, seed)["auc_mean"],
        "pixels": "synthetic",
    }


def _without_evidence(table: GraspTable, row: int) -> Row:
    """Return a row of the table's labels alone."""
    kept = ("demonstration", "object_id", *table.labels)
    return {name: str(table.columns[name][row]) for name in kept}
