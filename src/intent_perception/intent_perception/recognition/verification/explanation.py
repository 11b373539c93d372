"""What a pose explains of the depth image, pixel by pixel, and the refinement on those pixels.

The model is drawn into a window of the image. A pixel where the drawn surface lies on the measured
one, with its normal, speaks for the pose; one where the camera saw through the drawn surface speaks
against it; the rest is hidden or unknown and says nothing. The outermost pixels of the silhouette
count neither way: depth cameras misplace edges.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.geometry.rasterizer import NOTHING, rasterize
from intent_perception.recognition.verification.alignment import move, solve_step

Bytes = NDArray[np.uint8]

MATCH, FRONT, HIDDEN, UNKNOWN, TABLE, DRAWN = range(6)
"""Columns of the counts of `explain`: pixels that match, contradict, are hidden, not measured, on
the bare table, and all that the model covers."""
COUNTS = 8
"""Columns: those six, pixels that lie on a surface but disagree with it, and sum of |residual| [m]
over the matches."""
DISAGREE, RESIDUAL = 6, 7
_MARGIN = 2


@borrowing_kernel
def window_of(
    pose: Floats, vertices: Floats, intrinsics: Floats, height: int, width: int, moved: Floats
) -> tuple[int, int, int, int]:
    """Write the vertices moved to the camera frame; return left, top, right, bottom of the window.

    The window is cut at the image's border and empty (right <= left) if the object is outside.
    """
    left, top = np.float32(1e9), np.float32(1e9)
    right, bottom = np.float32(-1e9), np.float32(-1e9)
    for i in range(len(vertices)):
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        x = pose[0] * a + pose[1] * b + pose[2] * c + pose[9]
        y = pose[3] * a + pose[4] * b + pose[5] * c + pose[10]
        z = pose[6] * a + pose[7] * b + pose[8] * c + pose[11]
        moved[i, 0] = x
        moved[i, 1] = y
        moved[i, 2] = z
        if z < 0.1:
            return 0, 0, 0, 0
        u = intrinsics[0] * x / z + intrinsics[2]
        v = intrinsics[1] * y / z + intrinsics[3]
        left, right = min(left, u), max(right, u)
        top, bottom = min(top, v), max(bottom, v)
    return (
        max(0, int(left) - _MARGIN),
        max(0, int(top) - _MARGIN),
        min(width, int(right) + 2 + _MARGIN),
        min(height, int(bottom) + 2 + _MARGIN),
    )


@kernel
def draw(
    pose: Floats,
    vertices: Floats,
    faces: NDArray[np.int32],
    intrinsics: Floats,
    height: int,
    width: int,
    stride: int = 1,
) -> tuple[int, int, Floats]:
    """Return left, top and depth (h, w) of the window of a drawn model, of each stride-th pixel."""
    moved = np.empty((len(vertices), 3), np.float32)
    left, top, right, bottom = window_of(pose, vertices, intrinsics, height, width, moved)
    if right <= left or bottom <= top:
        return 0, 0, np.empty((0, 0), np.float32)
    rows, columns = (bottom - top + stride - 1) // stride, (right - left + stride - 1) // stride
    depth = np.empty((rows, columns), np.float32)
    shifted = intrinsics.copy()
    shifted[2] -= left
    shifted[3] -= top
    shifted /= np.float32(stride)
    rasterize(moved, faces, shifted, depth)
    return left, top, depth


@kernel
def explain(  # noqa: PLR0915 (one kernel)
    left: int,
    top: int,
    drawn: Floats,
    raw: Floats,
    smooth: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerance: float,
) -> tuple[Floats, Floats]:
    """Return the evidence of each pixel (h, w), in -1..1, and counts (COUNTS,).

    Args:
        left: column of the window's first pixel.
        top: row of the window's first pixel.
        drawn: (h, w) depth of the model, NOTHING where it is not.
        raw: (H, W) measured depth [m].
        smooth: (H, W) depth of the fitted planes [m].
        scene_normals: (H, W, 3).
        mask: (H, W) 1 = may be an object.
        intrinsics: (4,).
        tolerance: largest difference of a match at 1 m, growing with depth [m].
    """
    h, w = drawn.shape
    evidence = np.zeros((h, w), np.float32)
    counts = np.zeros(COUNTS, np.float32)
    for j in range(h):
        for i in range(w):
            z = drawn[j, i]
            if z >= NOTHING:
                continue
            counts[5] += 1
            v, u = top + j, left + i
            fitted = smooth[v, u] > 0.0
            measured = smooth[v, u] if fitted else raw[v, u]
            if measured <= 0.0:
                counts[3] += 1
                continue
            rim = (
                i == 0
                or j == 0
                or i == w - 1
                or j == h - 1
                or drawn[j, i - 1] >= NOTHING
                or drawn[j, i + 1] >= NOTHING
                or drawn[j - 1, i] >= NOTHING
                or drawn[j + 1, i] >= NOTHING
            )
            slack = tolerance * (0.4 + 0.6 * z * z)
            gap = measured - z
            if gap < -slack:
                counts[2] += 1
                continue
            if gap > slack:
                if not rim:
                    counts[1] += 1
                    evidence[j, i] = -1.0
                continue
            if mask[v, u] != 1:
                counts[4] += 1
                continue
            agreement = np.float32(1.0)
            if not rim and fitted:
                # normal of the drawn surface from its depth in the four neighbours
                wu = 1.0 / drawn[j, i + 1] - 1.0 / drawn[j, i - 1]
                wv = 1.0 / drawn[j + 1, i] - 1.0 / drawn[j - 1, i]
                nx = 0.5 * wu * intrinsics[0]
                ny = 0.5 * wv * intrinsics[1]
                nz = 1.0 / z - (u - intrinsics[2]) * 0.5 * wu - (v - intrinsics[3]) * 0.5 * wv
                cosine = -(
                    nx * scene_normals[v, u, 0]
                    + ny * scene_normals[v, u, 1]
                    + nz * scene_normals[v, u, 2]
                ) / np.sqrt(nx * nx + ny * ny + nz * nz)
                agreement = np.float32(min(1.0, max(0.0, (cosine - 0.4) * 2.5)))
            relative = gap / slack
            value = (1.0 - 0.6 * relative * relative) * agreement
            evidence[j, i] = value
            counts[0] += value
            counts[6] += 1.0 - value
            counts[7] += abs(gap)
    return evidence, counts


@kernel
def settle(  # noqa: PLR0915 (one kernel)
    pose: Floats,
    vertices: Floats,
    faces: NDArray[np.int32],
    measured: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerances: Floats,
    stride: int,
) -> None:
    """Refine a pose (12,) in place on the drawn pixels, one drawing for each tolerance [m].

    Each drawn pixel is held against the measurement of the same pixel along its normal; unlike
    points on the model, drawn pixels know what of the model hides the rest.
    """
    height, width = measured.shape
    jacobian = np.empty(6)
    center = np.empty(3)
    for tolerance in tolerances:
        left, top, drawn = draw(pose, vertices, faces, intrinsics, height, width, stride)
        h, w = drawn.shape
        system = np.zeros((6, 6))
        right = np.zeros(6)
        count = 0
        for r in range(3):
            center[r] = pose[9 + r]
        for j in range(h):
            for i in range(w):
                z = drawn[j, i]
                if z >= NOTHING:
                    continue
                v, u = top + j * stride, left + i * stride
                q = measured[v, u]
                if q <= 0.0 or mask[v, u] != 1 or abs(q - z) > tolerance:
                    continue
                mx = scene_normals[v, u, 0]
                my = scene_normals[v, u, 1]
                mz = scene_normals[v, u, 2]
                rx = (u - intrinsics[2]) / intrinsics[0]
                ry = (v - intrinsics[3]) / intrinsics[1]
                along = mx * rx + my * ry + mz
                if along > -0.15:
                    continue
                error = along * (q - z)
                weight = 1.0 - (q - z) * (q - z) / (tolerance * tolerance)
                cx, cy, cz = rx * z - center[0], ry * z - center[1], z - center[2]
                jacobian[0] = cy * mz - cz * my
                jacobian[1] = cz * mx - cx * mz
                jacobian[2] = cx * my - cy * mx
                jacobian[3] = mx
                jacobian[4] = my
                jacobian[5] = mz
                count += 1
                for r in range(6):
                    right[r] += weight * jacobian[r] * error
                    for c in range(r + 1):
                        system[r, c] += weight * jacobian[r] * jacobian[c]
        if count < 12:
            return
        for r in range(3):
            system[r, r] += 1e-6 * count
            system[3 + r, 3 + r] += 1e-3 * count
        move(pose, solve_step(system, right), center)
