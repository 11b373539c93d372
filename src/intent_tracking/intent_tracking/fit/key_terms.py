"""Key points of the hand as evidence: how far each joint lies from its line of sight, compiled.

A key point c (joint plus its offset on the skin) is seen along (u, v, 1). Its residuals are the
distances x - u z and y - v z across that line [m], robust together:

    E_key = w_key sum_j w_j rho_k(|(x - u z, y - v z)|),  rho_k as in `normal_equations`, k = 15 mm

The derivatives take the offset, which is at most 2 cm, to turn with the joint's own bone.
Lines of sight say nothing about depth, which points and silhouette know better.
"""

import math

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.wrenches import add_wrench
from intent_tracking.image.frame_evidence import KeyEvidence
from intent_tracking.scene.hand_kernel import LANDMARKS, HandBuffers
from intent_tracking.scene.state_layout import FINGER_CAPSULES

KEY_SCALE = np.float32(0.015)
"""A key point farther off than this is read wrong rather than there [m]: the networks' error is
about 5 mm on real and rendered fingers and 20-40 mm on thumbs that they guess."""


@borrowing_kernel
def key_residual(
    buffers: HandBuffers, keys: KeyEvidence, rotation: Floats, j: int, point: Floats
) -> tuple[np.float32, np.float32]:
    """Return the residuals of key point j; write the point (3,) in the camera's frame."""
    for r in range(3):
        point[r] = (
            buffers.landmarks[j, r]
            + rotation[r, 0] * keys.offsets[j, 0]
            + rotation[r, 1] * keys.offsets[j, 1]
            + rotation[r, 2] * keys.offsets[j, 2]
        )
    return point[0] - keys.rays[j, 0] * point[2], point[1] - keys.rays[j, 1] * point[2]


@borrowing_kernel
def add_keys(
    buffers: HandBuffers,
    keys: KeyEvidence,
    state: Floats,
    rotation: Floats,
    weight: np.float32,
    bags: Floats,
    point: Floats,
) -> np.float32:
    """Add all key points to the bags of the capsules that carry them; return their cost."""
    one, zero, square = np.float32(1.0), np.float32(0.0), KEY_SCALE * KEY_SCALE
    cost = zero
    for j in range(LANDMARKS):
        w = weight * keys.weights[j]
        if w <= zero:
            continue
        ex, ey = key_residual(buffers, keys, rotation, j, point)
        q = one + (ex * ex + ey * ey) / square
        cost += w * square * (one - one / q)
        w /= q * q
        finger, level = (j - 1) // 4, (j - 1) % 4
        bag = bags[FINGER_CAPSULES] if j == 0 else bags[3 * finger + min(level, 2)]
        x, y, z = point[0] - state[0], point[1] - state[1], point[2] - state[2]
        add_wrench(bag, one, zero, -keys.rays[j, 0], x, y, z, ex, w)
        add_wrench(bag, zero, one, -keys.rays[j, 1], x, y, z, ey, w)
    return cost


@kernel
def key_cost(buffers: HandBuffers, keys: KeyEvidence, rotation: Floats) -> np.float32:
    """Return sum w_j rho_k / k^2: each key point counts up to its weight."""
    one, point = np.float32(1.0), np.empty(3, np.float32)
    cost = np.float32(0.0)
    for j in range(LANDMARKS):
        if keys.weights[j] > np.float32(0.0):
            ex, ey = key_residual(buffers, keys, rotation, j, point)
            cost += keys.weights[j] * (
                one - one / (one + (ex * ex + ey * ey) / (KEY_SCALE * KEY_SCALE))
            )
    return cost


@kernel
def key_gap(buffers: HandBuffers, keys: KeyEvidence, rotation: Floats) -> np.float32:
    """Return the weighted mean distance [m] of joints from their lines of sight; -1: none seen."""
    point = np.empty(3, np.float32)
    total, weights = np.float32(0.0), np.float32(0.0)
    for j in range(LANDMARKS):
        if keys.weights[j] > np.float32(0.0):
            ex, ey = key_residual(buffers, keys, rotation, j, point)
            total += keys.weights[j] * math.sqrt(ex * ex + ey * ey)
            weights += keys.weights[j]
    return total / weights if weights > np.float32(0.0) else np.float32(-1.0)
