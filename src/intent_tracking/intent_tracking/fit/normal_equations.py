"""The point objective of the refinement and its normal equations, compiled.

Unknowns x: hand position (3), hand rotation increment (3), 20 joint angles, then per object
position (3) and rotation increment (3); rotations are (1 + K, 3, 3) matrices, increments turn them
from the left about the body's origin. Every residual e is in m (rad for the last three terms), and
the cost is a sum of squares in units of one point, [m^2]:

    E = sum_hand rho_s(|p - axis| - r)             observed hand point to nearest capsule surface
      + sum_object rho_s(phi(p))                   observed object point to signed distance
      + w_sil  sum rho_2s(dt z / f)                model samples off the silhouette
      + w_front sum rho_2s(max(d - z_m - 3 mm, 0)) model samples in front of the observed depth
      + w_pen  sum max(r - phi(c) - 1 mm, 0)^2     hand inside the object
      + w_touch sum rho_s(r - phi(c) - 1 mm)       hidden outer phalanges near a held object
      + w_key sum w_j rho_k(...)                   key points off their rays, see `key_terms`
      + w_limit, w_temporal, w_dip, w_synergy      joint limits, prediction, DIP = 2/3 PIP,
                                                   neighbouring fingers alike
rho_s(e) = s^2 e^2 / (s^2 + e^2) (Geman-McClure).
"""

import math

import numpy as np

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.key_terms import add_keys
from intent_tracking.fit.prior_terms import add_priors
from intent_tracking.fit.wrenches import (
    add_row,
    add_wrench,
    body_row,
    empty_bag,
    empty_hand,
    hand_row,
)
from intent_tracking.image.frame_evidence import FrameEvidence, Prior, Weights
from intent_tracking.scene.hand_kernel import HandArrays, HandBuffers, nearest_capsule, place_hand
from intent_tracking.scene.object_kernel import ObjectArrays, distance_in_camera
from intent_tracking.scene.state_layout import CAPSULES, HAND_SIZE, OBJECT_SIZE


@borrowing_kernel
def tile_pixel(
    x: np.float32, y: np.float32, z: np.float32, evidence: FrameEvidence
) -> tuple[np.float32, np.float32]:
    """Return the pixel (row, column) of a point, kept one off the tile's border."""
    last = evidence.depth.shape[0] - 2
    inverse = np.float32(1.0) / max(z, np.float32(0.05))
    column = int((x * inverse - evidence.u0) / evidence.step + np.float32(0.5))
    row = int((y * inverse - evidence.v0) / evidence.step + np.float32(0.5))
    return min(max(row, 1), last), min(max(column, 1), last)


@borrowing_kernel
def add_hand_points(
    hand: HandArrays,
    buffers: HandBuffers,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    bags: Floats,
    work: Floats,
) -> np.float32:
    """Add observed hand points against the nearest capsule; return their cost."""
    nearest_capsule(evidence.hand_points, buffers.ends, hand.radii, work[0], work[1])
    square, cost = weights.scale * weights.scale, np.float32(0.0)
    points = evidence.hand_points
    for n in range(points.shape[1]):
        i = int(work[1, n])
        px, py, pz = points[0, n], points[1, n], points[2, n]
        a, b = buffers.ends[i, 0], buffers.ends[i, 1]
        bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        x, y, z = px - a[0], py - a[1], pz - a[2]
        t = (x * bx + y * by + z * bz) / (bx * bx + by * by + bz * bz)
        t = min(max(t, np.float32(0.0)), np.float32(1.0))
        cx, cy, cz = a[0] + t * bx, a[1] + t * by, a[2] + t * bz
        x, y, z = px - cx, py - cy, pz - cz
        d = math.sqrt(x * x + y * y + z * z) + np.float32(1e-9)
        x, y, z = x / d, y / d, z / d
        e = d - hand.radii[i]
        q = np.float32(1.0) + e * e / square
        cost += square * (np.float32(1.0) - np.float32(1.0) / q)
        w = np.float32(1.0) / (q * q)
        if x * px + y * py + z * pz > np.float32(0.3) * pz:
            w *= np.float32(0.1)  # matched to the far side, which the camera cannot see
        add_wrench(bags[i], -x, -y, -z, cx - state[0], cy - state[1], cz - state[2], e, w)
    return cost


