"""How well a placed model fits what was measured, beyond the count of matching pixels.

Something unknown can be matched by a known shape on most of its pixels. It gives itself away by a
residual that whole patches share, and by showing too little shape (one flat face) to tell anything.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.rasterizer import NOTHING

Bytes = NDArray[np.uint8]

PATCH = 5
"""Edge of the patches over which the sensor's noise averages out [pixel]."""
_LEAST_IN_PATCH = 12


@kernel
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


@kernel
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
