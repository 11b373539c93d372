"""Triangles -> depth, as a kernel that other kernels call for one model in a small window."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import kernel

NOTHING = np.float32(1e6)
"""Depth of a pixel on which nothing is drawn (fast arithmetic knows no infinity)."""


@kernel
def rasterize(
    vertices: Floats,
    faces: NDArray[np.int32],
    intrinsics: Floats,
    depth: Floats,
) -> None:
    """Draw triangles into a depth image, keeping the nearest; depth starts at NOTHING.

    Args:
        vertices: (V, 3) in camera coordinates [m].
        faces: (F, 3) indices of vertices.
        intrinsics: (4,) fx, fy, cx, cy of the window.
        depth: (h, w) in and out [m].
    """
    fx, fy, cx, cy = intrinsics
    height, width = depth.shape
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = vertices[a, 2], vertices[b, 2], vertices[c, 2]
        if za < 0.05 or zb < 0.05 or zc < 0.05:
            continue
        wa, wb, wc = np.float32(1.0) / za, np.float32(1.0) / zb, np.float32(1.0) / zc
        ua = fx * vertices[a, 0] * wa + cx
        va = fy * vertices[a, 1] * wa + cy
        ub = fx * vertices[b, 0] * wb + cx
        vb = fy * vertices[b, 1] * wb + cy
        uc = fx * vertices[c, 0] * wc + cx
        vc = fy * vertices[c, 1] * wc + cy
        area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va)
        if area == 0.0:
            continue
        left = max(0, int(np.ceil(min(ua, ub, uc))))
        right = min(width - 1, int(np.floor(max(ua, ub, uc))))
        top = max(0, int(np.ceil(min(va, vb, vc))))
        bottom = min(height - 1, int(np.floor(max(va, vb, vc))))
        if left > right or top > bottom:
            continue
        scale = np.float32(1.0) / area
        # 1/z is linear in the image, so perspective needs no division per pixel but the last
        du = ((vc - va) * (wb - wa) - (vb - va) * (wc - wa)) * scale
        dv = ((ub - ua) * (wc - wa) - (uc - ua) * (wb - wa)) * scale
        for v in range(top, bottom + 1):
            for u in range(left, right + 1):
                beta = ((u - ua) * (vc - va) - (uc - ua) * (v - va)) * scale
                gamma = ((ub - ua) * (v - va) - (u - ua) * (vb - va)) * scale
                if beta < 0.0 or gamma < 0.0 or beta + gamma > 1.0:
                    continue
                z = np.float32(1.0) / (wa + du * (u - ua) + dv * (v - va))
                if z < depth[v, u]:
                    depth[v, u] = z
