"""How well a placed model fits what was measured, beyond the count of matching pixels.

Something unknown can be matched by a known shape on most of its pixels. It gives itself away by a
residual that whole patches share, by surface that runs on beyond the model's outline, and by
showing too little shape (one flat face) to tell anything.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from intent_perception.rasterizer import NOTHING

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

PATCH = 5
"""Edge of the patches over which the sensor's noise averages out [pixel]."""
_LEAST_IN_PATCH = 12
_REACH = 14  # how far beyond the outline the scene's surface is followed [pixel]
_STEP = 0.006  # two neighbouring pixels further apart in depth are not of one surface [m]
_EXPLAINED = 0.2


@njit(cache=True, fastmath=True, error_model="numpy", nogil=True)
def patch_residual(
    left: int, top: int, drawn: Floats, raw: Floats, mask: Bytes, tolerance: float
) -> float:
    """Return the root mean square of the mean difference in depth over small patches [m].

    Args:
        left: column of the window's first pixel.
        top: row of the window's first pixel.
        drawn: (h, w) depth of the model, NOTHING where it is not.
        raw: (H, W) measured depth [m].
        mask: (H, W) 1 = may be an object.
        tolerance: larger differences are of other surfaces [m].
    """
    h, w = drawn.shape
    total = 0.0
    count = 0
    for j0 in range(0, h - PATCH + 1, PATCH):
        for i0 in range(0, w - PATCH + 1, PATCH):
            mean = 0.0
            n = 0
            for j in range(j0, j0 + PATCH):
                for i in range(i0, i0 + PATCH):
                    z = drawn[j, i]
                    q = raw[top + j, left + i]
                    if z >= NOTHING or q <= 0.0 or mask[top + j, left + i] != 1:
                        continue
                    if abs(q - z) < tolerance:
                        mean += q - z
                        n += 1
            if n >= _LEAST_IN_PATCH:
                total += (mean / n) * (mean / n)
                count += 1
    return np.sqrt(total / count) if count > 0 else tolerance


@njit(cache=True, fastmath=True, error_model="numpy", nogil=True)
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
                if 0 <= j + dv < h and 0 <= i + du < w and drawn[j + dv, i + du] < NOTHING:
                    continue
                count += 1
                before = smooth[top + j, left + i]
                for step in range(1, _REACH + 1):
                    v, u = top + j + step * dv, left + i + step * du
                    if v < 0 or u < 0 or v >= height or u >= width:
                        break
                    jj, ii = j + step * dv, i + step * du
                    if 0 <= jj < h and 0 <= ii < w and drawn[jj, ii] < NOTHING:
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


@njit(cache=True, fastmath=True, error_model="numpy", nogil=True)
def shape_shown(evidence: Floats, left: int, top: int, scene_normals: Floats) -> Floats:
    """Return the spread of the normals of the matching pixels: both smaller eigenvalues of n n^T.

    (0, 0) is a plane; a cylinder has one, a corner or a ball both.

    Args:
        evidence: (h, w) of `explain`.
        left: column of the window's first pixel.
        top: row of the window's first pixel.
        scene_normals: (H, W, 3).
    """
    spread = np.zeros((3, 3))
    count = 1e-9
    for j in range(evidence.shape[0]):
        for i in range(evidence.shape[1]):
            if evidence[j, i] <= 0.3:
                continue
            normal = scene_normals[top + j, left + i]
            count += 1.0
            for r in range(3):
                for c in range(3):
                    spread[r, c] += normal[r] * normal[c]
    values = np.linalg.eigvalsh(spread / count)
    return values[:2].astype(np.float32)
