"""Does the object end where the model ends?

A model laid into a larger surface matches on all its pixels; only the contour tells that the
surface goes on.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from intent_perception.rasterizer import NOTHING

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_OUT = 4  # how far outside the silhouette the scene is looked at [pixel]
_SAME = 0.008  # difference in depth within which the surface goes on [m]
_EXPLAINED = 0.2


@njit(cache=True, fastmath=True, error_model="numpy", nogil=True)
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
                if 0 <= j + dv < h and 0 <= i + du < w and drawn[j + dv, i + du] < NOTHING:
                    continue
                jj, ii = j + _OUT * dv, i + _OUT * du
                if 0 <= jj < h and 0 <= ii < w and drawn[jj, ii] < NOTHING:
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
