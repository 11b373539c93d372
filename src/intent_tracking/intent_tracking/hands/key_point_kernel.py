"""Inverse kinematics of the hand from key points, compiled.

The unknowns are 27: wrist position, rotation (applied from the left), 20 angles, log of the hand's
size relative to its model.
"""

import math
from typing import NamedTuple

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.scene.hand_kernel import (
    HandArrays,
    HandBuffers,
    new_hand_buffers,
    place_hand,
    turn,
)
from intent_tracking.scene.posture_prior import Posture

UNKNOWNS = 27
SAMPLES = 41
"""Depth samples: the 21 key points, then the middles of the 20 bones."""


class KeyPointTarget(NamedTuple):
    """What one frame says about the hand."""

    pixels: Array
    """(21, 2) normalised image coordinates x / z, y / z of the key points."""
    trust: Array
    """(21,) weight of each; 0 = not read."""
    shape: Array
    """(21, 3) the hand about its palm's middle, camera axes, size of the model [m]."""
    depth: Array
    """(41,) of the skin at `SAMPLES` [m]; 0 = unknown."""
    radii: Array
    """(41,) how far below the skin they lie [m]."""
    offsets: Array
    """(21, 3) key point minus joint in `hand_wrist` [m]."""
    limits: Array
    """(20, 2) [rad]."""
    posture: Posture
    """Prior of the angles."""


class KeyPointWeights(NamedTuple):
    """How much each term of the fit counts."""

    pixel: float
    """Spread of key points across the line of sight [rad]."""
    shape: float
    """Spread of the network's metric shape [m]."""
    depth: float
    """Spread of the skin's depth [m]; samples off by several times as much count for little."""
    hidden: float
    """Spreads by which a sample may be nearer before something must hide the joint."""
    limit: float
    """Spread beyond the joints' limits [rad]."""
    posture: float
    """Weight of the posture prior's squared Mahalanobis distance."""
    usual: float
    """Log of the usual size."""
    size: float
    """Spread of the log of the size."""


@borrowing_kernel
def key_points_of(
    hand: HandArrays,
    offsets: Array,
    state: Floats,
    rotation: Floats,
    buffers: HandBuffers,
    points: Array,
    jacobian: Array,
) -> None:
    """Write the key points (21, 3) [m] of a state (27,) and their derivatives (21, 3, 27).

    state and rotation (3, 3) are float32 as in `place_hand`; buffers are `HandBuffers`.
    """
    place_hand(hand, state, rotation, buffers)
    size = math.exp(state[26])
    jacobian[:, :, :] = 0.0
    for j in range(21):
        hx = size * (buffers.landmarks[j, 0] - state[0])
        hy = size * (buffers.landmarks[j, 1] - state[1])
        hz = size * (buffers.landmarks[j, 2] - state[2])
        ox, oy, oz = size * offsets[j, 0], size * offsets[j, 1], size * offsets[j, 2]
        if j > 0:
            finger = (j - 1) // 4
            for k in range(min(j - 4 * finger, 4)):
                n = 4 * finger + k
                ax, ay, az = buffers.axes[n, 0], buffers.axes[n, 1], buffers.axes[n, 2]
                x = hx - size * (buffers.pivots[n, 0] - state[0])
                y = hy - size * (buffers.pivots[n, 1] - state[1])
                z = hz - size * (buffers.pivots[n, 2] - state[2])
                jacobian[j, 0, 6 + n] = ay * z - az * y
                jacobian[j, 1, 6 + n] = az * x - ax * z
                jacobian[j, 2, 6 + n] = ax * y - ay * x
        hx += rotation[0, 0] * ox + rotation[0, 1] * oy + rotation[0, 2] * oz
        hy += rotation[1, 0] * ox + rotation[1, 1] * oy + rotation[1, 2] * oz
        hz += rotation[2, 0] * ox + rotation[2, 1] * oy + rotation[2, 2] * oz
        points[j, 0], points[j, 1], points[j, 2] = state[0] + hx, state[1] + hy, state[2] + hz
        for i in range(3):
            jacobian[j, i, i] = 1.0
        jacobian[j, 0, 4], jacobian[j, 0, 5] = hz, -hy
        jacobian[j, 1, 3], jacobian[j, 1, 5] = -hz, hx
        jacobian[j, 2, 3], jacobian[j, 2, 4] = hy, -hx
        jacobian[j, 0, 26], jacobian[j, 1, 26], jacobian[j, 2, 26] = hx, hy, hz


