"""Our hand put on 21 joints that somebody else measured: motion capture, a glove, another tracker.

Bone lengths follow from the joints' distances alone (medians over all frames, which outliers do not
move); then pose and angles of each frame by damped least squares from those of the frame before.
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import (
    make_pose,
    rotation_from_vector,
    vector_from_rotation,
)
from intent_tracking.fit.hand_shape import AVERAGE
from intent_tracking.scene.hand_model import (
    FITTED_LIMITS,
    SHAPE_SIZE,
    HandModel,
    Side,
)
from intent_tracking.scene.state_layout import HAND_SIZE, JOINTS

_ROUNDS, _FIRST_ROUNDS = 6, 40
_LIMIT_WEIGHT, _POSTURE_WEIGHT = 0.1, 0.002
"""Metres that a radian beyond a limit, and one away from a relaxed posture, count."""
_RELAXED: Array = np.radians([25.0, 0, 10, 10, *([0.0, 20, 20, 10] * 4)])
_STEP = 1e-5
_MIRROR = np.array([1.0, -1.0, 1.0])


def shape_of_joints(joints: Array) -> Array:
    """Return the hand shape (22,) whose bones are as long as those measured.

    Args:
        joints: (F, 21, 3) in the order of `LANDMARK_NAMES` [m].
    """
    own = HandModel().joint_positions(np.zeros(JOINTS))
    ratios = np.nanmedian(_bones(joints), axis=0) / _bones(own[None])[0]
    ratios = np.where(np.isfinite(ratios), np.clip(ratios, 0.4, 2.0), 1.0)
    scale = float(np.clip(np.median(ratios), 0.5, 2.0))
    shape = np.concatenate([[scale, AVERAGE[1]], np.clip(ratios / scale, 0.4, 2.5).ravel()])
    assert len(shape) == SHAPE_SIZE
    return shape


def hands_of_joints(joints: Array, side: Side, shape: Array) -> tuple[Array, Array]:
    """Return the state (F, 26) of the hand in each frame and how far its joints are off (F,) [m].

    Frames with a joint that is not finite give NaN.

    Args:
        joints: (F, 21, 3) in the order of `LANDMARK_NAMES` [m]; the states are in their frame.
        side: of the hand.
        shape: (22,) of the hand, see `shape_of_joints`.
    """
    # A left hand's mirror image is a right hand with the same angles.
    points = joints if side == "right" else joints * _MIRROR
    hand = HandModel.from_shape("right", shape)
    states, errors = np.full((len(points), HAND_SIZE), np.nan), np.full(len(points), np.nan)
    state: Array | None = None
    for frame, target in enumerate(points):
        if not np.isfinite(target).all():
            state = None
            continue
        rounds = _ROUNDS if state is not None else _FIRST_ROUNDS
        pose, angles = _split(state) if state is not None else (_first_pose(target), _RELAXED)
        pose, angles, error = _fitted(pose, angles, target, hand, rounds)
        state = np.concatenate([pose[:3, 3], vector_from_rotation(pose[:3, :3]), angles])
        states[frame], errors[frame] = state, error
    if side == "left":
        states[:, 1] *= -1.0
        states[:, [3, 5]] *= -1.0
    return states, errors


def _bones(joints: Array) -> Array:
    """Return the lengths (F, 5, 4) from the wrist along each finger."""
    chains = joints[:, 1:].reshape(len(joints), 5, 4, 3)
    wrist = np.broadcast_to(joints[:, :1, None], (len(joints), 5, 1, 3))
    return np.asarray(np.linalg.norm(np.diff(np.concatenate([wrist, chains], 2), axis=2), axis=3))


def _split(state: Array) -> tuple[Array, Array]:
    return make_pose(rotation_from_vector(state[3:6]), state[:3]), state[6:]


def _first_pose(target: Array) -> Array:
    x = target[9] - target[0]
    x = x / max(float(np.linalg.norm(x)), 1e-9)
    z = np.cross(x, target[17] - target[5])
    z = z / max(float(np.linalg.norm(z)), 1e-9)
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), target[0])


def _fitted(
    pose: Array, angles: Array, target: Array, hand: HandModel, rounds: int
) -> tuple[Array, Array, float]:
    """Return pose (4, 4), angles (20,) and root mean square error [m] after so many rounds."""
    damping = 1e-4
    cost, residual, local = _cost(pose, angles, target, hand)
    for _ in range(rounds):
        jacobian = _jacobian(pose, angles, local, hand)
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), -gradient)
        moved = make_pose(pose[:3, :3] @ rotation_from_vector(step[3:6]), pose[:3, 3] + step[:3])
        bent = np.clip(angles + step[6:], FITTED_LIMITS[:, 0] - 0.2, FITTED_LIMITS[:, 1] + 0.2)
        tried = _cost(moved, bent, target, hand)
        if tried[0] < cost:
            gain, (cost, residual, local) = cost - tried[0], tried
            pose, angles, damping = moved, bent, max(damping * 0.3, 1e-6)
            if gain < 1e-4 * cost:
                break
        else:
            damping *= 10.0
    error = float(np.sqrt(np.mean(np.sum(residual[:63].reshape(21, 3) ** 2, axis=1))))
    return pose, angles, error


def _cost(pose: Array, angles: Array, target: Array, hand: HandModel) -> tuple[float, Array, Array]:
    local = hand.joint_positions(angles)
    placed = local @ pose[:3, :3].T + pose[:3, 3]
    low, high = FITTED_LIMITS.T
    beyond = np.minimum(angles - low, 0.0) + np.maximum(angles - high, 0.0)
    residual = np.concatenate(
        [(placed - target).ravel(), _LIMIT_WEIGHT * beyond, _POSTURE_WEIGHT * (angles - _RELAXED)]
    )
    return float(residual @ residual), residual, local


def _jacobian(pose: Array, angles: Array, local: Array, hand: HandModel) -> Array:
    """Return the derivative (103, 26) of the residuals by position, turn in the hand, angles."""
    rotation = pose[:3, :3]
    result = np.zeros((63 + 2 * JOINTS, 6 + JOINTS))
    result[:63, :3] = np.tile(np.eye(3), (21, 1))
    for axis in range(3):
        turn = np.zeros(3)
        turn[axis] = 1.0
        result[:63, 3 + axis] = (np.cross(turn, local) @ rotation.T).ravel()
    bent = hand.joint_positions(angles + _STEP * np.eye(JOINTS))
    result[:63, 6:] = ((bent - local) @ rotation.T / _STEP).reshape(JOINTS, 63).T
    outside = (angles < FITTED_LIMITS[:, 0]) | (angles > FITTED_LIMITS[:, 1])
    result[63 : 63 + JOINTS, 6:] = np.diag(_LIMIT_WEIGHT * outside)
    result[63 + JOINTS :, 6:] = _POSTURE_WEIGHT * np.eye(JOINTS)
    return result
