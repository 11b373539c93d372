"""The terms of the refinement that do not look at the image: limits, prediction, synergy."""

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel
from intent_tracking.image.frame_evidence import Prior, Weights
from intent_tracking.scene.posture_prior import Posture
from intent_tracking.scene.state_layout import HAND_SIZE, JOINTS, OBJECT_SIZE


@borrowing_kernel
def add_single(
    normal: Floats, gradient: Floats, i: int, e: np.float32, w: np.float32
) -> np.float32:
    """Add w e^2 of a residual that is unknown i itself; return its cost."""
    normal[i, i] += w
    gradient[i] -= w * e
    return w * e * e


@borrowing_kernel
def add_pair(
    normal: Floats,
    gradient: Floats,
    i: int,
    j: int,
    factor: np.float32,
    state: Floats,
    w: np.float32,
) -> np.float32:
    """Add w (x_i - factor x_j)^2, i > j; return its cost."""
    e = state[i] - factor * state[j]
    normal[i, i] += w
    normal[i, j] -= factor * w
    normal[j, j] += factor * factor * w
    gradient[i] -= w * e
    gradient[j] += factor * w * e
    return w * e * e


@borrowing_kernel
def add_posture(
    normal: Floats, gradient: Floats, state: Floats, posture: Posture, w: np.float32
) -> np.float32:
    """Add w times the squared Mahalanobis distance of the joint angles; return its cost."""
    cost = np.float32(0.0)
    for n in range(JOINTS):
        pull = np.float32(0.0)
        for m in range(JOINTS):
            pull += posture.precision[n, m] * (state[6 + m] - posture.mean[m])
        for m in range(n + 1):
            normal[6 + n, 6 + m] += w * posture.precision[n, m]
        gradient[6 + n] -= w * pull
        cost += w * pull * (state[6 + n] - posture.mean[n])
    return cost


@borrowing_kernel
def add_priors(
    weights: Weights,
    prior: Prior,
    state: Floats,
    rotations: Floats,
    normal: Floats,
    gradient: Floats,
) -> np.float32:
    """Add limits, prediction, couplings, posture and object predictions; return their cost."""
    cost = np.float32(0.0)
    zero, half = np.float32(0.0), np.float32(0.5)
    for n in range(JOINTS):
        i = 6 + n
        cost += add_single(normal, gradient, i, state[i] - prior.state[i], weights.angle)
        e = min(state[i] - prior.limits[n, 0], zero) + max(state[i] - prior.limits[n, 1], zero)
        if e != zero:
            cost += add_single(normal, gradient, i, e, weights.limit)
    for finger in range(1, 5):
        pip = 8 + 4 * finger
        cost += add_pair(normal, gradient, pip + 1, pip, np.float32(0.667), state, weights.dip)
        if finger > 1:
            for i in range(pip - 1, pip + 1):
                cost += add_pair(
                    normal, gradient, i, i - 4, np.float32(1.0), state, weights.synergy
                )
    cost += add_posture(normal, gradient, state, prior.posture, weights.posture)
    for i in range(3):
        cost += add_single(normal, gradient, i, state[i] - prior.state[i], weights.hand_place)
    for k in range(rotations.shape[0] - 1):
        offset, m, p = HAND_SIZE + OBJECT_SIZE * k, rotations[1 + k], prior.rotations[1 + k]
        for i in range(offset, offset + 3):
            cost += add_single(normal, gradient, i, state[i] - prior.state[i], prior.place[k])
        for i in range(3):  # half the skew part of m p^T: the small rotation since the prediction
            u, v = (i + 1) % 3, (i + 2) % 3
            e = zero
            for j in range(3):
                e += half * (m[v, j] * p[u, j] - m[u, j] * p[v, j])
            cost += add_single(normal, gradient, offset + 3 + i, e, prior.turn[k])
    return cost
