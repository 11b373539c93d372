"""What the person does: reach, hesitate, grasp, hold, lift, and the beginning of the task."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.workshop.person.acting.hand_motion import Choreography
from intent_tracking.workshop.person.acting.person_grasp import Taker
from intent_tracking.workshop.person.acting.reaching import Reach, free_closing
from intent_tracking.workshop.person.body.person_arm import PersonBody

SETTLED = 5
"""Frames after the last finger has stopped at which a grasp counts as stable in the truth."""


@dataclass(frozen=True)
class Pace:
    """Frames of each phase at 30 Hz."""

    reach: int = 29
    hesitate: int = 0
    approach: int = 9
    close: int = 8
    hold: int = 15
    task: int = 24
    keep: int = 0
    """Frames for which the object is held where the task has brought it."""
    go_on: int = 0
    """Frames for which the task goes on after its beginning, see `going_on`."""

    @property
    def begun(self) -> float:
        """Share of the task's way that its beginning goes: less in less time."""
        return min(1.0, max(2, self.task // 6) / 4.0)


def take_and_use(
    stage: Choreography, taker: Taker, reach: Reach, index: int, task: str, pace: Pace,
    body: PersonBody, rng: np.random.Generator,
) -> int:  # fmt: skip
    """Append one demonstration; return the frame in which its grasp is stable.

    Args:
        stage: the motion so far; the hand is empty.
        taker: the person's fingers on this object.
        reach: the planned grasp.
        index: which object of the stage.
        task: what the person does with it.
        pace: frames of each phase.
        body: the person.
        rng: source of the variation.
    """
    grasp = reach.grasp
    come(stage, reach.T_table_pregrasp, grasp.open_angles, body, pace.reach)
    if pace.hesitate:
        hover = reach.T_table_pregrasp.copy()
        hover[:3, 3] += np.array([0.0, 0.015, 0.008]) + rng.normal(0.0, 0.008, 3)
        relaxed = grasp.open_angles + 0.35 * (grasp.angles - grasp.open_angles)
        stage.move(max(4, pace.hesitate // 2), hover, relaxed)
        stage.wait(pace.hesitate)
    stage.move(pace.approach, reach.T_table_hand, grasp.open_angles)
    if reach.lift_to_close:
        _close_in_the_air(stage, taker, reach, index, pace)
    else:
        stage.close(pace.close, grasp.angles)
    stable = stage.frame + SETTLED
    stage.carry(pace.hold, index, stage.objects[index], grasp.T_object_hand)
    _perform(stage, reach, index, task, pace, rng)
    if pace.keep:
        stage.carry(pace.keep, index, stage.objects[index], grasp.T_object_hand)
    return stable


def home(body: PersonBody) -> Array:
    """Return the hand pose (4, 4) in the lap, hidden behind the table edge."""
    x, z = np.array([0.30, -0.65, 0.70]), np.array([0.9, 0.3, 0.0])
    x /= np.linalg.norm(x)
    z -= x * (x @ z)
    z /= np.linalg.norm(z)
    position = np.array([body.shoulder[0] - 0.02, body.edge + 0.10, -0.16])
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), position)


def come(stage: Choreography, hand: Array, angles: Array, body: PersonBody, frames: int) -> None:
    """Move the empty hand to a pose; from the lap it comes up over the edge of the table."""
    start, end = stage.hand[:3, 3], hand[:3, 3]
    over = 0.5 * (start + end) + [0.0, 0.0, 0.10]
    if start[1] > body.edge:
        over = np.array([start[0], body.edge + 0.05, 0.30])
    stage.swing(frames, over, hand, angles)


def leave(stage: Choreography, angles: Array, body: PersonBody, frames: int) -> None:
    """Take the empty hand back into the lap."""
    over = np.array([body.shoulder[0], body.edge + 0.05, 0.30])
    stage.swing(frames, over, home(body), angles)


def put_back(stage: Choreography, reach: Reach, index: int, pace: Pace) -> None:
    """Return the object to where it was taken from, open the hand and draw it back."""
    stage.carry(pace.task, index, reach.T_table_object, reach.grasp.T_object_hand, rise=0.03)
    stage.close(pace.close, reach.grasp.open_angles)
    stage.move(pace.approach, reach.T_table_pregrasp, reach.grasp.open_angles)


def _close_in_the_air(
    stage: Choreography, taker: Taker, reach: Reach, index: int, pace: Pace
) -> None:
    """Close as far as the table lets the fingers, lift a little and close the rest."""
    grasp = reach.grasp
    way = grasp.angles - grasp.open_angles

    def posture(share: Array) -> Array:
        return np.asarray(grasp.open_angles + np.repeat(share, 4) * way)

    share = free_closing(taker, reach, stage.hand)
    stage.close(max(5, pace.close - 3), posture(share))
    lifted = stage.objects[index].copy()
    lifted[2, 3] += 0.075
    first = stage.frame + 1
    stage.carry(pace.close + 3, index, lifted, grasp.T_object_hand)
    hands = stage.hands_since(first)
    shares = np.array([free_closing(taker, reach, hand) for hand in hands])
    limit = 0.16 * np.arange(1, len(hands) + 1)[:, None] + share
    shares = np.minimum(np.maximum.accumulate(shares), limit)
    stage.set_angles(first, np.array([posture(row) for row in shares]))
    rest = 1.0 - shares[-1]
    if rest.max() > 1e-6:
        first = stage.frame + 1
        frames = int(np.ceil(rest.max() / 0.16))
        stage.carry(frames, index, lifted, grasp.T_object_hand)
        steps = shares[-1] + np.minimum(rest, 0.16 * np.arange(1, frames + 1)[:, None])
        stage.set_angles(first, np.array([posture(row) for row in steps]))


def _perform(
    stage: Choreography, reach: Reach, index: int, task: str, pace: Pace, rng: np.random.Generator
) -> None:
    """Append the lift and the beginning of the task."""
    grip = reach.grasp.T_object_hand
    k = max(2, pace.task // 6)
    vary = rng.uniform(0.85, 1.15) * pace.begun
    deg = np.pi / 180.0

    def go(frames: int, shift: tuple[float, float, float], *turns: tuple[int, float]) -> None:
        target = moved(stage.objects[index], stage.hand, np.array(shift) * vary, turns)
        stage.carry(frames, index, target, grip)

    if task == "pouring":
        go(2 * k, (0.02, -0.02, 0.11))
        go(4 * k, (0.06, -0.02, 0.03), (0, -72.0 * deg * vary))
    elif task == "hand-over":
        go(2 * k, (0.0, -0.02, 0.06))
        go(4 * k, (0.03, -0.14, 0.01))
    elif task == "dish-washing":
        go(2 * k, (-0.02, 0.00, 0.10))
        go(4 * k, (-0.08, 0.00, 0.00), (0, 100.0 * deg * vary))
    else:
        go(2 * k, (0.0, 0.0, 0.08), (0, 60.0 * deg))
        go(k, (0.0, 0.03, 0.04), (2, -28.0 * deg))
        go(k, (0.0, -0.05, -0.05), (2, 50.0 * deg * vary))
        go(k, (0.0, 0.05, 0.05), (2, -45.0 * deg))
        go(k, (0.0, -0.05, -0.05), (2, 45.0 * deg * vary))


def moved(
    T_object: Array, T_hand: Array, shift: Array, turns: tuple[tuple[int, float], ...]
) -> Array:
    """Return the object shifted [m] and turned about the hand's axes through the palm (4, 4)."""
    pivot = T_hand[:3, 3] + 0.07 * T_hand[:3, 0] + 0.03 * T_hand[:3, 2]
    moved = T_object.copy()
    for axis, angle in turns:
        rotation = rotation_from_vector(T_hand[:3, axis] * angle)
        moved = make_pose(rotation, pivot - rotation @ pivot) @ moved
        T_hand = make_pose(rotation, pivot - rotation @ pivot) @ T_hand
    moved[:3, 3] += shift
    return moved
