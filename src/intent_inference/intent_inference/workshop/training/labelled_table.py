"""Tables of labelled grasps: any subset of the feature columns, any tasks, empty cells allowed."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_inference.quantisation.feature_table import Features, select_rows
from intent_inference.quantisation.variables import OBJECT_CLASS, VARIABLES
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_tracking.grasp.grasp_features import FEATURE_RANGES

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
_LARGEST = 256 << 20
"""Bytes of a table."""
_OTHER_MARKS = {";": "semicolons", "\t": "tabs", "|": "bars"}
_LABELS = {"0": 0.0, "1": 1.0, "0.0": 0.0, "1.0": 1.0}
_LABEL_WORDS = frozenset({"true", "false", "yes", "no", "t", "f", "y", "n"})
_UNIT = 0.02
"""Tolerance of the length of unit vectors: tables round."""
_MEANINGS = {
    "fcon": "joint angles in rad (are they in degrees?)",
    "size": "edges in m, longer than 0.1 mm (are they in mm?)",
    "gbvl": "edges in m (are they in mm?)",
    "dir": "a unit quaternion x, y, z, w",
    "npos": "a unit vector",
}
_NOT_TASK_PREFIXES = ("margin_", "wrist_", "contact_", "penetration", "std_")


@dataclass(frozen=True, eq=False)
class GraspTable:
    """N grasps with what is known of their features and labels."""

    features: Features
    labels: dict[str, Array]
    """Task to (N,) 1 (afforded), 0 (not) or NaN (unknown)."""
    columns: dict[str, NDArray[np.str_]]
    """All text columns of the file as they stand, e.g. object_id."""
    unused: tuple[str, ...] = ()
    """Columns of the file that are neither features nor labels nor known otherwise."""

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
            self.unused,
        )


def read_grasps(path: Path | str, tasks: Sequence[str] | None = None) -> GraspTable:
    """Return the table of a CSV file (gzip by its name), columns as `simulate` writes them.

    Args:
        path: the file.
        tasks: label columns, () for none; default: every column of 0, 1 and empty cells that is no
            feature.

    Raises:
        ValueError: if the file is empty, ragged, has a column twice, no feature column or no task
            column, or a cell is no number, no label or out of range; the message names the column
            and the line.
    """
    path = Path(path)
    names, body, lines = _cells(path)
    cells = {name: [line[i].strip() for line in body] for i, name in enumerate(names)}
    try:
        features = _features(cells, lines)
        if not features:
            raise ValueError(f"expected at least one feature column of {VARIABLES}")
        _check_ranges(features, lines)
        labels = _labels(cells, lines, tasks)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    used = {*_feature_columns(cells), "object_class", *labels}
    known = (*_NOT_TASKS, "demonstration", "shown", "delay")
    unused = [n for n in names if n not in (*used, *known) and not n.startswith(_NOT_TASK_PREFIXES)]
    columns = {n: np.array(cells[n], dtype=str) for n in names}
    return GraspTable(features, labels, columns, tuple(unused))


def _cells(path: Path) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the names of the columns, the rows, and the line of each row in the file."""
    text = read_text(path, _LARGEST)
    reader = csv.reader(io.StringIO(text))
    rows, lines = [], []
    try:
        for row in reader:
            if row:
                rows.append(row)
                lines.append(reader.line_num)
    except csv.Error as error:
        raise ValueError(f"{path}, line {reader.line_num}: {error} (damaged?)") from error
    if len(rows) < 2:
        raise ValueError(f"{path}: expected a header and at least one grasp")
    names, body = [name.strip() for name in rows[0]], rows[1:]
    if len(names) == 1 and (found := [mark for mark in _OTHER_MARKS if mark in names[0]]):
        raise ValueError(
            f"{path}: expected columns between commas, got {_OTHER_MARKS[found[0]]}: "
            "save the table as CSV with commas and decimal points"
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{path}: the column {', '.join(map(repr, twice))} stands there twice")
    for number, row in zip(lines[1:], body, strict=True):
        if len(row) != len(names):
            raise ValueError(f"{path}, line {number}: expected {len(names)} cells, got {len(row)}")
    return names, body, lines[1:]


def _labels(
    cells: dict[str, list[str]], lines: list[int], tasks: Sequence[str] | None
) -> dict[str, Array]:
    """Return the label columns: those that are asked for, or all that look like labels."""
    used = {*_feature_columns(cells), "object_class"}
    wanted = tasks
    if tasks is None:
        tasks = [n for n in cells if n not in used and _looks_like_task(n, cells[n])]
    missing = [task for task in tasks if task not in cells]
    if missing or (wanted is None and not tasks):
        raise ValueError(f"expected task columns of 0, 1 or empty, missing {missing}")
    return {task: _zeros_and_ones(task, cells[task], lines) for task in tasks}


def _zeros_and_ones(task: str, cells: list[str], lines: list[int]) -> Array:
    """Return the labels (N,) of a column, NaN where it is empty."""
    values = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if cell in _LABELS:
            values[row] = _LABELS[cell]
        elif cell and cell.lower() != "nan":
            raise ValueError(
                f"column {task}, line {lines[row]}: expected 0, 1 or empty, got {cell!r}: write 1 "
                "where the grasp affords the task and 0 where not (or name the label columns "
                "by --tasks)"
            )
    return values


def _check_ranges(features: Features, lines: list[int]) -> None:
    """Refuse values that Table I cannot have: degrees, millimetres, quaternions that are none."""
    for name, values in features.items():
        if name == OBJECT_CLASS:
            continue
        count, low, high = FEATURE_RANGES[name]
        if count and values.shape[1] != count:
            raise ValueError(f"{name}: expected {count} columns, got {values.shape[1]}")
        with np.errstate(invalid="ignore"):
            wrong = np.any((values < low) | (values > high), axis=1)
            if name in ("dir", "npos"):
                wrong |= np.abs(np.linalg.norm(values, axis=1) - 1.0) > _UNIT
        if np.any(wrong):
            row = int(np.flatnonzero(wrong)[0])
            raise ValueError(
                f"{name}, line {lines[row]}: {np.round(values[row], 4).tolist()} is out of range; "
                f"expected {_MEANINGS.get(name, f'{low:g} to {high:g}')}; so are "
                f"{int(wrong.sum()) - 1} more lines"
            )


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


def _features(cells: dict[str, list[str]], lines: Sequence[int] = ()) -> Features:
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
        values = np.stack([_numbers(column, cells[column], lines) for column in own], axis=1)
        if np.isfinite(values).any():
            features[variable] = values
    return features


def _numbers(column: str, cells: list[str], lines: Sequence[int]) -> Array:
    values = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if cell and cell.lower() != "nan":
            try:
                values[row] = float(cell)
            except ValueError:
                values[row] = np.inf
            if not np.isfinite(values[row]):
                line = lines[row] if lines else row + 2
                raise ValueError(f"column {column}, line {line}: expected a number, got {cell!r}")
    return values


def _looks_like_task(name: str, cells: list[str]) -> bool:
    """Return whether at least half of a column's cells are labels, however they are written."""
    if name in _NOT_TASKS or name.startswith(_NOT_TASK_PREFIXES):
        return False
    values = [cell.lower() for cell in cells if cell and cell.lower() != "nan"]
    alike = sum(value in _LABELS or value in _LABEL_WORDS for value in values)
    return alike > 0 and 2 * alike >= len(values)
