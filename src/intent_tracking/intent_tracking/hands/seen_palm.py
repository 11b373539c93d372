"""The palm of a tracked hand in the image: where it is expected, and where the networks see it."""

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import Camera
from intent_tracking.hands.seen_hand import PALM
from intent_tracking.image.frame_evidence import KeyEvidence
from intent_tracking.scene.body_state import BodyState

_NUDGE = 0.008
"""A prediction is moved if the palm is seen farther beside it than this [m]."""


def nudged(guess: BodyState, joints: Floats, keys: KeyEvidence) -> BodyState:
    """Return a prediction with joints (21, 3) moved to where the networks see its palm.

    Little is said twice: a palm that is seen about where it is expected moves nothing.
    """
    if not keys.weights.any():
        return guess
    palm = joints[PALM]
    shift = (keys.rays[PALM] * palm[:, 2:] - palm[:, :2]).mean(axis=0)
    if np.linalg.norm(shift) < _NUDGE:
        return guess
    moved = guess.copy()
    moved.values[:2] += shift
    return moved


def palm_pixel(camera: Camera, joints: Floats) -> Array:
    """Return where the middle (2,) of the palm of joints (21, 3) is seen [pixels]."""
    middle: Array = pixels_of(camera, joints[PALM].mean(axis=0, dtype=np.float64)[None])[0]
    return middle


def pixels_of(camera: Camera, points: Array | Floats) -> Array:
    """Return where points (n, 3) of the camera's frame are seen (n, 2) [pixels]."""
    in_front = np.column_stack([points[:, :2], np.maximum(points[:, 2], 0.05)])
    return camera.project(in_front)
