import numpy as np
import pytest

from intent_tracking.scene.hand_model import FINGERS, JOINT_NAMES, LANDMARK_NAMES, LIMITS, HandModel
from intent_tracking.scene.joint_table import link_poses

FLEXED = np.radians([0, 0, 0, 0] + [0, 60, 60, 40] * 4)


def landmark(points, name):
    return points[LANDMARK_NAMES.index(name)]


def test_fingers_point_along_x_and_the_thumb_lies_at_minus_y_of_a_right_hand():
    points = HandModel().joint_positions(np.zeros(20))
    for finger in FINGERS[1:]:
        bone = landmark(points, f"{finger}_tip") - landmark(points, f"{finger}_mcp")
        np.testing.assert_allclose(bone / np.linalg.norm(bone), [1, 0, 0], atol=1e-12)
    knuckles = [landmark(points, f"{finger}_mcp")[1] for finger in FINGERS[1:]]
    assert np.all(np.diff(knuckles) > 0.02)
    assert landmark(points, "thumb_tip")[1] < knuckles[0]
    np.testing.assert_allclose(landmark(points, "middle_mcp")[1:], 0.0, atol=1e-12)
    np.testing.assert_array_equal(landmark(points, "wrist"), 0.0)


def test_flexion_closes_towards_the_palm():
    points = HandModel().joint_positions(np.stack([np.zeros(20), FLEXED]))
    for finger in FINGERS[1:]:
        tip = LANDMARK_NAMES.index(f"{finger}_tip")
        assert points[1, tip, 2] > points[0, tip, 2] + 0.03


def test_positive_abduction_turns_towards_the_thumb():
    joints = np.zeros(20)
    joints[4::4] = np.radians(10)
    points = HandModel().joint_positions(np.stack([np.zeros(20), joints]))
    tips = [LANDMARK_NAMES.index(f"{finger}_tip") for finger in FINGERS[1:]]
    assert np.all(points[1, tips, 1] < points[0, tips, 1] - 0.01)


def test_bone_lengths_are_those_of_graspit():
    points = HandModel().joint_positions(FLEXED)
    lengths = np.linalg.norm(np.diff(points[5:9], axis=0), axis=1)
    np.testing.assert_allclose(lengths, [0.04319, 0.02956, 0.02535], atol=1e-9)
    thumb = np.linalg.norm(np.diff(points[1:4], axis=0), axis=1)
    np.testing.assert_allclose(thumb, [0.05212, 0.04076], atol=1e-9)


def test_the_thumb_can_touch_every_fingertip_within_the_limits():
    rng = np.random.default_rng(0)
    joints = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (20000, 20))
    points = HandModel().joint_positions(joints)
    for finger in FINGERS[1:]:
        tip = points[:, LANDMARK_NAMES.index(f"{finger}_tip")]
        assert np.linalg.norm(tip - points[:, 4], axis=1).min() < 0.02


def test_the_left_hand_is_the_mirror_image():
    rng = np.random.default_rng(1)
    joints = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (16, 20))
    right = HandModel("right").joint_positions(joints)
    left = HandModel("left").joint_positions(joints)
    np.testing.assert_allclose(left, right * [1, -1, 1], atol=1e-12)


def test_left_links_are_proper_rotations():
    rotations = link_poses(HandModel("left").table, FLEXED)[0, :, :3, :3]
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-9)


def test_scale_multiplies_every_length():
    small, large = HandModel(), HandModel(scale=1.25)
    np.testing.assert_allclose(
        large.joint_positions(FLEXED), 1.25 * small.joint_positions(FLEXED), atol=1e-12
    )
    np.testing.assert_allclose(large.capsules(FLEXED)[0], 1.25 * small.capsules(FLEXED)[0])
    np.testing.assert_allclose(large.capsules(FLEXED)[1], 1.25 * small.capsules(FLEXED)[1])


def test_the_shape_vector_restores_the_hand():
    bones = np.random.default_rng(2).uniform(0.9, 1.1, (5, 4))
    model = HandModel("left", 1.1, bones, 0.95)
    again = HandModel.from_shape("left", model.shape)
    np.testing.assert_array_equal(again.joint_positions(FLEXED), model.joint_positions(FLEXED))


def test_fingertips_lie_on_the_skin():
    ends, radii = HandModel().capsules(FLEXED)
    points = HandModel().joint_positions(FLEXED)
    for finger in range(5):
        gap = np.linalg.norm(points[4 * finger + 4] - ends[3 * finger + 2, 1])
        assert gap == pytest.approx(radii[3 * finger + 2])


def test_joint_names_follow_the_contract():
    assert JOINT_NAMES[:5] == (
        "thumb_abduction",
        "thumb_mcp",
        "thumb_pip",
        "thumb_dip",
        "index_abduction",
    )
    assert len(JOINT_NAMES) == 20
    assert LIMITS.shape == (20, 2)