@borrowing_kernel
def _add(normal: Array, gradient: Array, row: Array, e: float, w: float) -> None:
    """Add w e^2 of a residual with derivatives `row` (27,) to the normal equations."""
    for a in range(27):
        v = w * row[a]
        if v != 0.0:
            gradient[a] -= v * e
            for b in range(a + 1):
                normal[a, b] += v * row[b]


@borrowing_kernel
def _add_pixels(
    target: KeyPointTarget,
    weights: KeyPointWeights,
    points: Array,
    jacobian: Array,
    row: Array,
    normal: Array,
    gradient: Array,
) -> float:
    """Add the distances across the lines of sight; return their cost (Cauchy's, at 3 spreads)."""
    cost = 0.0
    for j in range(21):
        if target.trust[j] <= 0.0:
            continue
        inverse = 1.0 / max(points[j, 2], 0.05)
        x, y = points[j, 0] * inverse, points[j, 1] * inverse
        ex, ey = (
            (x - target.pixels[j, 0]) / weights.pixel,
            (y - target.pixels[j, 1]) / weights.pixel,
        )
        q = 1.0 + (ex * ex + ey * ey) / 9.0
        cost += target.trust[j] * 9.0 * math.log(q)
        w = target.trust[j] / q
        scale = inverse / weights.pixel
        for a in range(27):
            row[a] = (jacobian[j, 0, a] - x * jacobian[j, 2, a]) * scale
        _add(normal, gradient, row, ex, w)
        for a in range(27):
            row[a] = (jacobian[j, 1, a] - y * jacobian[j, 2, a]) * scale
        _add(normal, gradient, row, ey, w)
    return cost


@borrowing_kernel
def _add_shape(
    target: KeyPointTarget,
    weights: KeyPointWeights,
    points: Array,
    jacobian: Array,
    row: Array,
    normal: Array,
    gradient: Array,
) -> float:
    """Add the distances from the network's shape, both about the palm's middle; return the cost."""
    cost = 0.0
    for i in range(3):
        middle = (points[0, i] + points[5, i] + points[9, i] + points[13, i] + points[17, i]) / 5.0
        for j in range(21):
            if target.trust[j] <= 0.0:
                continue
            e = (points[j, i] - middle - target.shape[j, i]) / weights.shape
            q = 1.0 + e * e / 9.0
            cost += target.trust[j] * 9.0 * math.log(q)
            for a in range(27):
                palm = jacobian[0, i, a] + jacobian[5, i, a] + jacobian[9, i, a]
                palm += jacobian[13, i, a] + jacobian[17, i, a]
                row[a] = (jacobian[j, i, a] - palm / 5.0) / weights.shape
            _add(normal, gradient, row, e, target.trust[j] / q)
    return cost


@borrowing_kernel
def _add_depth(
    target: KeyPointTarget,
    weights: KeyPointWeights,
    points: Array,
    jacobian: Array,
    row: Array,
    normal: Array,
    gradient: Array,
) -> float:
    """Add the distances below the skin (Geman-McClure at 3 spreads); return their cost."""
    cost = 0.0
    for s in range(41):
        if target.depth[s] <= 0.0:
            continue
        if s < 21:
            first, second = s, s
        else:
            first = s - 20
            second = 0 if (s - 21) % 4 == 0 else first - 1
        z = 0.5 * (points[first, 2] + points[second, 2])
        e = (z - target.radii[s] - target.depth[s]) / weights.depth
        # what lies below the skin seen there may be hidden behind another finger
        wide = weights.hidden * weights.hidden if e > 0.0 else 9.0
        q = 1.0 + e * e / wide
        cost += wide * (1.0 - 1.0 / q)
        for a in range(27):
            row[a] = 0.5 * (jacobian[first, 2, a] + jacobian[second, 2, a]) / weights.depth
        _add(normal, gradient, row, e, 1.0 / (q * q))
    return cost


