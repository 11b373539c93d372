"""Grasps as a table {O, A, C, T}: one row per grasp, one column per number, empty = unknown."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.quantisation.grasp_cells import Row, feature_cells, vector_cells, write_cells
from intent_inference.workshop.simulation.labels import TASKS, TaskLabel, label_grasp
from intent_inference.workshop.simulation.simulated_grasp import SimulatedGrasp
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_perception.geometry.transforms import quaternion_from_rotation, rotation_from_quaternion
from intent_tracking.grasp.grasp_features import grasp_features

_LARGEST = 256 << 20
"""Bytes of a table."""
_POSITION, _ANGLE = 0.005, np.radians(5.0)
"""Grasps nearer than this in wrist position, orientation and every joint are duplicates."""
_HANDLE_SHARE = 0.5
"""Share of the contact force from which a grasp is on the handle."""
_OBJECT_SHARE = 0.10
"""Largest share of a task's positives that one object may give."""


def row_of_grasp(target: TaskObject, hand: GraspingHand, grasp: SimulatedGrasp) -> Row:
    """Return the features, labels and margins of one grasp as a row."""
    features = grasp_features(target.geometry, grasp.T_object_hand, grasp.joints, hand.table)
    labels = label_grasp(target, hand, grasp.T_object_hand, grasp.joints, grasp.contacts)
    share = target.handle_share(grasp.contacts)
    row: Row = {"object_id": target.model.name, **feature_cells(features)}
    for task in TASKS:
        afforded = labels[task].afforded
        row[task] = "" if afforded is None else int(afforded)
    row.update(_margin_cells(labels))
    row["stability"] = grasp.stability
    row["penetration"] = grasp.penetration
    row["preshape"] = grasp.preshape
    row["on_handle"] = "" if share is None else int(share > _HANDLE_SHARE)
    row.update(vector_cells("wrist", grasp.T_object_hand[:3, 3]))
    return row


def write_rows(path: Path, rows: Iterable[Row]) -> None:
    """Write rows to a CSV file, compressed if its name ends in .gz; equal rows give equal bytes."""
    rows = list(rows)
    columns: dict[str, None] = {}
    for row in sorted(rows, key=len, reverse=True):
        columns.update(dict.fromkeys(row))
    ordered = sorted(columns, key=_column_order)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_cells(path, ordered, rows)


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file, compressed or not.

    Raises:
        ValueError: if the file cannot be read.
    """
    try:
        return list(csv.DictReader(io.StringIO(read_text(path, _LARGEST)), strict=True))
    except (ValueError, csv.Error) as error:
        raise ValueError(f"{path}: expected a table of grasps ({error})") from error


def without_duplicates(
    T_object_hand: Array, joints: Array, order: Sequence[int] | None = None
) -> NDArray[np.int64]:
    """Return indices of grasps of one object that are pairwise distinct, first come first kept.

    Args:
        T_object_hand: (N, 4, 4).
        joints: (N, J) [rad].
        order: indices in the order in which grasps are considered.
    """
    quaternions = quaternion_from_rotation(T_object_hand[:, :3, :3])
    positions = T_object_hand[:, :3, 3]
    kept: list[int] = []
    for index in range(len(joints)) if order is None else order:
        near = np.linalg.norm(positions[kept] - positions[index], axis=1) < _POSITION
        cosine = np.abs(quaternions[kept] @ quaternions[index])
        near &= 2.0 * np.arccos(np.minimum(cosine, 1.0)) < _ANGLE
        near &= np.abs(joints[kept] - joints[index]).max(axis=1, initial=0.0) < _ANGLE
        if not near.any():
            kept.append(int(index))
    return np.array(kept, dtype=np.int64)


def balanced(rows: Sequence[Row], share: float = _OBJECT_SHARE) -> list[Row]:
    """Return the rows without those by which one object gives too many of a task's positives.

    Where a task is afforded by fewer than 1 / share objects, each may give an equal part.
    """
    kept = list(rows)
    for task in TASKS:
        for _ in range(20):
            positives = [row for row in kept if row[task] == 1]
            counts: dict[object, int] = {}
            for row in positives:
                counts[row["object_id"]] = counts.get(row["object_id"], 0) + 1
            allowed = max(share, 1.0 / max(len(counts), 1)) * len(positives)
            excess = {name: n - int(allowed) for name, n in counts.items() if n > allowed + 1}
            if not excess:
                break
            remaining: list[Row] = []
            for row in reversed(kept):
                name = row["object_id"]
                if row[task] == 1 and excess.get(str(name), 0) > 0:
                    excess[str(name)] -= 1
                else:
                    remaining.append(row)
            kept = remaining[::-1]
    return kept


def poses_of_rows(rows: Sequence[dict[str, str]]) -> Array:
    """Return T_object_hand (N, 4, 4) of rows of a table."""
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    if rows:
        quaternions = [[float(row[f"dir_{axis}"]) for axis in "xyzw"] for row in rows]
        poses[:, :3, :3] = rotation_from_quaternion(np.array(quaternions))
        poses[:, :3, 3] = [[float(row[f"wrist_{k}"]) for k in range(3)] for row in rows]
    return poses


def _margin_cells(labels: dict[str, TaskLabel]) -> Row:
    """Return `margin_TASK` and `margin_TASK_TERM` for all known margins."""
    cells: Row = {}
    for task, label in labels.items():
        name = task.replace("-", "_")
        if not np.isnan(label.margin):
            cells[f"margin_{name}"] = label.margin
        cells.update({f"margin_{name}_{term}": value for term, value in label.terms.items()})
    return cells


_GROUPS = (
    "object_id", "object_class", "size", "conv", "dir", "npos", "fcon", "fvol", "coc", "gbvl",
    *TASKS, "margin", "stability", "penetration", "preshape", "on_handle", "wrist",
)  # fmt: skip


def _column_order(column: str) -> tuple[int, str, int, str]:
    """Order columns as the contract lists them; numbered ones by number."""
    group = next(
        i for i, name in enumerate(_GROUPS) if column == name or (column.startswith(f"{name}_"))
    )
    stem, _, last = column.rpartition("_")
    if last.isdigit():
        return group, stem, int(last), ""
    return group, "" if group == _GROUPS.index("dir") else column, "xyzw".find(last), column
