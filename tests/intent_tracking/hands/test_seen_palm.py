"""The palm of a tracked hand in the image, and a guess moved to where it is seen."""

import numpy as np
import pytest
from tests.support.read_hands import joints_of, random_hand

from intent_perception.geometry.camera import KINECT
from intent_tracking.hands.seen_hand import PALM
from intent_tracking.hands.seen_palm import nudged, palm_pixel, pixels_of
from intent_tracking.image.frame_evidence import NO_KEYS, KeyEvidence


def keys_beside(joints, shift):
    """Return key points of joints seen shifted (2,) across their rays [m]."""
    rays = (joints[:, :2] + shift) / joints[:, 2:]
    return KeyEvidence(rays.astype(np.float32), np.ones(21, np.float32), NO_KEYS.offsets)


def test_pixels_are_those_of_the_camera():
    points = np.random.default_rng(0).uniform([-0.4, -0.3, 0.3], [0.4, 0.3, 1.5], (50, 3))
    np.testing.assert_allclose(pixels_of(KINECT, points), KINECT.project(points), atol=1e-9)


def test_points_at_the_camera_have_finite_pixels():
    assert np.isfinite(pixels_of(KINECT, np.array([[0.1, 0.1, 0.0], [0.1, 0.1, -1.0]]))).all()


def test_the_palm_is_seen_where_its_middle_projects():
    joints = joints_of("right", random_hand(1))
    expected = KINECT.project(joints[PALM].mean(axis=0))
    np.testing.assert_allclose(palm_pixel(KINECT, joints), expected, atol=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_a_guess_is_moved_onto_the_rays_of_its_palm(seed):
    guess = random_hand(seed)
    joints, shift = joints_of("right", guess), np.array([0.03, -0.02])
    moved = nudged(guess, joints, keys_beside(joints, shift))
    np.testing.assert_allclose(moved.values[:2] - guess.values[:2], shift, atol=1e-6)
    np.testing.assert_array_equal(moved.values[2:], guess.values[2:])
    np.testing.assert_array_equal(moved.rotations, guess.rotations)


def test_a_moved_guess_leaves_the_one_it_came_from_alone():
    guess = random_hand(0)
    before, joints = guess.values.copy(), joints_of("right", guess)
    nudged(guess, joints, keys_beside(joints, np.array([0.05, 0.0])))
    np.testing.assert_array_equal(guess.values, before)


def test_a_palm_seen_about_where_it_is_expected_moves_nothing():
    guess = random_hand(2)
    joints = joints_of("right", guess)
    assert nudged(guess, joints, keys_beside(joints, np.array([0.005, 0.004]))) is guess


def test_without_key_points_a_guess_stays():
    guess = random_hand(2)
    assert nudged(guess, joints_of("right", guess), NO_KEYS) is guess
