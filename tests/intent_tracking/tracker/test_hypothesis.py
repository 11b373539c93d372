"""Which hand it is, from the turn of the hand about its forearm."""

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import rotation_from_vector
from intent_tracking.scene.hand_model import Side
from intent_tracking.tracker.hypotheses.hypothesis import unusual_roll

PALM_DOWN = np.diag([1.0, -1.0, -1.0])
"""Fingers along x of the table, z of the hand (out of the palm) down."""


def _rolled(side: Side, degrees: float) -> Array:
    """Return a hand with the palm down, turned about its fingers with the thumb going up."""
    sense = 1.0 if side == "right" else -1.0
    turned: Array = PALM_DOWN @ rotation_from_vector(
        np.array([sense * np.radians(degrees), 0.0, 0.0])
    )
    return turned


@pytest.mark.parametrize("side", ["right", "left"])
def test_palm_down_and_thumb_up_are_usual_palm_up_and_thumb_down_are_not(side: Side) -> None:
    roll = {angle: unusual_roll(side, _rolled(side, angle)) for angle in (-90, 0, 40, 90, 180)}
    assert roll[40] == pytest.approx(0.0, abs=1e-9)
    assert max(roll[0], roll[90]) < 0.2
    assert min(roll[-90], roll[180]) > 0.8


def test_what_looks_like_a_usual_hand_but_is_one_of_the_other_side_is_less_usual() -> None:
    usual = _rolled("right", 40)
    thumb_for_little_finger, back_for_palm = usual, usual @ np.diag([1.0, -1.0, -1.0])
    for other in (thumb_for_little_finger, back_for_palm):
        assert unusual_roll("left", other) > unusual_roll("right", usual) + 0.3


def test_a_hand_that_points_down_speaks_for_neither_side() -> None:
    down = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert unusual_roll("right", down) == pytest.approx(unusual_roll("left", down))
