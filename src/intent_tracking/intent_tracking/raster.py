"""Z-buffers of capsules and triangle meshes on a small tile, for compiled code.

A tile has rows i and columns j; its pixel (i, j) looks along (u0 + j step, v0 + i step, 1). Values
are depths along the optical axis [m]; `FAR` where nothing is drawn.
"""

import math

import numpy as np
from numba import njit

from intent_tracking.hand_kernel import JIT

FAR = np.float32(1e3)
NEAR = np.float32(0.05)


@njit(**JIT)
def tile_span(ends, i, radius, u0, v0, step, size):  # type: ignore[no-untyped-def]
    """Return rows and columns (r0, r1, c0, c1), half open, that capsule i can touch."""
    umin, umax, vmin, vmax = FAR, -FAR, FAR, -FAR
    for e in range(2):
        x, y, z = ends[i, e, 0], ends[i, e, 1], ends[i, e, 2]
        near, far = np.float32(1.0) / (z - radius), np.float32(1.0) / (z + radius)
        umin = min(umin, (x - radius) * near, (x - radius) * far)
        umax = max(umax, (x + radius) * near, (x + radius) * far)
        vmin = min(vmin, (y - radius) * near, (y - radius) * far)
        vmax = max(vmax, (y + radius) * near, (y + radius) * far)
    inverse = np.float32(1.0) / step
    limit, zero = np.float32(size), np.float32(0.0)
    r0 = int(math.floor(min(max((vmin - v0) * inverse, zero), limit)))
    r1 = int(math.ceil(min(max((vmax - v0) * inverse + np.float32(1.0), zero), limit)))
    c0 = int(math.floor(min(max((umin - u0) * inverse, zero), limit)))
    c1 = int(math.ceil(min(max((umax - u0) * inverse + np.float32(1.0), zero), limit)))
    return r0, r1, c0, c1


@njit(**JIT)
def draw_capsule(ends, i, radius, depth, u0, v0, step):  # type: ignore[no-untyped-def]
    """Draw capsule i of ends (C, 2, 3) into depth (S, S), S a multiple of 16.

    Rows are filled in blocks of 16 columns of constant trip count, which vectorise fully.
    """
    if min(ends[i, 0, 2], ends[i, 1, 2]) < radius + NEAR:
        return
    size = depth.shape[0]
    r0, r1, c0, c1 = tile_span(ends, i, radius, u0, v0, step, size)
    if r0 >= r1 or c0 >= c1:
        return
    blocks = (c1 - c0 + 15) // 16
    c0 = min(c0, size - blocks * 16)
    pax, pay, paz = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    pbx, pby, pbz = ends[i, 1, 0], ends[i, 1, 1], ends[i, 1, 2]
    bx, by, bz = pbx - pax, pby - pay, pbz - paz
    square = bx * bx + by * by + bz * bz
    along = -(bx * pax + by * pay + bz * paz)
    ca = pax * pax + pay * pay + paz * paz - radius * radius
    cb = pbx * pbx + pby * pby + pbz * pbz - radius * radius
    c = square * ca - along * along
    zero = np.float32(0.0)
    for row in range(r0, r1):
        v = v0 + np.float32(row) * step
        k_axis, k_a = by * v + bz, -(pay * v + paz)
        k_b, k_ray = -(pby * v + pbz), v * v + np.float32(1.0)
        for block in range(blocks):
            start = c0 + 16 * block
            pixels = depth[row, start : start + 16]
            u_start = u0 + np.float32(start) * step
            for j in range(16):
                u = u_start + np.float32(np.int32(j)) * step
                ray = k_ray + u * u
                axis = k_axis + bx * u
                to_a = k_a - pax * u
                a = square * ray - axis * axis
                b = square * to_a - along * axis
                h = b * b - a * c
                t = (-b - math.sqrt(max(h, zero))) / a
                y = along + t * axis
                first = y <= zero
                to_end = to_a if first else k_b - pbx * u
                h_end = to_end * to_end - ray * (ca if first else cb)
                t_end = (-to_end - math.sqrt(max(h_end, zero))) / ray
                inside = (y > zero) and (y < square)
                t = t if inside else t_end
                hit = h if inside else h_end
                t = t if (h >= zero and hit >= zero) else FAR
                pixels[j] = min(pixels[j], t)


@njit(**JIT)
def draw_mesh(vertices, faces, rotation, x0, y0, z0, depth, u0, v0, step, work):  # type: ignore[no-untyped-def]
    """Draw the front faces of a mesh at pose (rotation, (x0, y0, z0)) into depth (S, S).

    vertices (V, 3) [m], faces (F, 3), outward normals by the right-hand rule; work (>= V, 3).
    """
    size = depth.shape[0]
    inverse_step = np.float32(1.0) / step
    one = np.float32(1.0)
    for i in range(vertices.shape[0]):
        vx, vy, vz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        x = rotation[0, 0] * vx + rotation[0, 1] * vy + rotation[0, 2] * vz + x0
        y = rotation[1, 0] * vx + rotation[1, 1] * vy + rotation[1, 2] * vz + y0
        z = rotation[2, 0] * vx + rotation[2, 1] * vy + rotation[2, 2] * vz + z0
        inverse = one / max(z, NEAR)
        work[i, 0] = (x * inverse - u0) * inverse_step
        work[i, 1] = (y * inverse - v0) * inverse_step
        work[i, 2] = inverse
    for k in range(faces.shape[0]):
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        ax, ay, bx, by = work[a, 0], work[a, 1], work[b, 0], work[b, 1]
        cx, cy = work[c, 0], work[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= np.float32(-1e-6):
            continue
        r0 = max(0, int(math.ceil(min(ay, by, cy))))
        r1 = min(size - 1, int(math.floor(max(ay, by, cy))))
        c0 = max(0, int(math.ceil(min(ax, bx, cx))))
        c1 = min(size - 1, int(math.floor(max(ax, bx, cx))))
        if r0 > r1 or c0 > c1:
            continue
        inverse = one / area
        wa = work[a, 2]
        wb, wc = work[b, 2] - wa, work[c, 2] - wa
        e1x, e1y = (cy - ay) * inverse, (ax - cx) * inverse
        e2x, e2y = (ay - by) * inverse, (bx - ax) * inverse
        low, high = np.float32(-1e-4), np.float32(1.0001)
        for row in range(r0, r1 + 1):
            fy = np.float32(row) - ay
            for column in range(c0, c1 + 1):
                fx = np.float32(column) - ax
                l1 = fx * e1x + fy * e1y
                l2 = fx * e2x + fy * e2y
                if l1 >= low and l2 >= low and l1 + l2 <= high:
                    z = one / (wa + l1 * wb + l2 * wc)
                    if z < depth[row, column]:
                        depth[row, column] = z
