"""A posed hand and the points of it that a camera sees."""

import numpy as np

from intent_tracking.image.frame_evidence import FrameEvidence, Prior, Weights
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand, turn
from intent_tracking.scene.hand_model import LIMITS, HandModel
from intent_tracking.scene.posture_prior import shipped_posture

F = np.float32
WEIGHTS = Weights(*map(F, (0.02, 0.0, 0.0, 2.0, 0.0, 1.0, 2e-4, 2e-4, 5e-4, 0.0, 0.0, 0.0)))
NONE = np.zeros(0, F)


def hand_pose(seed):
    rng = np.random.default_rng(seed)
    state = np.zeros(26, F)
    state[:3] = [0.02, -0.01, 0.6]
    state[6:] = rng.uniform(0.05, 0.6, 20)
    rotation = np.zeros((1, 3, 3), F)
    turn(*rng.normal(0, 0.6, 3).astype(F), np.eye(3, dtype=F), rotation[0])
    return state, rotation


def observed(state, rotation, count=600, model=None):
    """Points of the hand's surface that face the camera and lie in no other capsule."""
    arrays, buffers = hand_arrays(model or HandModel()), hand_buffers()
    place_hand(arrays, state, rotation[0], buffers)
    rng = np.random.default_rng(0)
    i = rng.integers(0, 24, count)
    ends = buffers.ends[i]
    axis = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * rng.random((count, 1)).astype(F)
    normal = rng.normal(size=(count, 3))
    normal[:, 2] = -np.abs(normal[:, 2])
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal -= along * np.sum(normal * along, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    points = axis + normal * arrays.radii[i][:, None]
    free = np.ones(count, bool)
    for (a, b), radius in zip(buffers.ends, arrays.radii, strict=True):
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        free &= np.linalg.norm(points - a - t[:, None] * (b - a), axis=1) > radius - 1e-4
    points = points[free]
    empty = np.zeros((32, 32), F)
    return FrameEvidence(
        np.ascontiguousarray(points.T, dtype=F), np.zeros((3, 0), F), np.zeros(0, np.int64),
        empty, empty, F(-0.2), F(-0.2), F(0.4 / 32),
    )  # fmt: skip


def prior_of(state, rotation):
    limits = LIMITS.astype(F)
    return Prior(state.copy(), rotation.copy(), limits, shipped_posture(), NONE, NONE, NONE)
