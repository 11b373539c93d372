"""Small depth images of a posed hand and of the tile that it is compared with."""

import numpy as np

from intent_tracking.fit.objective import (
    FORTH_PENETRATION_WEIGHT,
    KINEMATIC_WEIGHT,
    draw_objects,
    finger_crossing,
    forth_cost,
    forth_sums,
    penetration,
)
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand, turn
from intent_tracking.scene.hand_model import LIMITS, HandModel
from intent_tracking.scene.raster import FAR, draw_capsule

SIZE = 64
ORIGIN, STEP = np.float32(-0.18), np.float32(0.36 / SIZE)


def pose(seed):
    rng = np.random.default_rng(seed)
    state = np.zeros(26, np.float32)
    state[:3] = [-0.05, 0.0, 0.7]
    state[6:] = rng.uniform(LIMITS[:, 0], LIMITS[:, 1])
    rotation = np.zeros((3, 3), np.float32)
    turn(*rng.normal(0, 1, 3).astype(np.float32), np.eye(3, dtype=np.float32), rotation)
    return state, rotation


def drawn_hand(state, rotation, size=SIZE, step=STEP):
    arrays, buffers = hand_arrays(HandModel()), hand_buffers()
    place_hand(arrays, state, rotation, buffers)
    depth = np.full((size, size), FAR)
    for i, radius in enumerate(arrays.radii):
        draw_capsule(buffers.ends, i, radius, depth, ORIGIN, ORIGIN, step)
    return depth, buffers, arrays


def random_tile():
    """Depths and labels drawn pixel by pixel."""
    rng = np.random.default_rng(4)
    depth = rng.choice([0.0, 0.66, 0.7, 1.2], (SIZE, SIZE)).astype(np.float32)
    label = rng.integers(0, 3, (SIZE, SIZE))
    ones = np.ones((SIZE, SIZE), np.float32)
    hand, thing = (label == 1).astype(np.float32), (label == 2).astype(np.float32)
    return Labelled(depth, hand, thing, ones, ones, ORIGIN, ORIGIN, STEP)


def mug_states(count):
    """States (count, 32) of a hand next to an object."""
    rng = np.random.default_rng(5)
    states = np.zeros((count, 32), np.float32)
    states[:, :26] = pose(2)[0] + rng.normal(0, 0.02, (count, 26))
    states[:, 26:29] = [0.03, 0.0, 0.68]
    states[:, 26:] += rng.normal(0, 0.02, (count, 6))
    return states


def whole_cost(objects, seen, state):
    """E of a state, computed on the whole tile."""
    rotations = np.tile(np.eye(3, dtype=np.float32), (2, 1, 1))
    for body, offset in enumerate((3, 29)):
        turn(*state[offset : offset + 3], np.eye(3, dtype=np.float32), rotations[body])
    hand_depth, buffers, arrays = drawn_hand(state, rotations[0])
    thing_depth, work = np.full((SIZE, SIZE), FAR), np.empty((len(objects.vertices), 3), np.float32)
    draw_objects(objects, state, rotations, seen, thing_depth, work)
    cost = forth_cost(forth_sums(hand_depth, thing_depth, seen, 0, SIZE, 0, SIZE))
    gradient = np.empty(3, np.float32)
    inside = penetration(arrays, buffers, objects, state, rotations, 0, 24, gradient)
    return cost + KINEMATIC_WEIGHT * finger_crossing(state) + FORTH_PENETRATION_WEIGHT * inside