@borrowing_kernel
def add_object_points(
    objects: ObjectArrays,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    rotations: Floats,
    bags: Floats,
    g: Floats,
) -> np.float32:
    """Add observed object points against the signed distance; return their cost."""
    square, cost = weights.scale * weights.scale, np.float32(0.0)
    for n in range(evidence.object_points.shape[1]):
        k = evidence.object_owners[n]
        offset = HAND_SIZE + OBJECT_SIZE * k
        x = evidence.object_points[0, n] - state[offset]
        y = evidence.object_points[1, n] - state[offset + 1]
        z = evidence.object_points[2, n] - state[offset + 2]
        e = distance_in_camera(objects, k, rotations[1 + k], x, y, z, g)
        q = np.float32(1.0) + e * e / square
        cost += square * (np.float32(1.0) - np.float32(1.0) / q)
        w = np.float32(1.0) / (q * q)
        add_wrench(bags[CAPSULES + k], -g[0], -g[1], -g[2], x, y, z, e, w)
    return cost


@borrowing_kernel
def image_residual(
    evidence: FrameEvidence,
    weights: Weights,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    radius: np.float32,
    g: Floats,
) -> tuple[np.float32, np.float32]:
    """Return (residual, weight) of a model sample against silhouette or depth; write d e / dc."""
    r, c = tile_pixel(x, y, z, evidence)
    off = evidence.outside[r, c]
    observed = evidence.depth[r, c]
    if off > np.float32(0.0):
        if observed < z - radius - np.float32(0.015):
            return np.float32(0.0), np.float32(0.0)  # hidden behind something unknown
        half = np.float32(0.5)
        g[0] = (evidence.outside[r, c + 1] - evidence.outside[r, c - 1]) * half
        g[1] = (evidence.outside[r + 1, c] - evidence.outside[r - 1, c]) * half
        g[2] = np.float32(0.0)
        return off * evidence.step * z, weights.silhouette
    e = observed - (z - radius) - np.float32(0.003)
    g[0], g[1], g[2] = np.float32(0.0), np.float32(0.0), np.float32(-1.0)
    if observed > np.float32(0.0) and e > np.float32(0.0):
        return e, weights.front
    return np.float32(0.0), np.float32(0.0)


@borrowing_kernel
def add_hand_samples(
    hand: HandArrays,
    objects: ObjectArrays,
    buffers: HandBuffers,
    evidence: FrameEvidence,
    weights: Weights,
    prior: Prior,
    state: Floats,
    rotations: Floats,
    bags: Floats,
    normal: Floats,
    gradient: Floats,
    row: Floats,
    index: Indices,
    g: Floats,
) -> np.float32:
    """Add silhouette, depth order, penetration and touch of three samples per capsule."""
    cost = np.float32(0.0)
    square = weights.scale * weights.scale
    wide = np.float32(4.0) * square
    one, zero = np.float32(1.0), np.float32(0.0)
    for i in range(CAPSULES):
        for s in range(3):
            if i < 15 and i % 3 != 0 and s == 0:
                continue  # the joint was sampled as the end of the bone before
            t = np.float32(s) * np.float32(0.5)
            a, b = buffers.ends[i, 0], buffers.ends[i, 1]
            cx, cy = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])
            cz, radius = a[2] + t * (b[2] - a[2]), hand.radii[i]
            hx, hy, hz = cx - state[0], cy - state[1], cz - state[2]
            e, w = image_residual(evidence, weights, cx, cy, cz, radius, g)
            if w > zero:
                q = one + e * e / wide
                cost += w * wide * (one - one / q)
                add_wrench(bags[i], g[0], g[1], g[2], hx, hy, hz, e, w / (q * q))
            for k in range(objects.surface.shape[0]):
                offset = HAND_SIZE + OBJECT_SIZE * k
                x, y, z = cx - state[offset], cy - state[offset + 1], cz - state[offset + 2]
                phi = distance_in_camera(objects, k, rotations[1 + k], x, y, z, g)
                e = radius - phi - np.float32(0.001)
                if e > zero:
                    cost += weights.penetration * e * e
                    count = hand_row(buffers, state, i, cx, cy, cz, -g[0], -g[1], -g[2], row, index)
                    count = body_row(offset, x, y, z, g[0], g[1], g[2], row, index, count)
                    add_row(normal, gradient, index, row, count, e, weights.penetration)
                elif prior.touch[k] > zero and i < 15 and i % 3 == 2 and e > np.float32(-0.02):
                    r, c = tile_pixel(cx, cy, cz, evidence)
                    observed = evidence.depth[r, c]
                    if observed > zero and cz - radius - observed > np.float32(0.008):
                        q = one + e * e / square
                        w = weights.touch * prior.touch[k]
                        cost += w * square * (one - one / q)
                        add_wrench(bags[i], -g[0], -g[1], -g[2], hx, hy, hz, e, w / (q * q))
    return cost


