"""A hand that moves about without an object: comes, poses, points, and leaves."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.workshop.person.acting.hand_motion import Choreography, mirrored
from intent_tracking.workshop.person.acting.person_grasp import OPEN
from intent_tracking.workshop.person.acting.script import Script
from intent_tracking.workshop.person.acting.task_moves import come, home, leave
from intent_tracking.workshop.person.body.person_arm import PersonBody
from intent_tracking.workshop.person.body.person_hand import LOWER, UPPER
from intent_tracking.workshop.person.body.skin import wrist_turn

_POSTURES = np.radians([
    [16, -20, 8, 8] + [0, 8, 10, 6] * 4,
    [45, -5, 25, 30] + [0, 75, 90, 55] * 4,
    [50, 0, 25, 30, 0, 5, 5, 3] + [0, 75, 92, 55] * 3,
    [30, -25, 10, 35, 0, 45, 40, 25] + [0, 20, 20, 12] * 3,
    [0, -35, 5, 0, 14, 4, 4, 2, 3, 4, 4, 2, -9, 4, 4, 2, -16, 4, 4, 2],
    [50, 0, 25, 30, 8, 4, 6, 3, -6, 4, 6, 3] + [0, 75, 92, 55] * 2,
    [30, -20, 15, 15] + [0, 45, 45, 30] * 4,
])  # fmt: skip
"""Relaxed, fist, pointing, pinch, spread, two fingers, claw: (7, 20) [rad]."""


def improvise(
    body: PersonBody, side: str, edge: float, hide: bool, rng: np.random.Generator
) -> Script:
    """Return about 70 frames of gestures over an empty table.

    Args:
        body: the person.
        side: hand of the person.
        edge: y of the table edge [m].
        hide: whether the hand goes back below the table's edge in between.
        rng: source of the gestures.
    """
    stage = Choreography(home(body), OPEN["power"], np.zeros((0, 4, 4)), rng)
    stage.wait(7)
    order = rng.permutation(len(_POSTURES))
    come(stage, _hover(body, rng), _posture(order[0], rng), body, 18)
    stage.move(9, _hover(body, rng), _posture(order[1], rng))
    if hide:
        leave(stage, OPEN["power"], body, 14)
        stage.wait(3)
        come(stage, _hover(body, rng), _posture(order[2], rng), body, 16)
    for number in order[3:5] if hide else order[2:6]:
        stage.move(9, _hover(body, rng), _posture(number, rng))
    motion = stage.motion(rng.uniform(0.7, 1.3))
    elbows, shoulders = body.arms(motion.hands)
    wrists = np.array([wrist_turn(T, e) for T, e in zip(motion.hands, elbows, strict=True)])
    hands = motion.hands
    if side == "left":
        hands, swap = mirrored(hands), np.array([-1.0, 1.0, 1.0])
        elbows, shoulders = elbows * swap, shoulders * swap
    return Script(
        hands, motion.angles, wrists, elbows, shoulders, motion.objects, (), edge, (), (),
        np.zeros((0, 4, 4)), (),
    )  # fmt: skip


def _posture(number: int, rng: np.random.Generator) -> Array:
    posture: Array = np.clip(_POSTURES[number] + rng.normal(0.0, 0.08, 20), LOWER, UPPER)
    return posture


def _hover(body: PersonBody, rng: np.random.Generator) -> Array:
    """Return a comfortable pose (4, 4) of the right hand over the middle of the table."""
    best, least = np.eye(4), np.inf
    for _ in range(40):
        ahead = np.array([rng.normal(0.25, 0.45), -1.0, rng.normal(0.0, 0.35)])
        ahead /= np.linalg.norm(ahead)
        palm = rotation_from_vector(ahead * rng.uniform(-0.6, 1.9)) @ [0.0, 0.0, -1.0]
        palm -= ahead * (palm @ ahead)
        palm /= np.linalg.norm(palm)
        place = np.array(
            [rng.uniform(-0.16, 0.08), rng.uniform(0.06, 0.16), rng.uniform(0.09, 0.2)]
        )
        pose = make_pose(np.stack([ahead, np.cross(palm, ahead), palm], axis=1), place)
        awkward = body.awkwardness(pose)
        if awkward < least:
            best, least = pose, awkward
        if least < 3.0:
            break
    return best
