"""Does the object end where the model ends?

A model laid into a larger surface matches on all its pixels; only the contour tells that the
surface goes on.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.geometry.rasterizer import NOTHING

Bytes = NDArray[np.uint8]

_OUT = 4  # how far outside the silhouette the scene is looked at [pixel]
_SAME = 0.008  # difference in depth within which the surface goes on [m]
_EXPLAINED = 0.2
_REACH = 14  # how far beyond the outline the scene's surface is followed [pixel]
_STEP = 0.006  # two neighbouring pixels further apart in depth are not of one surface [m]


@borrowing_kernel
def covers(drawn: Floats, row: int, column: int) -> bool:
    """Return whether a drawn model (h, w) covers a pixel of its window or beside it."""
    height, width = drawn.shape
    inside = 0 <= row < height and 0 <= column < width
    return inside and bool(drawn[row, column] < NOTHING)


@kernel
def contour(
    left: int,
    top: int,
    drawn: Floats,
    raw: Floats,
    smooth: Floats,
    mask: Bytes,
    explained: Floats,
    tolerance: float,
) -> tuple[int, int]:
    """Return on how many pixels of the visible contour the scene ends, and on how many it goes on.

    Args:
        left: column of the window's first pixel.
        top: row of the window's first pixel.
        drawn: (h, w) depth of the model, NOTHING where it is not.
        raw: (H, W) measured depth [m].
        smooth: (H, W) depth of the fitted planes [m].
        mask: (H, W) 1 = may be an object.
        explained: (H, W) evidence of other objects: where one is, the surface may go on.
        tolerance: of a match [m].
    """
    height, width = raw.shape
    h, w = drawn.shape
    ends = 0
    goes_on = 0
    for j in range(h):
        for i in range(w):
            z = drawn[j, i]
            if z >= NOTHING:
                continue
            v, u = top + j, left + i
            here = smooth[v, u] if smooth[v, u] > 0.0 else raw[v, u]
            if here <= 0.0 or abs(here - z) > 1.5 * tolerance:
                continue
            for side in range(4):
                dv = (side == 0) - (side == 1)
                du = (side == 2) - (side == 3)
                if covers(drawn, j + dv, i + du) or covers(drawn, j + _OUT * dv, i + _OUT * du):
                    continue
                vv, uu = v + _OUT * dv, u + _OUT * du
                if vv < 0 or uu < 0 or vv >= height or uu >= width:
                    continue
                there = smooth[vv, uu] if smooth[vv, uu] > 0.0 else raw[vv, uu]
                if there <= 0.0 or explained[vv, uu] > _EXPLAINED:
                    continue
                if mask[vv, uu] != 1 or there - z > _SAME:
                    ends += 1
                elif there - z > -_SAME:
                    goes_on += 1
    return ends, goes_on


@kernel
def surface_beyond(  # noqa: C901 (one kernel)
    left: int,
    top: int,
    drawn: Floats,
    smooth: Floats,
    mask: Bytes,
    explained: Floats,
    tolerance: float,
) -> float:
    """Return how far the scene's surface runs on beyond the model's outline, 0 = nowhere, 1 = far.

    Args:
        left: column of the window's first pixel.
        top: row of the window's first pixel.
        drawn: (h, w) depth of the model, NOTHING where it is not.
        smooth: (H, W) depth of the fitted planes [m].
        mask: (H, W) 1 = may be an object.
        explained: (H, W) evidence of other objects: what is theirs does not count.
        tolerance: of a match [m].
    """
    height, width = smooth.shape
    h, w = drawn.shape
    total = 0
    count = 0
    for j in range(h):
        for i in range(w):
            z = drawn[j, i]
            if z >= NOTHING or smooth[top + j, left + i] <= 0.0:
                continue
            if abs(smooth[top + j, left + i] - z) > 1.5 * tolerance:
                continue
            for side in range(4):
                dv = (side == 0) - (side == 1)
                du = (side == 2) - (side == 3)
                if covers(drawn, j + dv, i + du):
                    continue
                count += 1
                before = smooth[top + j, left + i]
                for step in range(1, _REACH + 1):
                    v, u = top + j + step * dv, left + i + step * du
                    if v < 0 or u < 0 or v >= height or u >= width:
                        break
                    if covers(drawn, j + step * dv, i + step * du):
                        break
                    if mask[v, u] != 1 or explained[v, u] > _EXPLAINED:
                        break
                    there = smooth[v, u]
                    if there <= 0.0 or abs(there - before) > _STEP:
                        break
                    # depth cameras widen edges: the first pixels say nothing
                    if step > 2:
                        total += 1
                    before = there
    return total / (count * (_REACH - 2.0)) if count > 0 else 0.0