@borrowing_kernel
def add_object_samples(
    objects: ObjectArrays,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    rotations: Floats,
    bags: Floats,
    g: Floats,
) -> np.float32:
    """Add silhouette and depth order of the objects' surface samples; return their cost."""
    cost = np.float32(0.0)
    wide = np.float32(4.0) * weights.scale * weights.scale
    one = np.float32(1.0)
    for k in range(objects.surface.shape[0]):
        offset, m = HAND_SIZE + OBJECT_SIZE * k, rotations[1 + k]
        for n in range(objects.surface.shape[1]):
            u, v, w = objects.surface[k, n, 0], objects.surface[k, n, 1], objects.surface[k, n, 2]
            x = m[0, 0] * u + m[0, 1] * v + m[0, 2] * w
            y = m[1, 0] * u + m[1, 1] * v + m[1, 2] * w
            z = m[2, 0] * u + m[2, 1] * v + m[2, 2] * w
            e, weight = image_residual(
                evidence,
                weights,
                x + state[offset],
                y + state[offset + 1],
                z + state[offset + 2],
                np.float32(0.0),
                g,
            )
            if weight > np.float32(0.0):
                q = one + e * e / wide
                cost += weight * wide * (one - one / q)
                add_wrench(bags[CAPSULES + k], g[0], g[1], g[2], x, y, z, e, weight / (q * q))
    return cost


@kernel
def linearize(
    hand: HandArrays,
    objects: ObjectArrays,
    evidence: FrameEvidence,
    weights: Weights,
    prior: Prior,
    state: Floats,
    rotations: Floats,
    buffers: HandBuffers,
    normal: Floats,
    gradient: Floats,
    bags: Floats,
    work: Floats,
    row: Floats,
    index: Indices,
    g: Floats,
) -> np.float32:
    """Return E at (state, rotations); write the normal matrix (lower) and -half the gradient.

    bags (24 + K, 27), work (2, N), row and index (20,), g (3,) are work space.
    """
    normal[:, :] = np.float32(0.0)
    gradient[:] = np.float32(0.0)
    bags[:, :] = np.float32(0.0)
    place_hand(hand, state, rotations[0], buffers)
    cost = add_hand_points(hand, buffers, evidence, weights, state, bags, work)
    cost += add_object_points(objects, evidence, weights, state, rotations, bags, g)
    cost += add_hand_samples(
        hand, objects, buffers, evidence, weights, prior, state, rotations, bags, normal, gradient,
        row, index, g,
    )  # fmt: skip
    cost += add_object_samples(objects, evidence, weights, state, rotations, bags, g)
    cost += add_keys(buffers, evidence.keys, state, rotations[0], weights.key, bags, g)
    empty_hand(bags, buffers, state, normal, gradient)
    for k in range(rotations.shape[0] - 1):
        empty_bag(bags[CAPSULES + k], HAND_SIZE + OBJECT_SIZE * k, normal, gradient)
    return cost + add_priors(weights, prior, state, rotations, normal, gradient)
