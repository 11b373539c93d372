"""Standard deviation of every value of the state, from the normal matrix of the refinement."""

import numpy as np

from intent_perception.geometry import Array
from intent_tracking.scene import HAND_SIZE, OBJECT_SIZE
from intent_tracking.scene_track import Fit

POINT_DEVIATION = 0.006
"""Deviation that one observed point stands for [m]: noise, and the model's wrong thickness."""
FLOOR_PLACE, FLOOR_ANGLE = 0.001, 0.03
"""No value is known better than this [m], [rad]: wrong bone lengths average to nothing."""
REST_PLACE, REST_ANGLE = 0.002, 0.03
"""Deviation of an object at rest [m], [rad]."""


def state_deviation(fit: Fit | None, active: tuple[int, ...], objects: int) -> Array:
    """Return the deviations (26 + 6 N,).

    Args:
        fit: last fit of hand and active objects, None without a hand.
        active: objects that took part in it.
        objects: number N of objects.
    """
    deviation = np.tile([REST_PLACE] * 3 + [REST_ANGLE] * 3, 5 + objects)
    deviation = np.concatenate([np.full(HAND_SIZE, np.nan), deviation[: OBJECT_SIZE * objects]])
    if fit is None:
        return deviation
    lower = np.tril(fit.normal.astype(np.float64))
    matrix = lower + np.tril(lower, -1).T
    matrix[np.diag_indices(len(matrix))] += 1e-5
    spread = POINT_DEVIATION * np.sqrt(np.abs(np.diag(np.linalg.inv(matrix))))
    floor = np.full(len(spread), FLOOR_ANGLE)
    for offset in (0, *range(HAND_SIZE, len(spread), OBJECT_SIZE)):
        floor[offset : offset + 3] = FLOOR_PLACE
    spread = np.hypot(spread, floor)
    deviation[:HAND_SIZE] = spread[:HAND_SIZE]
    for row, k in enumerate(active):
        source = slice(HAND_SIZE + OBJECT_SIZE * row, HAND_SIZE + OBJECT_SIZE * (row + 1))
        target = slice(HAND_SIZE + OBJECT_SIZE * k, HAND_SIZE + OBJECT_SIZE * (k + 1))
        deviation[target] = spread[source]
    return deviation
