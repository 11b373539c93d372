"""Z-buffers of capsules and triangle meshes on a small tile, for compiled code.

A tile has rows i and columns j; its pixel (i, j) looks along (u0 + j step, v0 + i step, 1). Values
are depths along the optical axis [m]; `FAR` where nothing is drawn.
"""

import math

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel

FAR = np.float32(1e3)
NEAR = np.float32(0.05)
SLACK = np.float32(0.01)
"""Rounding errors of tangents [pixels]."""


@borrowing_kernel
def tangents(
    nx: np.float32,
    ny: np.float32,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    radius: np.float32,
    inverse: np.float32,
) -> tuple[np.float32, np.float32]:
    """Return the least and largest nx u + ny v over a sphere's image; nx^2 + ny^2 = 1.

    These are the planes through the camera that touch it; inverse = 1 / (z^2 - radius^2).
    """
    across = nx * x + ny * y
    middle = z * across * inverse
    reach = radius * math.sqrt(across * across + z * z - radius * radius) * inverse
    return middle - reach, middle + reach


@borrowing_kernel
def capsule_box(
    ends: Floats, i: int, radius: np.float32, u0: np.float32, v0: np.float32, step: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the first and last row and column (top, bottom, left, right) of capsule i's image."""
    one, zero, square = np.float32(1.0), np.float32(0.0), radius * radius
    top, bottom, left, right = FAR, -FAR, FAR, -FAR
    for e in range(2):
        x, y, z = ends[i, e, 0], ends[i, e, 1], ends[i, e, 2]
        inverse = one / (z * z - square)
        low, high = tangents(zero, one, x, y, z, radius, inverse)
        top, bottom = min(top, low), max(bottom, high)
        low, high = tangents(one, zero, x, y, z, radius, inverse)
        left, right = min(left, low), max(right, high)
    pixels = one / step
    top, bottom = (top - v0) * pixels - SLACK, (bottom - v0) * pixels + SLACK
    return top, bottom, (left - u0) * pixels - SLACK, (right - u0) * pixels + SLACK


@borrowing_kernel
def capsule_window(
    ends: Floats,
    i: int,
    radius: np.float32,
    size: int,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
) -> tuple[int, int, np.float32, np.float32]:
    """Return rows (r0, r1), half open, and columns (left, right) of capsule i's image on a tile.

    left > right where nothing of it is on the tile, or it is too near.
    """
    zero, last = np.float32(0.0), np.float32(size - 1)
    if min(ends[i, 0, 2], ends[i, 1, 2]) < radius + NEAR:
        return size, 0, last, -last
    top, bottom, left, right = capsule_box(ends, i, radius, u0, v0, step)
    if top > last or bottom < zero or left > last or right < zero:
        return size, 0, last, -last
    r0, r1 = int(math.ceil(max(top, zero))), int(min(bottom, last)) + 1
    return r0, r1, max(left, zero), min(right, last)


@borrowing_kernel
def capsule_sides(
    ends: Floats, i: int, radius: np.float32, u0: np.float32, v0: np.float32, step: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Return (slope, low, high): row r of capsule i's image is within low..high + slope r."""
    one = np.float32(1.0)
    ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    bx, by, bz = ends[i, 1, 0], ends[i, 1, 1], ends[i, 1, 2]
    nx, ny = by * az - ay * bz, ax * bz - bx * az  # across the image of the axis
    norm = math.sqrt(nx * nx + ny * ny)
    if abs(nx) <= np.float32(0.05) * norm or norm < np.float32(1e-9):
        return np.float32(0.0), -FAR, FAR
    scale = (one if nx > np.float32(0.0) else -one) / norm
    nx, ny, square = nx * scale, ny * scale, radius * radius
    low_a, high_a = tangents(nx, ny, ax, ay, az, radius, one / (az * az - square))
    low_b, high_b = tangents(nx, ny, bx, by, bz, radius, one / (bz * bz - square))
    inverse, pixels = one / nx, one / step
    low = ((min(low_a, low_b) - ny * v0) * inverse - u0) * pixels - SLACK
    high = ((max(high_a, high_b) - ny * v0) * inverse - u0) * pixels + SLACK
    return -ny * inverse, low, high


@borrowing_kernel
def draw_capsule(
    ends: Floats,
    i: int,
    radius: np.float32,
    depth: Floats,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
) -> tuple[int, int, int, int]:
    """Draw capsule i of ends (C, 2, 3) into depth (S, S), S a multiple of 8.

    A row is filled between the tangents along the capsule in blocks of 8 columns of constant trip
    count, which vectorise fully.

    Returns:
        rows and columns (r0, r1, c0, c1), half open, within which pixels may have changed.
    """
    size = depth.shape[0]
    r0, r1, left, right = capsule_window(ends, i, radius, size, u0, v0, step)
    if left > right:
        return size, 0, size, 0
    sides = capsule_sides(ends, i, radius, u0, v0, step)
    fill_capsule(ends, i, radius, depth, r0, r1, left, right, sides, u0, v0, step)
    return r0, r1, int(left), int(right) + 1


@borrowing_kernel
def fill_capsule(
    ends: Floats,
    i: int,
    radius: np.float32,
    depth: Floats,
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

    All is relative to the unit axis through the first end; terms that do not depend on the column
    leave the inner loop.
    """
    one, zero, square = np.float32(1.0), np.float32(0.0), radius * radius
    (slope, low, high), size = sides, depth.shape[0]
    ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    bx, by, bz = ends[i, 1, 0], ends[i, 1, 1], ends[i, 1, 2]
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = math.sqrt(dx * dx + dy * dy + dz * dz) + np.float32(1e-9)
    dx, dy, dz = dx / length, dy / length, dz / length
    along = dx * ax + dy * ay + dz * az
    ca = ax * ax + ay * ay + az * az - square
    cb = bx * bx + by * by + bz * bz - square
    c = ca - along * along
    for row in range(r0, r1):
        offset = slope * np.float32(row)
        first = int(max(left, low + offset) + np.float32(0.98))  # not negative: int rounds down
        blocks = (int(min(right, high + offset)) - first + 8) // 8
        first = min(first, size - 8 * blocks)
        v = v0 + np.float32(row) * step
        k_axis, k_a, k_b, k_ray = dy * v + dz, ay * v + az, by * v + bz, v * v + one
        for start in range(first, first + 8 * blocks, 8):
            part = depth[row, start : start + 8]
            u_start = u0 + np.float32(start) * step
            for j in range(8):
                u = u_start + np.float32(np.int32(j)) * step
                ray, axis, to_a = k_ray + u * u, k_axis + dx * u, k_a + ax * u
                a, b = ray - axis * axis, to_a - along * axis
                h = b * b - a * c
                side = b - math.sqrt(max(h, zero))
                y = side * axis - along * a  # a times the place along the axis
                before = y <= zero
                inside = (y > zero) and (y < length * a)
                to_end = to_a if before else k_b + bx * u
                h_end = to_end * to_end - ray * (ca if before else cb)
                end = to_end - math.sqrt(max(h_end, zero))
                hit = h if inside else h_end
                t = (side if inside else end) / (a if inside else ray)
                t = t if (h >= zero and hit >= zero) else FAR
                part[j] = min(part[j], t)


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
    """Write column, row and 1 / z of vertices (V, 3) into work; return their window."""
    inverse_step = np.float32(1.0) / step
    one, zero, last = np.float32(1.0), np.float32(0.0), np.float32(size - 1)
    top, bottom, left, right = last, zero, last, zero
    for i in range(vertices.shape[0]):
        vx, vy, vz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        x = rotation[0, 0] * vx + rotation[0, 1] * vy + rotation[0, 2] * vz + x0
        y = rotation[1, 0] * vx + rotation[1, 1] * vy + rotation[1, 2] * vz + y0
        z = rotation[2, 0] * vx + rotation[2, 1] * vy + rotation[2, 2] * vz + z0
        inverse = one / max(z, NEAR)
        column, row = (x * inverse - u0) * inverse_step, (y * inverse - v0) * inverse_step
        work[i, 0], work[i, 1], work[i, 2] = column, row, inverse
        top, bottom = min(top, row), max(bottom, row)
        left, right = min(left, column), max(right, column)
    r0, r1 = int(max(top, zero)), int(min(bottom, last)) + 1
    return r0, r1, int(max(left, zero)), int(min(right, last)) + 1


@borrowing_kernel
def draw_mesh(
    vertices: Floats,
    faces: NDArray[np.int32],
    rotation: Floats,
    x0: np.float32,
    y0: np.float32,
    z0: np.float32,
    depth: Floats,
    u0: np.float32,
    v0: np.float32,
    step: np.float32,
    work: Floats,
) -> tuple[int, int, int, int]:
    """Draw the front faces of a mesh at pose (rotation, (x0, y0, z0)) into depth (S, S).

    vertices (V, 3) [m], faces (F, 3), outward normals by the right-hand rule; work (>= V, 3).

    Returns:
        rows and columns (r0, r1, c0, c1), half open, within which pixels may have changed.
    """
    size = depth.shape[0]
    window = project(vertices, rotation, x0, y0, z0, u0, v0, step, size, work)
    one, zero, last = np.float32(1.0), np.float32(0.0), np.float32(size - 1)
    up, low, high = np.float32(0.999), np.float32(-1e-4), np.float32(1.0001)
    for k in range(faces.shape[0]):
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        ax, ay, bx, by = work[a, 0], work[a, 1], work[b, 0], work[b, 1]
        cx, cy = work[c, 0], work[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= np.float32(-1e-6):
            continue
        r0, r1 = int(max(min(ay, by, cy), zero) + up), int(min(max(ay, by, cy), last) + one)
        c0, c1 = int(max(min(ax, bx, cx), zero) + up), int(min(max(ax, bx, cx), last) + one)
        if r0 >= r1 or c0 >= c1:
            continue
        inverse = one / area
        wa = work[a, 2]
        wb, wc = work[b, 2] - wa, work[c, 2] - wa
        e1x, e1y = (cy - ay) * inverse, (ax - cx) * inverse
        e2x, e2y = (ay - by) * inverse, (bx - ax) * inverse
        for row in range(r0, r1):
            fy = np.float32(row) - ay
            for column in range(c0, c1):
                fx = np.float32(column) - ax
                l1 = fx * e1x + fy * e1y
                l2 = fx * e2x + fy * e2y
                if l1 >= low and l2 >= low and l1 + l2 <= high:
                    z = one / (wa + l1 * wb + l2 * wc)
                    if z < depth[row, column]:
                        depth[row, column] = z
    return window
