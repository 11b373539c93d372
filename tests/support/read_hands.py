"""What perfect networks and a perfect depth camera would say about a posed hand."""

import numpy as np
from tests.support.hand_films import HANDS

from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.transforms import rotation_from_vector
from intent_tracking.hands.hand_square import square_of_key_points
from intent_tracking.hands.key_point_start import key_point_offsets
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.hands.skin_depth import with_bones
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_kernel import hand_buffers, place_hand
from intent_tracking.scene.hand_model import FITTED_LIMITS
from intent_tracking.scene.posture_prior import shipped_posture


def joints_of(side, state, size=1.0):
    """Return the 21 joints in the camera's frame [m]."""
    buffers = hand_buffers()
    place_hand(HANDS[side][1], state.values, state.rotations[0], buffers)
    joints = buffers.landmarks.astype(np.float64)
    return joints[0] + size * (joints - joints[0])


def random_hand(seed, spread=1.0):
    """Return a hand anywhere before the camera, turned at random, in a usual posture."""
    rng = np.random.default_rng(seed)
    posture = shipped_posture()
    covariance = np.linalg.inv(posture.precision.astype(np.float64))
    angles = rng.multivariate_normal(posture.mean, spread**2 * covariance)
    values = np.zeros(26, np.float32)
    values[:3] = [*rng.uniform(-0.12, 0.12, 2), rng.uniform(0.5, 1.0)]
    values[6:] = np.clip(angles, FITTED_LIMITS[:, 0], FITTED_LIMITS[:, 1])
    rotation = rotation_from_vector(rng.normal(0, 1.5, 3)).astype(np.float32)
    return BodyState(values, rotation[None])


def read_hand(side, state, right=None, size=1.0):
    """Return the key points of a hand (21, 3) and what the networks would make of them."""
    offsets = size * key_point_offsets(side) @ state.rotations[0].T.astype(np.float64)
    points = joints_of(side, state, size) + offsets
    pixels = KINECT.project(points)
    probability = float(side == "right") if right is None else right
    shape = 0.9 * (points - points[9])  # of a smaller hand than ours
    return points, SeenHand(0, pixels, shape, 1.0, probability, square_of_key_points(pixels))


def no_depth():
    color = np.zeros((480, 640, 3), np.uint8)
    return RgbdFrame(0, color, np.zeros((480, 640), np.float32), KINECT)


def skin_frame(points, without=(), behind=0.15, thickness=0.010):
    """Return a frame with skin before each key point and bone but some, and a wall behind."""
    frame = no_depth()
    wall = points[:, 2].mean() + behind
    frame.depth[:] = wall
    samples = with_bones(points)
    rows, columns = np.mgrid[:480, :640]
    for s in np.argsort(-samples[:, 2]):
        if s not in without:
            u, v = KINECT.project(samples[s])
            disc = (columns - u) ** 2 + (rows - v) ** 2 < 5.0**2
            frame.depth[disc] = samples[s, 2] - thickness
    return frame
