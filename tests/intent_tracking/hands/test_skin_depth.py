import numpy as np
from tests.support.hand_films import HANDS
from tests.support.read_hands import random_hand, read_hand, skin_frame

from intent_perception.geometry.camera import KINECT
from intent_tracking.hands.key_point_start import starts_from_key_points
from intent_tracking.hands.skin_depth import (
    hand_mask,
    measured_depth,
    palm_depths,
    skin_depth,
    with_bones,
)


def measured_and_relative(frame, points):
    middle = points[[0, 5, 9, 13, 17]].mean(axis=0)
    measured = measured_depth(frame.depth, with_bones(KINECT.project(points)), 2)
    return measured, with_bones(points - middle)[:, 2], middle[2]


def test_palm_is_as_deep_as_its_skin():
    points, _ = read_hand("right", random_hand(0))
    measured, relative, truth = measured_and_relative(skin_frame(points, thickness=0.0), points)
    (palm,) = palm_depths(measured, relative, 0.7)
    assert abs(palm - truth) < 0.01
    depth = skin_depth(measured, relative, palm)
    known = depth > 0
    assert known.mean() > 0.9
    assert np.median(np.abs(depth - with_bones(points)[:, 2])[known]) < 0.005


def test_wall_behind_fingers_is_no_skin():
    points, _ = read_hand("right", random_hand(0))
    frame = skin_frame(points, without=[8, 12, 28, 32], behind=0.2)
    measured, relative, _ = measured_and_relative(frame, points)
    depth = skin_depth(measured, relative, palm_depths(measured, relative, 0.7)[0])
    assert np.all(np.abs(depth - frame.depth.max()) > 0.05)


def test_palm_without_depth_of_its_own_leaves_two_depths_to_try():
    points, _ = read_hand("right", random_hand(0))
    palm_and_middle = [0, 5, 9, 13, 17, 9, 10, 13, 14, 21, 25, 29, 30, 33, 34, 37, 38]
    frame = skin_frame(points, palm_and_middle, behind=0.1, thickness=0.0)
    measured, relative, truth = measured_and_relative(frame, points)
    assert min(abs(palm - truth) for palm in palm_depths(measured, relative, truth)) < 0.015


def test_no_measurement_leaves_the_depth_of_the_size():
    assert palm_depths(np.zeros(41), np.zeros(41), by_size=0.66) == [0.66]


def test_measured_depth_is_unknown_outside_the_image():
    depth = np.ones((48, 64), np.float32)
    pixels = np.array([[10.0, 10.0], [-20.0, 10.0], [1e4, 1e4], [65.0, 20.0]])
    np.testing.assert_array_equal(measured_depth(depth, pixels, 2), [1, 0, 0, 1])


def test_mask_shows_only_skin_and_not_little_of_it():
    for seed in range(5):
        points, seen = read_hand("right", random_hand(seed))
        frame = skin_frame(points, behind=0.3)
        start = starts_from_key_points(seen, frame, HANDS)[0]
        mask = hand_mask(frame.depth, seen.pixels, start.depth)
        skin = frame.depth < frame.depth.max()
        assert mask.sum() > 0.1 * skin.sum()
        assert np.all(skin[mask])
