"""Refinement of hypotheses: point-to-plane ICP with projective association.

A model point is paired with the scene point of the pixel it falls on; Gauss-Newton moves the model
onto the planes fitted around those pixels.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import kernel

Bytes = NDArray[np.uint8]


@kernel
def solve_step(system: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the solution (6,) of a symmetric positive definite system by Cholesky, 0 if it fails.

    Only the lower triangle of system (6, 6) is read; it is overwritten.
    """
    x = np.zeros(6)
    for i in range(6):
        for j in range(i + 1):
            total = system[i, j]
            for k in range(j):
                total -= system[i, k] * system[j, k]
            if i == j:
                if total <= 1e-12:
                    return x
                system[i, i] = np.sqrt(total)
            else:
                system[i, j] = total / system[j, j]
    for i in range(6):
        total = right[i]
        for k in range(i):
            total -= system[i, k] * x[k]
        x[i] = total / system[i, i]
    for i in range(5, -1, -1):
        total = x[i]
        for k in range(i + 1, 6):
            total -= system[k, i] * x[k]
        x[i] = total / system[i, i]
    return x


@kernel
def move(pose: Floats, step: NDArray[np.float64], center: NDArray[np.float64]) -> None:
    """Turn and shift a pose (12,) in place by a step (6,) of rotation about center and shift."""
    angle = np.sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2])
    turn = np.eye(3)
    if angle > 1e-12:
        x, y, z = step[0] / angle, step[1] / angle, step[2] / angle
        c, s = np.cos(angle), np.sin(angle)
        d = 1.0 - c
        turn[0, 0] = c + d * x * x
        turn[0, 1] = d * x * y - s * z
        turn[0, 2] = d * x * z + s * y
        turn[1, 0] = d * x * y + s * z
        turn[1, 1] = c + d * y * y
        turn[1, 2] = d * y * z - s * x
        turn[2, 0] = d * x * z - s * y
        turn[2, 1] = d * y * z + s * x
        turn[2, 2] = c + d * z * z
    old = pose.copy()
    for r in range(3):
        shift = step[3 + r] + center[r]
        for c3 in range(3):
            value = 0.0
            for k in range(3):
                value += turn[r, k] * old[3 * k + c3]
            pose[3 * r + c3] = value
            shift += turn[r, c3] * (old[9 + c3] - center[c3])
        pose[9 + r] = shift


@kernel
def align(  # noqa: C901, PLR0915 (one kernel)
    poses: Floats,
    models: NDArray[np.int64],
    points: Floats,
    normals: Floats,
    offsets: NDArray[np.int64],
    most: int,
    smooth: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerances: Floats,
) -> None:
    """Refine poses (N, 12) in place, one iteration for each tolerance [m] (largest distance)."""
    height, width = smooth.shape
    jacobian = np.empty(6)
    center = np.empty(3)
    for h in range(len(poses)):
        pose = poses[h]
        begin = offsets[models[h]]
        end = min(offsets[models[h] + 1], begin + most)
        for tolerance in tolerances:
            system = np.zeros((6, 6))
            right = np.zeros(6)
            count = 0
            for r in range(3):
                center[r] = pose[9 + r]
            for i in range(begin, end):
                px, py, pz = points[i, 0], points[i, 1], points[i, 2]
                x = pose[0] * px + pose[1] * py + pose[2] * pz + pose[9]
                y = pose[3] * px + pose[4] * py + pose[5] * pz + pose[10]
                z = pose[6] * px + pose[7] * py + pose[8] * pz + pose[11]
                ax, ay, az = normals[i, 0], normals[i, 1], normals[i, 2]
                nx = pose[0] * ax + pose[1] * ay + pose[2] * az
                ny = pose[3] * ax + pose[4] * ay + pose[5] * az
                nz = pose[6] * ax + pose[7] * ay + pose[8] * az
                if z < 0.1 or nx * x + ny * y + nz * z > np.float32(-0.1) * z:
                    continue
                u = int(intrinsics[0] * x / z + intrinsics[2] + np.float32(0.5))
                v = int(intrinsics[1] * y / z + intrinsics[3] + np.float32(0.5))
                if u < 0 or v < 0 or u >= width or v >= height or mask[v, u] != 1:
                    continue
                measured = smooth[v, u]
                if measured <= 0.0 or abs(measured - z) > tolerance:
                    continue
                mx = scene_normals[v, u, 0]
                my = scene_normals[v, u, 1]
                mz = scene_normals[v, u, 2]
                if mx * nx + my * ny + mz * nz < 0.5:
                    continue
                sx = (u - intrinsics[2]) / intrinsics[0] * measured
                sy = (v - intrinsics[3]) / intrinsics[1] * measured
                error = mx * (sx - x) + my * (sy - y) + mz * (measured - z)
                cx, cy, cz = x - center[0], y - center[1], z - center[2]
                jacobian[0] = cy * mz - cz * my
                jacobian[1] = cz * mx - cx * mz
                jacobian[2] = cx * my - cy * mx
                jacobian[3] = mx
                jacobian[4] = my
                jacobian[5] = mz
                count += 1
                for r in range(6):
                    right[r] += jacobian[r] * error
                    for c in range(r + 1):
                        system[r, c] += jacobian[r] * jacobian[c]
            if count < 8:
                break
            # a weak pull to where it was keeps directions that nothing holds from drifting
            for r in range(3):
                system[r, r] += 1e-5 * count
                system[3 + r, 3 + r] += 1e-2 * count
            move(pose, solve_step(system, right), center)
