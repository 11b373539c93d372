"""Squares at the ends of an arm that moves."""

import numpy as np
import pytest

from intent_perception.geometry.camera import KINECT
from intent_tracking.hands.hand_square import END_MARGIN
from intent_tracking.hands.moving_arm import ends_of, turns_of, view_of
from intent_tracking.image.moving_depth import MovingThing

DEPTH = 0.8


def arm(start, end, width=40.0):
    """Return an arm between two pixels."""
    start, end = np.array(start, float), np.array(end, float)
    length = np.linalg.norm(end - start)
    along, across = (
        (end - start) / length,
        np.array([start[1] - end[1], end[0] - start[0]]) / length,
    )
    grid = np.mgrid[0:length:4, -0.5 * width : 0.5 * width : 4].reshape(2, -1).T
    pixels = start + grid @ np.stack([along, across])
    return MovingThing(pixels, np.full(len(pixels), DEPTH, np.float32), 0.02)


@pytest.mark.parametrize(("start", "end"), [((0, 240), (300, 240)), ((320, 0), (320, 250)),
                                            ((639, 470), (350, 200))])  # fmt: skip
def test_an_arm_that_reaches_into_the_image_has_its_hand_at_the_inner_end(start, end):
    (square,) = ends_of(arm(start, end), KINECT)
    up = square.rotation @ [0.0, -1.0]
    ahead = np.subtract(end, start) / np.linalg.norm(np.subtract(end, start))
    assert up @ ahead > 0.99
    tip = square.center + (0.5 - END_MARGIN) * square.side * up
    np.testing.assert_allclose(tip, end, atol=8.0)


def test_the_square_has_the_size_of_a_hand_at_the_arms_depth():
    (square,) = ends_of(arm((0, 240), (300, 240)), KINECT)
    assert 0.2 < square.side * DEPTH / KINECT.fx < 0.3


def test_an_arm_within_the_image_may_have_its_hand_at_either_end():
    squares = ends_of(arm((200, 240), (420, 240)), KINECT)
    assert sorted(np.sign(np.sin(square.turn)) for square in squares) == [-1.0, 1.0]


def test_an_arm_across_the_image_has_no_end():
    assert ends_of(arm((0, 240), (639, 240)), KINECT) == []


def test_the_view_holds_the_whole_arm():
    thing = arm((50, 100), (400, 300))
    view = view_of(thing, KINECT)
    assert np.all(np.abs(thing.pixels - view.center) <= 0.5 * view.side)


def test_a_thing_without_an_arm_is_looked_at_in_four_turns_around_its_middle():
    thing = arm((280, 240), (340, 240), 60.0)
    squares = turns_of(thing, KINECT)
    ups = np.array([square.rotation @ [0.0, -1.0] for square in squares])
    np.testing.assert_allclose(ups[0] @ ups.T, [1, 0, -1, 0], atol=1e-9)
    np.testing.assert_allclose(ups[1] @ ups.T, [0, 1, 0, -1], atol=1e-9)
    for square in squares:
        np.testing.assert_allclose(square.center, thing.pixels.mean(axis=0), atol=4.0)
