"""Kernels that fill a distance grid from triangles; all lengths in grid steps.

Exact distances near each triangle, from there on by what is nearest to a point's neighbours (after
Bridson's level-set construction), and crossings of grid lines for the sign.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import exact_kernel, kernel

Indices = NDArray[np.int32]

_BAND = 1.5  # steps around a triangle in which the exact distance is computed at once
_SWEEPS = ((1, 1, 1), (-1, -1, -1), (1, -1, -1), (-1, 1, 1), (1, 1, -1), (-1, -1, 1))
# Grid lines are moved aside by this share of a step, so that none meets an edge or a vertex.
_ASIDE_Y, _ASIDE_Z = 1.37e-4, 2.11e-4


@kernel
def triangle_distance(triangle: Array, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point to a triangle (3, 3).

    After Ericson, Real-Time Collision Detection, 5.1.5: the region of the plane decides.
    """
    ax, ay, az = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    ux, uy, uz = triangle[1, 0] - ax, triangle[1, 1] - ay, triangle[1, 2] - az
    vx, vy, vz = triangle[2, 0] - ax, triangle[2, 1] - ay, triangle[2, 2] - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    uu, uv, vv = (
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
    )
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3) if d1 > d3 else 0.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6) if d2 > d6 else 0.0
    elif va <= 0.0 and (d4 - d3) >= 0.0 and (d5 - d6) >= 0.0:
        total = (d4 - d3) + (d5 - d6)
        t = (d4 - d3) / total if total > 0.0 else 0.0
        s = 1.0 - t
    else:
        total = va + vb + vc
        s, t = vb / total, vc / total
    dx, dy, dz = px - s * ux - t * vx, py - s * uy - t * vy, pz - s * uz - t * vz
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


def fill_distance(triangles: Array, squared: NDArray[np.float32], nearest: Indices) -> None:
    """Fill a grid with the squared distance to the nearest triangle.

    Exact next to the surface. Farther off the triangle is that of the nearest such point, improved
    by six sweeps: within 0.1 mm up to 10 mm from the surface of objects on grids of 3 mm, and
    within 0.2 mm in 999 of 1000 points of the grid.

    Args:
        triangles: (F, 3, 3) corners.
        squared: (X, Y, Z) in: a large number; out: squared distances.
        nearest: (X, Y, Z) in: -1; out: the triangles.
    """
    _fill_band(triangles, squared, nearest)
    beside = distance_transform_edt(nearest < 0, return_distances=False, return_indices=True)
    _carry(triangles, squared, nearest, nearest[tuple(beside)])
    for di, dj, dk in _SWEEPS:
        sweep(triangles, squared, nearest, di, dj, dk)


