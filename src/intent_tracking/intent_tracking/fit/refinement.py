"""Levenberg-Marquardt over all 26 + 6 K unknowns together, for one start or many."""

import math

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.normal_equations import linearize
from intent_tracking.fit.wrenches import WRENCH
from intent_tracking.image.frame_evidence import FrameEvidence, Prior, Weights
from intent_tracking.scene.hand_kernel import HandArrays, new_hand_buffers, turn
from intent_tracking.scene.object_kernel import ObjectArrays
from intent_tracking.scene.state_layout import CAPSULES, HAND_SIZE, JOINTS, OBJECT_SIZE


@borrowing_kernel
def solve_damped(
    normal: Floats, gradient: Floats, damping: np.float32, lower: Floats, step: Floats
) -> None:
    """Solve (normal + damping diag(normal)) step = gradient by Cholesky; `lower` is work space."""
    size = gradient.shape[0]
    for i in range(size):
        for j in range(i + 1):
            s = normal[i, j]
            if i == j:
                s = s * (np.float32(1.0) + damping) + np.float32(1e-6)
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = math.sqrt(max(s, np.float32(1e-12)))
            else:
                lower[i, j] = s / lower[j, j]
    for i in range(size):
        s = gradient[i]
        for k in range(i):
            s -= lower[i, k] * step[k]
        step[i] = s / lower[i, i]
    for i in range(size - 1, -1, -1):
        s = step[i]
        for k in range(i + 1, size):
            s -= lower[k, i] * step[k]
        step[i] = s / lower[i, i]


@borrowing_kernel
def apply_step(
    state: Floats,
    rotations: Floats,
    step: Floats,
    limits: Floats,
    new_state: Floats,
    new_rotations: Floats,
) -> None:
    """Write state and rotations after a step; angles stay within their limits."""
    for i in range(state.shape[0]):
        new_state[i] = state[i] + step[i]
    for n in range(JOINTS):
        new_state[6 + n] = min(max(new_state[6 + n], limits[n, 0]), limits[n, 1])
    for body in range(rotations.shape[0]):
        offset = 3 if body == 0 else HAND_SIZE + OBJECT_SIZE * (body - 1) + 3
        turn(step[offset], step[offset + 1], step[offset + 2], rotations[body], new_rotations[body])
        for i in range(offset, offset + 3):
            new_state[i] = np.float32(0.0)


@kernel
def refine(
    hand: HandArrays,
    objects: ObjectArrays,
    evidence: FrameEvidence,
    weights: Weights,
    prior: Prior,
    states: Floats,
    rotations: Floats,
    iterations: int,
    costs: Floats,
    normals: Floats,
) -> None:
    """Refine every start in place.

    Args:
        hand: `HandArrays`.
        objects: `ObjectArrays` of K objects.
        evidence: `FrameEvidence` of the frame.
        weights: `Weights`.
        prior: `Prior`, the same for all starts.
        states: (B, 26 + 6 K) starts, overwritten by the results.
        rotations: (B, 1 + K, 3, 3), overwritten.
        iterations: largest number of linearisations after the first.
        costs: (B,) receives E.
        normals: (B, D, D) receives the normal matrix at the result (lower triangle).
    """
    size = states.shape[1]
    buffers = new_hand_buffers()
    work = np.empty((2, max(evidence.hand_points.shape[1], 1)), np.float32)
    trial_normal = np.empty((size, size), np.float32)
    gradient, trial_gradient = np.empty(size, np.float32), np.empty(size, np.float32)
    lower, step = np.zeros((size, size), np.float32), np.zeros(size, np.float32)
    row, index = np.empty(JOINTS, np.float32), np.empty(JOINTS, np.int64)
    bags = np.empty((CAPSULES + rotations.shape[1] - 1, WRENCH), np.float32)
    g = np.empty(3, np.float32)
    trial, trial_rotations = np.empty_like(states[0]), np.empty_like(rotations[0])
    for b in range(states.shape[0]):
        state, rotation, normal = states[b], rotations[b], normals[b]
        cost = linearize(
            hand, objects, evidence, weights, prior, state, rotation, buffers, normal, gradient,
            bags, work, row, index, g,
        )  # fmt: skip
        damping = np.float32(0.01)
        for _ in range(iterations):
            solve_damped(normal, gradient, damping, lower, step)
            apply_step(state, rotation, step, prior.limits, trial, trial_rotations)
            trial_cost = linearize(
                hand, objects, evidence, weights, prior, trial, trial_rotations, buffers,
                trial_normal, trial_gradient, bags, work, row, index, g,
            )  # fmt: skip
            if trial_cost < cost:
                gain = (cost - trial_cost) / cost
                state[:], rotation[:, :, :] = trial, trial_rotations
                normal[:, :], gradient[:] = trial_normal, trial_gradient
                cost, damping = trial_cost, max(damping * np.float32(0.3), np.float32(1e-4))
                if gain < np.float32(1e-4):
                    break
            else:
                damping *= np.float32(5.0)
                if damping > np.float32(100.0):
                    break
        costs[b] = cost
