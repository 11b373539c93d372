"""Labels of a table of grasps renewed where its archive of contacts and forces is gone.

The table keeps every margin of every term: those that need forces or receivers stay as they were,
those that follow from pose and posture are measured again.
"""

from collections.abc import Callable, Sequence

import numpy as np

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.simulation.grasp_table import poses_of_rows
from intent_inference.workshop.simulation.labels import renewed_terms


def renewed_rows(
    rows: Sequence[dict[str, str]], target_of: Callable[[str], TaskObject], hand: GraspingHand
) -> list[Row]:
    """Return the rows with labels and margins of the rules as they are now.

    Args:
        rows: of a table that `simulate` wrote, grasps of one object in a row.
        target_of: object by name.
        hand: that grasps.
    """
    poses, renewed = poses_of_rows(rows), []
    target: TaskObject | None = None
    for row, pose in zip(rows, poses, strict=True):
        if target is None or target.model.name != row["object_id"]:
            target = target_of(row["object_id"])
        count = len(hand.table.limits)
        joints = np.array([float(row[f"fcon_{k}"]) for k in range(count)])
        fresh: Row = dict(row)
        for task, terms in renewed_terms(target, hand, pose, joints).items():
            _renew(fresh, task, terms)
        renewed.append(fresh)
    return renewed


def _renew(row: Row, task: str, terms: dict[str, float]) -> None:
    """Put terms and what follows from them into a row."""
    if not terms or row[task] == "":
        return
    prefix = f"margin_{task.replace('-', '_')}"
    row.update({f"{prefix}_{name}": value for name, value in terms.items()})
    margins = [
        float(value) for name, value in row.items() if name.startswith(f"{prefix}_") and value != ""
    ]
    row[prefix] = float(np.clip(min(margins), -5.0, 5.0))
    row[task] = int(min(margins) >= 0.0)
