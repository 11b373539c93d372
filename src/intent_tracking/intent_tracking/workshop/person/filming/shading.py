"""Compiled light and texture: one pass over the pixels of a demonstrator's picture."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import summing_kernel

_BIAS = np.float32(0.012)
"""A surface this much behind the shadow map is in the shadow [m]."""
_TAPS = np.array([[0, 0], [3, 1], [-1, 3], [-3, -1], [1, -3]])
_SKY, _UP = np.float32(0.72), np.float32(0.28)


@summing_kernel
def shaded(
    depth: Floats,
    label: NDArray[np.int16],
    normal: Floats,
    view: Floats,
    intrinsics: Floats,
    lamp: Floats,
    lamp_view: Floats,
    lamp_focal: float,
    nearest: Floats,
    albedo: Floats,
    grain: Floats,
    lamp_color: Floats,
    ambient: Floats,
    levels: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """Return the colours (H, W, 3) of a scene under one lamp.

    Args:
        depth: (H, W) [m].
        label: (H, W) number of the piece, -1 = nothing.
        normal: (H, W, 3) unit normals in the camera frame.
        view: (4, 4) T_table_camera.
        intrinsics: (4,) fx, fy, cx, cy.
        lamp: (3,) position in the table frame [m].
        lamp_view: (4, 4) T_lamp_table.
        lamp_focal: focal length of the square shadow map [pixel].
        nearest: (S, S) depth of the shadow map [m], 0 = nothing.
        albedo: (P + 1, 3) colour of each piece, the last of nothing.
        grain: (P + 1,) strength of its texture.
        lamp_color: (3,).
        ambient: (3,).
        levels: (4096,) display value of each brightness.
    """
    height, width = depth.shape
    color = np.empty((height, width, 3), np.uint8)
    fx, fy, cx, cy = intrinsics
    one, none = np.float32(1.0), np.float32(0.0)
    n, point = np.empty(3, np.float32), np.empty(3, np.float32)
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            x, y = (np.float32(u) - cx) / fx * z, (np.float32(v) - cy) / fy * z
            a, b, c = normal[v, u]
            for k in range(3):
                point[k] = view[k, 0] * x + view[k, 1] * y + view[k, 2] * z + view[k, 3]
                n[k] = view[k, 0] * a + view[k, 1] * b + view[k, 2] * c
            p, q, r = lamp[0] - point[0], lamp[1] - point[1], lamp[2] - point[2]
            lit = (n[0] * p + n[1] * q + n[2] * r) / np.sqrt(p * p + q * q + r * r)
            lit = min(max(lit, none), one)
            if lit > none:
                lit *= _unshadowed(point, lamp_view, np.float32(lamp_focal), nearest)
            sky = _SKY + _UP * n[2]
            piece = label[v, u] if label[v, u] >= 0 else len(grain) - 1
            texture = one
            if grain[piece] > none:
                texture += grain[piece] * _grain(point[0], point[1], point[2])
            for k in range(3):
                shade = lit * lamp_color[k] + sky * ambient[k]
                value = min(max(albedo[piece, k] * texture * shade, none), one)
                color[v, u, k] = levels[int(np.rint(value * np.float32(4095.0)))]
    return color


@summing_kernel
def _unshadowed(point: Floats, lamp_view: Floats, focal: np.float32, nearest: Floats) -> np.float32:
    """Return the share of the lamp that reaches a point, by a blurred shadow map."""
    size = nearest.shape[0]
    x = lamp_view[0, 0] * point[0] + lamp_view[0, 1] * point[1] + lamp_view[0, 2] * point[2]
    y = lamp_view[1, 0] * point[0] + lamp_view[1, 1] * point[1] + lamp_view[1, 2] * point[2]
    z = lamp_view[2, 0] * point[0] + lamp_view[2, 1] * point[1] + lamp_view[2, 2] * point[2]
    x, y, z = x + lamp_view[0, 3], y + lamp_view[1, 3], z + lamp_view[2, 3]
    ahead, half = max(z, np.float32(1e-3)), np.float32(size / 2)
    u, v = int(np.rint(focal * x / ahead + half)), int(np.rint(focal * y / ahead + half))
    if u < 0 or v < 0 or u >= size or v >= size:
        return np.float32(1.0)
    free = 0
    for tap in range(len(_TAPS)):
        column = min(max(u + _TAPS[tap, 0], 0), size - 1)
        row = min(max(v + _TAPS[tap, 1], 0), size - 1)
        front = nearest[row, column]
        if front == 0.0 or ahead < front + _BIAS:
            free += 1
    return np.float32(free) / np.float32(len(_TAPS))


@summing_kernel
def _grain(x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return a texture about -0.3..0.3 that runs along x, from a position in the table frame."""
    f = np.float32
    rings = f(14.0) * y + f(1.3) * np.sin(f(2.1) * x + f(3.0) * y) + f(4.0) * z
    wave = np.sin(f(6.0) * rings + f(2.0) * np.sin(f(1.7) * x))
    fine = np.sin(f(230.0) * y + f(7.0) * np.sin(f(9.0) * x)) * np.sin(f(31.0) * x + f(4.0) * z)
    return np.float32(f(0.18) * wave + f(0.10) * fine)
