"""Feature tables: many grasps at once, any of their variables unknown."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intent_inference.quantisation.variables import OBJECT_CLASS, VARIABLES

if TYPE_CHECKING:
    from intent_tracking.grasp.grasp_features import GraspFeatures

Features = dict[str, NDArray[Any]]
"""Variable of Table I to values (N, D); `obcl` to names (N,), "" where unknown. A row with NaN and
a variable that is absent are not observed."""


def count_rows(features: Features) -> int:
    """Return N of a feature table.

    Raises:
        ValueError: if the table is empty, its lengths differ or a name is not one of Table I.
    """
    unknown = set(features) - set(VARIABLES)
    if unknown:
        raise ValueError(f"expected variables of Table I {VARIABLES}, got {sorted(unknown)}")
    lengths = {name: len(values) for name, values in features.items()}
    if len(set(lengths.values())) != 1:
        raise ValueError(f"expected one number of rows for all variables, got {lengths}")
    return next(iter(lengths.values()))


def select_rows(features: Features, rows: NDArray[Any]) -> Features:
    """Return the given rows (indices or mask) of a feature table."""
    return {name: values[rows] for name, values in features.items()}


def select_variables(features: Features, names: Sequence[str]) -> Features:
    """Return the table with only the given variables."""
    return {name: values for name, values in features.items() if name in names}


def is_observed(features: Features, name: str) -> NDArray[np.bool_]:
    """Return which rows of a variable are known, (N,)."""
    values = features[name]
    if name == OBJECT_CLASS:
        known: NDArray[np.bool_] = np.asarray(values, dtype=str) != ""
        return known
    return np.all(np.isfinite(values), axis=1)


def stack_features(grasps: Sequence["GraspFeatures"]) -> Features:
    """Return one table of several grasps' features; a variable that no grasp has is left out."""
    table: Features = {}
    for name in VARIABLES:
        attribute = "object_class" if name == OBJECT_CLASS else name
        values = [getattr(grasp, attribute) for grasp in grasps]
        known = [value for value in values if value is not None]
        if not known:
            continue
        if name == OBJECT_CLASS:
            table[name] = np.array([value or "" for value in values], dtype=str)
            continue
        blank = np.full(np.size(known[0]), np.nan)
        rows = [blank if value is None else np.asarray(value, float).ravel() for value in values]
        table[name] = np.stack(rows)
    return table
