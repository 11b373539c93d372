"""Comfort of grasps for people around a table."""

import numpy as np

from intent_inference.workshop.simulation.comfort import Comfort
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose


def hand(
    fingers: tuple[float, float, float], palm: tuple[float, float, float], height: float
) -> Array:
    x, z = np.array(fingers), np.array(palm)
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), np.array([0.0, 0.0, height]))


def test_a_level_hand_is_more_comfortable_than_one_with_the_thumb_down() -> None:
    people = Comfort(np.eye(4)[None], np.random.default_rng(0))
    thumb_up = people.of(hand([0.0, -1.0, 0.0], [1.0, 0.0, 0.0], 0.1))
    thumb_down = people.of(hand([0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], 0.1))
    assert 0.0 < thumb_down < thumb_up <= 1.0


def test_nobody_grasps_through_the_table() -> None:
    people = Comfort(np.eye(4)[None], np.random.default_rng(0))
    assert people.of(hand([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], -0.1)) == 0.0