@kernel
def _fill_band(triangles: Array, squared: NDArray[np.float32], nearest: Indices) -> None:
    nx, ny, nz = squared.shape
    for f in range(len(triangles)):
        t = triangles[f]
        i0 = max(0, int(min(t[0, 0], t[1, 0], t[2, 0]) - _BAND))
        j0 = max(0, int(min(t[0, 1], t[1, 1], t[2, 1]) - _BAND))
        k0 = max(0, int(min(t[0, 2], t[1, 2], t[2, 2]) - _BAND))
        i1 = min(nx - 1, int(max(t[0, 0], t[1, 0], t[2, 0]) + _BAND) + 1)
        j1 = min(ny - 1, int(max(t[0, 1], t[1, 1], t[2, 1]) + _BAND) + 1)
        k1 = min(nz - 1, int(max(t[0, 2], t[1, 2], t[2, 2]) + _BAND) + 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    d = np.float32(triangle_distance(t, i, j, k))
                    if d < squared[i, j, k]:
                        squared[i, j, k] = d
                        nearest[i, j, k] = f


@kernel
def _carry(
    triangles: Array, squared: NDArray[np.float32], nearest: Indices, beside: Indices
) -> None:
    """Give every point without a triangle the one of the nearest point that has one."""
    nx, ny, nz = squared.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if nearest[i, j, k] < 0:
                    f = beside[i, j, k]
                    nearest[i, j, k] = f
                    squared[i, j, k] = np.float32(triangle_distance(triangles[f], i, j, k))


@kernel
def sweep(
    triangles: Array, squared: NDArray[np.float32], nearest: Indices, di: int, dj: int, dk: int
) -> None:
    """Go through the grid once, taking over nearer triangles from the seven points just passed."""
    nx, ny, nz = squared.shape
    for ii in range(1, nx):
        i = ii if di > 0 else nx - 1 - ii
        for jj in range(1, ny):
            j = jj if dj > 0 else ny - 1 - jj
            for kk in range(1, nz):
                k = kk if dk > 0 else nz - 1 - kk
                best, own = squared[i, j, k], nearest[i, j, k]
                tried = np.int32(-1)
                for n in range(1, 8):
                    a = i - di if n & 1 else i
                    b = j - dj if n & 2 else j
                    c = k - dk if n & 4 else k
                    f = nearest[a, b, c]
                    if f < 0 or f in (own, tried):
                        continue
                    tried = f
                    d = np.float32(triangle_distance(triangles[f], i, j, k))
                    if d < best:
                        best, own = d, f
                squared[i, j, k], nearest[i, j, k] = best, own


@exact_kernel
def count_crossings(triangles: Array, shape: tuple[int, int, int]) -> NDArray[np.int16]:
    """Return for each grid point how often the line along x crosses triangles before it.

    Args:
        triangles: (F, 3, 3) corners.
        shape: X, Y, Z of the grid.
    """
    count = np.zeros(shape, np.int16)
    for f in range(len(triangles)):
        t = triangles[f]
        ay, az = t[0, 1] + _ASIDE_Y, t[0, 2] + _ASIDE_Z
        by, bz = t[1, 1] + _ASIDE_Y, t[1, 2] + _ASIDE_Z
        cy, cz = t[2, 1] + _ASIDE_Y, t[2, 2] + _ASIDE_Z
        area = (by - ay) * (cz - az) - (cy - ay) * (bz - az)
        if area == 0.0:
            continue
        for j in range(
            max(0, int(np.ceil(min(ay, by, cy)))), min(shape[1] - 1, int(max(ay, by, cy))) + 1
        ):
            for k in range(
                max(0, int(np.ceil(min(az, bz, cz)))), min(shape[2] - 1, int(max(az, bz, cz))) + 1
            ):
                beta = ((j - ay) * (cz - az) - (cy - ay) * (k - az)) / area
                gamma = ((by - ay) * (k - az) - (j - ay) * (bz - az)) / area
                if beta < 0.0 or gamma < 0.0 or beta + gamma > 1.0:
                    continue
                x = t[0, 0] + beta * (t[1, 0] - t[0, 0]) + gamma * (t[2, 0] - t[0, 0])
                first = max(0, int(np.ceil(x)))
                if first < shape[0]:
                    count[first, j, k] += 1
    for i in range(1, shape[0]):
        for j in range(shape[1]):
            for k in range(shape[2]):
                count[i, j, k] += count[i - 1, j, k]
    return count


def inside_grid(triangles: Array, shape: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether grid points (X, Y, Z) are inside, by the majority of three lines.

    A point is inside where a line from it crosses the surface an odd number of times; three lines
    along the axes outvote small holes.
    """
    votes = np.zeros(tuple(shape), np.int8)
    for axis in range(3):
        order = [axis, (axis + 1) % 3, (axis + 2) % 3]
        turned = np.ascontiguousarray(triangles[:, :, order])
        count = count_crossings(
            turned, (int(shape[order[0]]), int(shape[order[1]]), int(shape[order[2]]))
        )
        votes += np.transpose(count & 1, np.argsort(order)).astype(np.int8)
    return np.asarray(votes >= 2)
