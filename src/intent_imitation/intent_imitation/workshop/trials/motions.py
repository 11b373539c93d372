"""What the robot's wrist does with a grasp: approach, close, lift, and the task's test motion."""

from dataclasses import dataclass

import numpy as np

from intent_imitation.planner.plan import GraspCandidate
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    make_pose,
    rotation_from_vector,
    vector_from_rotation,
)

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class MotionConfig(Checked):
    """How far and how fast the wrist moves."""

    retreat: float = 0.16
    """The approach starts this far from the grasp [m], 0.01..1."""
    lift: float = 0.18
    """Height of the lift [m], 0.01..1."""
    present: float = 0.20
    """How far a hand-over reaches out [m], 0.01..1."""
    push: float = 0.06
    """How far a tool is pushed [m], 0.01..1."""
    turn: float = 0.6
    """How far a tool is turned, to either side [rad], 0..3.1."""
    tilt: float = np.pi / 2
    """How far a vessel is tilted for pouring [rad], 0..3.1."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One stretch of the motion, from wherever the hand is to a target."""

    name: str
    T_table_hand: Array
    """(4, 4) where the wrist ends."""
    closed: float
    """Share of the closing, 0 = open, 1 = closed and squeezing."""
    duration: float
    """[s]."""


def stages(grasp: GraspCandidate, task: str, pivot: Array, config: MotionConfig) -> list[Stage]:
    """Return the motion of a grasp for a task.

    Args:
        grasp: the planned grasp.
        task: name of the task; an unknown one is only lifted.
        pivot: (3,) centre of the object on the table, about which the task turns it [m].
        config: distances.

    Returns:
        The stages; the hand starts open at the first stage's target.
    """
    start = _moved(grasp.T_table_hand, -config.retreat * grasp.approach)
    up = config.lift * _UP
    lifted = _moved(grasp.T_table_hand, up)
    motion = [
        Stage("start", start, 0.0, 0.2),
        Stage("approach", grasp.T_table_hand, 0.0, 0.7),
        Stage("close", grasp.T_table_hand, 1.0, 0.6),
        Stage("lift", lifted, 1.0, 0.8),
    ]
    return motion + _task_stages(lifted, grasp.approach, task, pivot + up, config)


def _task_stages(
    lifted: Array, approach: Array, task: str, pivot: Array, config: MotionConfig
) -> list[Stage]:
    """Return what is done with the lifted object."""
    axis = tilt_axis(approach)
    forward = _horizontal(approach)
    if task == "pouring":
        return [Stage("tilt", _turned(lifted, axis, config.tilt, pivot), 1.0, 1.2)]
    if task == "dish-washing":
        return [Stage("turn over", _turned(lifted, axis, np.pi, pivot), 1.0, 1.8)]
    if task == "hand-over":
        return [Stage("present", _moved(lifted, config.present * forward), 1.0, 0.9)]
    if task == "tool-use":
        pushed = _moved(lifted, config.push * forward)
        return [
            Stage("push", pushed, 1.0, 0.4),
            Stage("turn", _turned(pushed, axis, config.turn, pivot), 1.0, 0.6),
            Stage("turn back", _turned(pushed, axis, -config.turn, pivot), 1.0, 0.9),
        ]
    return [Stage("hold", lifted, 1.0, 0.5)]


def tilt_axis(approach: Array) -> Array:
    """Return the horizontal axis (3,) about which the forearm turns an object.

    From the side it is the approach itself (a turn of the forearm); from above, an axis across.
    """
    if abs(float(approach @ _UP)) < 0.75:
        return _horizontal(approach)
    return np.array([1.0, 0.0, 0.0])


def interpolate(start: Array, end: Array, share: float) -> Array:
    """Return the pose (4, 4) at a share of the way, without jerk at both ends."""
    s = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    turn = vector_from_rotation(end[:3, :3] @ start[:3, :3].T)
    rotation = rotation_from_vector(s * turn) @ start[:3, :3]
    return make_pose(rotation, (1.0 - s) * start[:3, 3] + s * end[:3, 3])


def _horizontal(direction: Array) -> Array:
    flat = np.array([direction[0], direction[1], 0.0])
    length = float(np.linalg.norm(flat))
    return flat / length if length > 0.2 else np.array([1.0, 0.0, 0.0])


def _moved(pose: Array, shift: Array) -> Array:
    return make_pose(pose[:3, :3], pose[:3, 3] + shift)


def _turned(pose: Array, axis: Array, angle: float, pivot: Array) -> Array:
    """Return the pose turned about an axis through the pivot."""
    rotation = rotation_from_vector(angle * axis)
    return make_pose(rotation @ pose[:3, :3], pivot + rotation @ (pose[:3, 3] - pivot))
