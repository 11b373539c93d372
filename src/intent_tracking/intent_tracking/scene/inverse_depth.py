"""Images of inverse depth of capsules and meshes on a small tile, for compiled code.

A tile is that of `raster`. Its image (S, S + PADDING) holds 1 / depth along the optical axis [1/m],
0 where nothing is drawn; columns beyond S are scratch. Nearer is larger, a plane's inverse depth is
linear in row and column, and a capsule's needs no division: the nearer root t of
a t^2 - 2 b t + c = 0 along a ray is c / (b + sqrt(b^2 - a c)), and c does not depend on the ray.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel
from intent_tracking.scene.raster import FAR, NEAR, capsule_sides, capsule_window
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE

LANES = 16  # of a triangle's row: fewer are unrolled one by one before they could be vectorised
PADDING = LANES
FARTHEST = np.float32(1.0) / FAR
"""Inverse of the depth that stands for nothing [1/m]."""


class MeshArrays(NamedTuple):
    """Meshes of K objects, packed one after the other; the types do not depend on K."""

    vertices: Floats
    """(3, sum V) [m]."""
    faces: NDArray[np.int32]
    """(sum F, 3) into each object's own vertices."""
    planes: Floats
    """(4, sum F) outward normal n, of the face's double area, and n . v of its vertices v."""
    vertex_start: NDArray[np.int64]
    """(K + 1,)."""
    face_start: NDArray[np.int64]
    """(K + 1,)."""


def mesh_arrays(meshes: Sequence[tuple[Array, NDArray[np.int32]]]) -> MeshArrays:
    """Pack K >= 0 meshes: vertices (V, 3) [m], faces (F, 3) with outward normals."""
    planes = [np.zeros((0, 4))]
    for vertices, faces in meshes:
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        normals = np.cross(b - a, c - a)
        planes.append(np.column_stack([normals, np.sum(normals * a, axis=1)]))
    vertices = np.concatenate([np.zeros((0, 3)), *(mesh[0] for mesh in meshes)])
    faces = np.concatenate([np.zeros((0, 3)), *(mesh[1] for mesh in meshes)])
    return MeshArrays(
        np.ascontiguousarray(vertices.T, dtype=np.float32),
        faces.astype(np.int32),
        np.ascontiguousarray(np.concatenate(planes).T, dtype=np.float32),
        np.concatenate([[0], np.cumsum([len(mesh[0]) for mesh in meshes])]).astype(np.int64),
        np.concatenate([[0], np.cumsum([len(mesh[1]) for mesh in meshes])]).astype(np.int64),
    )


