"""Tables of labelled grasps: any subset of the feature columns, any tasks, empty cells allowed."""

import csv
import gzip
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_inference.quantisation.feature_table import Features, select_rows
from intent_inference.quantisation.variables import OBJECT_CLASS, VARIABLES
from intent_perception.basics.arrays import Array

_SUFFIXES = {"dir": ("x", "y", "z", "w")}
_SCALARS = ("conv", "fvol")
_NOT_TASKS = (
    "hand_side",
    "object_class",
    "object_id",
    "on_handle",
    "preshape",
    "seed",
    "stability",
)
_NOT_TASK_PREFIXES = ("margin_", "wrist_", "contact_", "penetration", "std_")


@dataclass(frozen=True, eq=False)
class GraspTable:
    """N grasps with what is known of their features and labels."""

    features: Features
    labels: dict[str, Array]
    """Task to (N,) 1 (afforded), 0 (not) or NaN (unknown)."""
    columns: dict[str, NDArray[np.str_]]
    """All text columns of the file as they stand, e.g. object_id."""

    @property
    def rows(self) -> int:
        """Number of grasps N."""
        return len(next(iter(self.features.values())))

    def select(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> "GraspTable":
        """Return the given rows."""
        return GraspTable(
            select_rows(self.features, rows),
            {task: values[rows] for task, values in self.labels.items()},
            {name: values[rows] for name, values in self.columns.items()},
        )


def read_grasps(path: Path | str, tasks: Sequence[str] | None = None) -> GraspTable:
    """Return the table of a CSV file (gzip by its name), columns as `simulate` writes them.

    Args:
        path: the file.
        tasks: label columns, () for none; default: every column of 0, 1 and empty cells that is no
            feature.

    Raises:
        ValueError: if the file is empty, ragged, has no feature column or no task column, or a cell
            is no number; the message names the column and the line.
    """
    path = Path(path)
    try:
        with (
            gzip.open(path, "rt", newline="")
            if path.suffix == ".gz"
            else path.open(newline="") as f
        ):
            lines = list(csv.reader(f))
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise ValueError(f"cannot read grasps from {path}: {error}") from error
    if len(lines) < 2:
        raise ValueError(f"{path}: expected a header and at least one grasp")
    names, body = lines[0], [line for line in lines[1:] if line]
    for number, line in enumerate(body, start=2):
        if len(line) != len(names):
            raise ValueError(f"{path}, line {number}: expected {len(names)} cells, got {len(line)}")
    cells = {name: [line[i].strip() for line in body] for i, name in enumerate(names)}
    features = _features(cells)
    if not features:
        raise ValueError(f"{path}: expected at least one feature column of {VARIABLES}")
    used = set(_feature_columns(cells)) | {"object_class"}
    wanted = tasks
    if tasks is None:
        tasks = [n for n in names if n not in used and _looks_like_task(n, cells[n])]
    missing = [task for task in tasks if task not in cells]
    if missing or (wanted is None and not tasks):
        raise ValueError(f"{path}: expected task columns of 0, 1 or empty, missing {missing}")
    labels = {task: _numbers(task, cells[task]) for task in tasks}
    for task, values in labels.items():
        if not np.all(np.isin(values[np.isfinite(values)], (0.0, 1.0))):
            raise ValueError(f"{path}: column {task}: expected 0, 1 or empty")
    return GraspTable(features, labels, {n: np.array(cells[n], dtype=str) for n in names})


def deviations_of(table: GraspTable) -> Features:
    """Return the standard deviations in a table's `std_` columns, NaN where there is none."""
    cells = {
        name.removeprefix("std_"): list(values)
        for name, values in table.columns.items()
        if name.startswith("std_")
    }
    return {name: v for name, v in _features(cells).items() if name in table.features}


def _feature_columns(cells: dict[str, list[str]]) -> dict[str, str]:
    """Return the columns that hold features: column to variable."""
    found = {}
    for variable in VARIABLES:
        if variable == OBJECT_CLASS:
            continue
        if variable in _SCALARS:
            candidates = [variable]
        elif variable in _SUFFIXES:
            candidates = [f"{variable}_{suffix}" for suffix in _SUFFIXES[variable]]
        else:
            candidates = [f"{variable}_{i}" for i in range(100)]
        found.update({column: variable for column in candidates if column in cells})
    return found


def _features(cells: dict[str, list[str]]) -> Features:
    features: Features = {}
    if "object_class" in cells:
        features[OBJECT_CLASS] = np.array(cells["object_class"], dtype=str)
    columns = _feature_columns(cells)
    for variable in VARIABLES:
        own = [column for column, name in columns.items() if name == variable]
        if not own:
            continue
        if variable == "dir" and len(own) != 4:
            raise ValueError(f"dir: expected columns dir_x, dir_y, dir_z, dir_w, got {own}")
        values = np.stack([_numbers(column, cells[column]) for column in own], axis=1)
        if np.isfinite(values).any():
            features[variable] = values
    return features


def _numbers(column: str, cells: list[str]) -> Array:
    values = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if cell and cell.lower() != "nan":
            try:
                values[row] = float(cell)
            except ValueError:
                raise ValueError(
                    f"column {column}, line {row + 2}: expected a number, got {cell!r}"
                ) from None
    values[~np.isfinite(values)] = np.nan
    return values


def _looks_like_task(name: str, cells: list[str]) -> bool:
    if name in _NOT_TASKS or name.startswith(_NOT_TASK_PREFIXES):
        return False
    values = {cell for cell in cells if cell}
    return bool(values) and values <= {"0", "1", "0.0", "1.0", "nan"}