@borrowing_kernel
def _add_angles(
    target: KeyPointTarget,
    weights: KeyPointWeights,
    state: Floats,
    normal: Array,
    gradient: Array,
) -> float:
    """Add limits, posture prior and size; return their cost."""
    cost = 0.0
    w = 1.0 / (weights.limit * weights.limit)
    for n in range(20):
        e = min(state[6 + n] - target.limits[n, 0], 0.0)
        e += max(state[6 + n] - target.limits[n, 1], 0.0)
        if e != 0.0:
            cost += w * e * e
            normal[6 + n, 6 + n] += w
            gradient[6 + n] -= w * e
        pull = 0.0
        for m in range(20):
            pull += target.posture.precision[n, m] * (state[6 + m] - target.posture.mean[m])
        for m in range(n + 1):
            normal[6 + n, 6 + m] += weights.posture * target.posture.precision[n, m]
        gradient[6 + n] -= weights.posture * pull
        cost += weights.posture * pull * (state[6 + n] - target.posture.mean[n])
    w = 1.0 / (weights.size * weights.size)
    e = state[26] - weights.usual
    normal[26, 26] += w
    gradient[26] -= w * e
    return cost + w * e * e


@kernel
def linearize_key_points(
    hand: HandArrays,
    target: KeyPointTarget,
    weights: KeyPointWeights,
    state: Floats,
    rotation: Floats,
    buffers: HandBuffers,
    points: Array,
    jacobian: Array,
    normal: Array,
    gradient: Array,
) -> float:
    """Return the cost at a state; write normal matrix (27, 27, lower) and -half the gradient."""
    normal[:, :] = 0.0
    gradient[:] = 0.0
    row = np.zeros(27)
    key_points_of(hand, target.offsets, state, rotation, buffers, points, jacobian)
    cost = _add_pixels(target, weights, points, jacobian, row, normal, gradient)
    cost += _add_shape(target, weights, points, jacobian, row, normal, gradient)
    cost += _add_depth(target, weights, points, jacobian, row, normal, gradient)
    return cost + _add_angles(target, weights, state, normal, gradient)


@borrowing_kernel
def _solve(normal: Array, gradient: Array, damping: float, factor: Array, step: Array) -> bool:
    """Write the damped step (27,) by Cholesky's method; return whether there is one."""
    for a in range(27):
        for b in range(a + 1):
            total = normal[a, b]
            if a == b:
                total += damping * normal[a, a] + 1e-9
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            if a == b:
                if total <= 0.0:
                    return False
                factor[a, a] = math.sqrt(total)
            else:
                factor[a, b] = total / factor[b, b]
    for a in range(27):
        total = gradient[a]
        for b in range(a):
            total -= factor[a, b] * step[b]
        step[a] = total / factor[a, a]
    for i in range(27):
        a = 26 - i
        total = step[a]
        for b in range(a + 1, 27):
            total -= factor[b, a] * step[b]
        step[a] = total / factor[a, a]
    return True


@kernel
def fit_key_points(
    hand: HandArrays,
    target: KeyPointTarget,
    weights: KeyPointWeights,
    state: Floats,
    rotation: Floats,
    iterations: int,
) -> float:
    """Move state (27,) and rotation (3, 3), both float32, to the least cost; return that cost.

    Levenberg-Marquardt with at most so many linearisations.
    """
    buffers = new_hand_buffers()
    points, jacobian = np.zeros((21, 3)), np.zeros((21, 3, 27))
    normal, gradient = np.zeros((27, 27)), np.zeros(27)
    trial_normal, trial_gradient = np.zeros((27, 27)), np.zeros(27)
    factor, step = np.zeros((27, 27)), np.zeros(27)
    trial, turned = np.zeros(27, np.float32), np.zeros((3, 3), np.float32)
    damping = 1e-2
    cost = linearize_key_points(
        hand, target, weights, state, rotation, buffers, points, jacobian, normal, gradient
    )
    for _ in range(iterations - 1):
        if not _solve(normal, gradient, damping, factor, step):
            damping = 10.0 * damping + 1e-6
            continue
        for a in range(27):
            trial[a] = state[a] + np.float32(step[a])
        turn(np.float32(step[3]), np.float32(step[4]), np.float32(step[5]), rotation, turned)
        new = linearize_key_points(
            hand, target, weights, trial, turned, buffers, points, jacobian, trial_normal,
            trial_gradient,
        )  # fmt: skip
        if new < cost:
            gain = cost - new
            state[:], rotation[:, :], cost = trial, turned, new
            normal[:, :], gradient[:] = trial_normal, trial_gradient
            damping = max(0.2 * damping, 1e-6)
            if gain < 1e-4 * cost:
                break
        else:
            damping = 8.0 * damping
            if damping > 1e4:
                break
    return cost
