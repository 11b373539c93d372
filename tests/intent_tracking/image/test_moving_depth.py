"""What has come in front of what stands still."""

import numpy as np
import pytest

from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_tracking.image.moving_depth import MovingDepth

WALL, NEAR = 0.9, 0.7
PLACE = slice(200, 280), slice(300, 400)
INSIDE, BESIDE = np.array([[350.0, 240.0]]), np.array([[100.0, 240.0]])


def frame(depth=None):
    """Return a frame of a wall, with something before it at a depth."""
    image = np.full((480, 640), WALL, np.float32)
    if depth is not None:
        image[PLACE] = depth
    return RgbdFrame(0, np.zeros((480, 640, 3), np.uint8), image, KINECT)


@pytest.fixture
def moving():
    moving = MovingDepth()
    moving.note(frame())
    return moving


def test_nothing_moves_in_the_first_frame_and_in_a_still_scene():
    moving = MovingDepth()
    for _ in range(3):
        moving.note(frame(NEAR))
        assert moving.things() == []


def test_what_comes_in_front_moves_and_the_rest_does_not(moving):
    moving.note(frame(NEAR))
    assert moving.share(INSIDE) == 1.0
    assert moving.share(BESIDE) == 0.0


def test_a_thing_that_moves_has_its_place_depth_and_surface(moving):
    moving.note(frame(NEAR))
    (thing,) = moving.things()
    np.testing.assert_allclose(thing.pixels.mean(axis=0), INSIDE[0], atol=4.0)
    assert np.all(thing.depth == np.float32(NEAR))
    assert thing.area == pytest.approx(80 * 100 * (NEAR / KINECT.fx) ** 2, rel=0.1)


def test_noise_and_swaying_do_not_move(moving):
    moving.note(frame(WALL - 0.02))
    assert moving.things() == []


def test_what_is_revealed_stands_still_and_what_covers_it_again_moves():
    moving = MovingDepth()
    moving.note(frame(NEAR))
    moving.note(frame())
    assert moving.things() == []
    moving.note(frame(NEAR))
    assert moving.share(INSIDE) == 1.0


def test_what_stays_is_taken_for_still_by_and_by(moving):
    for _ in range(20):
        moving.note(frame(WALL - 0.06))
    assert moving.things() == []


def test_something_moves_where_nothing_was_measured_before():
    moving = MovingDepth()
    moving.note(frame(0.0))
    moving.note(frame(NEAR))
    assert moving.share(INSIDE) == 1.0