@intrinsic
def larger(_typing: Any, first: Any, second: Any) -> Any:
    """Return the larger of two float32, always stored.

    `max` with a value of the place that is written compiles to a masked store, which takes some
    twenty cycles on processors with AVX2 of the Zen family.
    """

    def emit(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = arguments[0].type
        pair = ir.FunctionType(kind, [kind, kind])
        function = builder.module.declare_intrinsic("llvm.maxnum", [kind], pair)
        return builder.call(function, arguments, fastmath=("fast",))

    return types.float32(types.float32, types.float32), emit


@borrowing_kernel
def draw_capsule(
    ends: Floats,
    i: int,
    radius: np.float32,
    image: Floats,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
) -> tuple[int, int, int, int]:
    """Draw capsule i of ends (C, 2, 3) into an image.

    Returns:
        rows and columns (r0, r1, c0, c1), half open, within which pixels may have changed.
    """
    size = image.shape[0]
    r0, r1, left, right = capsule_window(ends, i, radius, size, u0, v0, step)
    if left > right:
        return size, 0, size, 0
    sides = capsule_sides(ends, i, radius, u0, v0, step)
    fill_capsule(ends, i, radius, image, r0, r1, left, right, sides, u0, v0, step)
    return r0, r1, int(left), int(right) + 1


@borrowing_kernel
def fill_capsule(
    ends: Floats,
    i: int,
    radius: np.float32,
    image: Floats,
    r0: int,
    r1: int,
    left: np.float32,
    right: np.float32,
    sides: tuple[np.float32, ...],
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
) -> None:
    """Draw rows r0..r1-1 of capsule i within columns left..right and its `capsule_sides`.

    All is relative to the unit axis through the first end. The ray enters the infinite cylinder at
    y = (m - sqrt(h) axis) / a along the axis; whether that is before the first end, or beyond the
    other one at `length`, is decided without the root by comparing squares with their signs. So
    the root of one of the three quadratics is enough.
    """
    one, zero, square = np.float32(1.0), np.float32(0.0), radius * radius
    slope, low, high = sides
    ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    bx, by, bz = ends[i, 1, 0], ends[i, 1, 1], ends[i, 1, 2]
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = math.sqrt(dx * dx + dy * dy + dz * dz) + np.float32(1e-9)
    dx, dy, dz = dx / length, dy / length, dz / length
    along = dx * ax + dy * ay + dz * az
    ca = ax * ax + ay * ay + az * az - square
    cb = bx * bx + by * by + bz * bz - square
    c = ca - along * along
    inverse_a, inverse_b, inverse_c = one / ca, one / cb, one / c
    for row in range(r0, r1):
        offset = slope * np.float32(row)
        first = int(max(left, low + offset) + np.float32(0.98))  # not negative: int rounds down
        blocks = (int(min(right, high + offset)) - first + 8) // 8
        v = v0 + np.float32(row) * step
        k_axis, k_a, k_b, k_ray = dy * v + dz, ay * v + az, by * v + bz, v * v + one
        for start in range(first, first + 8 * blocks, 8):
            part = image[row, start : start + 8]
            u_start = u0 + np.float32(start) * step
            for j in range(8):
                u = u_start + np.float32(np.int32(j)) * step
                ray, axis = k_ray + u * u, k_axis + dx * u
                to_a, to_b = k_a + ax * u, k_b + bx * u
                a, b = ray - axis * axis, to_a - along * axis
                h, h_a, h_b = b * b - a * c, to_a * to_a - ray * ca, to_b * to_b - ray * cb
                m = b * axis - along * a
                beyond = m - length * a
                turned = h * axis * abs(axis)
                before, after = m * abs(m) <= turned, beyond * abs(beyond) >= turned
                root = h_a if before else (h_b if after else h)
                middle = to_a if before else (to_b if after else b)
                inverse = inverse_a if before else (inverse_b if after else inverse_c)
                nearer = (middle + math.sqrt(max(root, zero))) * inverse
                nearer = nearer if (h >= zero and root >= zero) else zero
                part[j] = larger(part[j], nearer)


@borrowing_kernel
def project(
    vertices: Floats,
    rotation: Floats,
    x0: np.float32,
    y0: np.float32,
    z0: np.float32,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
    size: int,
    work: Floats,
) -> tuple[int, int, int, int]:
    """Write column, row and 1 / z of vertices (3, V) into work (3, >= V); return their window."""
    inverse_step = np.float32(1.0) / step
    one, zero, last = np.float32(1.0), np.float32(0.0), np.float32(size - 1)
    top, bottom, left, right = last, zero, last, zero
    vxs, vys, vzs = vertices[0], vertices[1], vertices[2]
    columns, rows, inverses = work[0], work[1], work[2]
    for i in range(vertices.shape[1]):
        vx, vy, vz = vxs[i], vys[i], vzs[i]
        x = rotation[0, 0] * vx + rotation[0, 1] * vy + rotation[0, 2] * vz + x0
        y = rotation[1, 0] * vx + rotation[1, 1] * vy + rotation[1, 2] * vz + y0
        z = rotation[2, 0] * vx + rotation[2, 1] * vy + rotation[2, 2] * vz + z0
        inverse = one / max(z, NEAR)
        column, row = (x * inverse - u0) * inverse_step, (y * inverse - v0) * inverse_step
        columns[i], rows[i], inverses[i] = column, row, inverse
        top, bottom = min(top, row), max(bottom, row)
        left, right = min(left, column), max(right, column)
    r0, r1 = int(max(top, zero)), int(min(bottom, last)) + 1
    return r0, r1, int(max(left, zero)), int(min(right, last)) + 1


@borrowing_kernel
def front_faces(
    planes: Floats,
    rotation: Floats,
    x0: np.float32,
    y0: np.float32,
    z0: np.float32,
    height: Floats,
    chosen: Indices,
) -> np.int64:
    """Write the faces of planes (4, F) that the camera is in front of; return their number.

    height (>= F) is overwritten; chosen (> F) receives the faces' numbers.
    """
    cx = -(rotation[0, 0] * x0 + rotation[1, 0] * y0 + rotation[2, 0] * z0)
    cy = -(rotation[0, 1] * x0 + rotation[1, 1] * y0 + rotation[2, 1] * z0)
    cz = -(rotation[0, 2] * x0 + rotation[1, 2] * y0 + rotation[2, 2] * z0)
    nx, ny, nz, offset = planes[0], planes[1], planes[2], planes[3]
    for k in range(planes.shape[1]):
        height[k] = nx[k] * cx + ny[k] * cy + nz[k] * cz - offset[k]
    count = np.int64(0)
    for k in range(planes.shape[1]):  # without a branch, which would be mispredicted half the time
        chosen[count] = k
        count += np.int64(height[k] > np.float32(0.0))
    return count


@borrowing_kernel
def fill_faces(
    work: Floats, faces: NDArray[np.int32], chosen: Indices, count: int, image: Floats
) -> None:
    """Draw the first `count` chosen of faces (F, 3) between projected vertices into an image.

    Rows are filled in blocks of `LANES` columns of constant trip count, which vectorise fully.
    """
    size = image.shape[0]
    one, zero, last = np.float32(1.0), np.float32(0.0), np.float32(size - 1)
    up, low = np.float32(0.999), np.float32(-1e-4)
    columns, rows, inverses = work[0], work[1], work[2]
    for n in range(count):
        k = chosen[n]
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        ax, ay, bx, by, cx, cy = columns[a], rows[a], columns[b], rows[b], columns[c], rows[c]
        r0, r1 = int(max(min(ay, by, cy), zero) + up), int(min(max(ay, by, cy), last) + one)
        c0, c1 = int(max(min(ax, bx, cx), zero) + up), int(min(max(ax, bx, cx), last) + one)
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if r0 >= r1 or c0 >= c1 or area >= np.float32(-1e-6):
            continue
        inverse, wa = one / area, inverses[a]
        wb, wc = inverses[b] - wa, inverses[c] - wa
        e1x, e1y = (cy - ay) * inverse, (ax - cx) * inverse
        e2x, e2y = (ay - by) * inverse, (bx - ax) * inverse
        wx, wy = e1x * wb + e2x * wc, e1y * wb + e2y * wc
        for row in range(r0, r1):
            y = np.float32(row) - ay
            for start in range(c0, c1, LANES):
                part, x = image[row, start : start + LANES], np.float32(start) - ax
                p1, p2, pw = x * e1x + y * e1y, x * e2x + y * e2y, wa + x * wx + y * wy
                for j in range(LANES):
                    right = np.float32(np.int32(j))
                    l1, l2, w = p1 + right * e1x, p2 + right * e2x, pw + right * wx
                    least = min(min(l1, l2), one - l1 - l2)
                    part[j] = larger(part[j], w if least >= low else zero)


@borrowing_kernel
def draw_meshes(
    meshes: MeshArrays,
    state: Floats,
    rotations: Floats,
    image: Floats,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
    work: Floats,
    chosen: Indices,
) -> tuple[int, int, int, int]:
    """Draw the front faces of `MeshArrays` of K objects at the poses of a state into an image.

    Args:
        meshes: closed, or with every face's front outside.
        state: (26 + 6 K,), of which the objects' positions are read.
        rotations: (1 + K, 3, 3) of hand and objects.
        image: inverse depths.
        u0: with v0 and step: the tile.
        v0: see u0.
        step: see u0.
        work: (3, n), n at least the number of vertices or faces.
        chosen: (m,), m more than the number of faces.

    Returns:
        rows and columns (r0, r1, c0, c1), half open, within which pixels may have changed.
    """
    size = image.shape[0]
    r0, r1, c0, c1 = size, 0, size, 0
    for k in range(len(meshes.face_start) - 1):
        o, first, last = HAND_SIZE + OBJECT_SIZE * k, meshes.face_start[k], meshes.face_start[k + 1]
        x, y, z, rotation = state[o], state[o + 1], state[o + 2], rotations[1 + k]
        vertices = meshes.vertices[:, meshes.vertex_start[k] : meshes.vertex_start[k + 1]]
        planes, faces = meshes.planes[:, first:last], meshes.faces[first:last]
        count = front_faces(planes, rotation, x, y, z, work[0], chosen)
        a, b, c, d = project(vertices, rotation, x, y, z, u0, v0, step, size, work)
        fill_faces(work, faces, chosen, count, image)
        r0, r1, c0, c1 = min(r0, a), max(r1, b), min(c0, c), max(c1, d)
    return r0, r1, c0, c1
