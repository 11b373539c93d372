"""What a task demands of an object's shape and pose, whatever grasp is used.

Bayesian networks over size and convexity cannot tell a ball from a bottle when nobody says the
class, and no feature of Table I says how an object stands. Pouring needs both: a vessel, upright.
The paper is silent about it; its robot met only objects that stood as they should.
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectModel

UPRIGHT_TASKS = ("pouring",)
"""Tasks that need what is in the object: it must be a vessel and stand with its opening up."""

_STEP = 0.004  # of the columns and sections through a mesh [m]
_DEEP, _DEEPEST = 0.25, 0.015  # a cavity is at least this deep: share of the height, and [m]
_NARROW, _TALL = 0.65, 1.4  # a bottle: neck width / body width, height / body width


def fits_pose(
    task: str, model: ObjectModel, pose: Array, distance: SignedDistance, annotated: bool
) -> bool:
    """Return whether an object as it stands can serve a task at all.

    Args:
        task: name of the task.
        model: the object.
        pose: T_table_object (4, 4).
        distance: signed distance of its mesh.
        annotated: whether its annotations may be used; else the shape alone speaks, in an object
            frame whose z axis is up in natural use (the convention of all features).
    """
    if task not in UPRIGHT_TASKS:
        return True
    up = np.array([0.0, 0.0, 1.0])
    if annotated and model.functions is not None:
        if model.functions.opening is None:
            return False
        up = model.functions.opening.normal
    elif not is_vessel(model, distance):
        return False
    return bool((pose[:3, :3] @ up)[2] > 0.5)


def is_vessel(model: ObjectModel, distance: SignedDistance) -> bool:
    """Return whether a mesh has a cavity that is open at the top, or a bottle's neck."""
    low, high = model.mesh.bounds
    height = float(high[2] - low[2])
    levels = np.arange(low[2] + 0.5 * _STEP, high[2], _STEP)
    column = np.zeros((len(levels), 3))
    column[:, :2] = 0.5 * (low + high)[:2]
    column[:, 2] = levels
    solid = np.flatnonzero(distance.distance(column) < 0.0)
    if len(solid) > 0 and high[2] - levels[solid[-1]] > max(_DEEP * height, _DEEPEST):
        return True  # there is a bottom, far below the rim
    widths = np.array([_width(distance, low, high, level) for level in levels])
    body, neck = float(widths.max()), float(widths[int(0.93 * len(widths)) :].max())
    return 0.0 < neck < _NARROW * body and height > _TALL * body


def _width(distance: SignedDistance, low: Array, high: Array, level: float) -> float:
    """Return the greatest extent along x or y of the section at a height [m]."""
    x = np.arange(low[0] + 0.5 * _STEP, high[0], _STEP)
    y = np.arange(low[1] + 0.5 * _STEP, high[1], _STEP)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    points = np.concatenate([grid, np.full((*grid.shape[:2], 1), level)], axis=-1)
    inside = distance.distance(points) < 0.0
    columns, rows = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    if len(columns) == 0:
        return 0.0
    return _STEP * (1.0 + max(float(np.ptp(columns)), float(np.ptp(rows))))
