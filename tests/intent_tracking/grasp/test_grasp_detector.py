"""The stable grasp is found once, at the right object, and not while the hand only passes."""

import numpy as np
import pytest

from intent_perception.geometry.transforms import inverse, pose_from_vector, vector_from_pose
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_detector import GraspConfig, GraspDetector
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.scene_state import SceneState

FRAME = 33_333_333
OPEN = np.radians([-4, -45, 0, 0] + [0, 2, 8, 5] * 4)
CLOSED = np.radians([-4, -12, 35, 30] + [0, 52, 55, 37] * 4)
T_OBJECT_HAND = pose_from_vector([-0.095, -0.045, 0.02, -np.pi / 2, 0.0, 0.0])


@pytest.fixture(scope="module")
def database():
    return ObjectDatabase.load()


def state(k, closing, distance=0.0, side="right", lost=False):
    """Return a scene whose hand closes on glass_0 (closing 0..1), `distance` away along -y."""
    T_table_object = pose_from_vector([0.1, 0.2, 0.06, 0.0, 0.0, 0.3])
    pose = T_OBJECT_HAND.copy()
    pose[1, 3] -= distance
    if side == "left":
        flip = np.diag([1.0, -1.0, 1.0, 1.0])
        pose = flip @ pose @ flip
    hand = np.concatenate(
        [vector_from_pose(T_table_object @ pose), OPEN + closing * (CLOSED - OPEN)]
    )
    if lost:
        hand[:] = np.nan
    values = np.concatenate([hand, vector_from_pose(T_table_object)])
    return SceneState(
        k * FRAME, side, values, np.full(32, 0.003), HandModel().shape, ("glass_0",),
        ("glass_0",), ("glass",), np.eye(4), 0.0, not lost, lost, (False,),
    )  # fmt: skip


def grasps(database, states):
    detector = GraspDetector(database)
    return [grasp for grasp in map(detector.step, states) if grasp is not None]


def reach_and_hold(first, side="right"):
    reach = [state(first + k, 0.0, 0.15 * (1 - k / 20), side) for k in range(20)]
    close = [state(first + 20 + k, k / 10, 0.0, side) for k in range(10)]
    return reach + close + [state(first + 30 + k, 1.0, 0.0, side) for k in range(20)]


def test_a_grasp_is_reported_once_soon_after_the_hand_has_closed(database):
    found = grasps(database, reach_and_hold(0))
    assert len(found) == 1
    assert 26 * FRAME <= found[0].stamp <= 40 * FRAME
    assert found[0].object_id == "glass_0"


def test_the_reported_pose_is_that_of_the_track(database):
    found = grasps(database, reach_and_hold(0))
    np.testing.assert_allclose(found[0].T_object_hand, T_OBJECT_HAND, atol=1e-6)


def test_a_second_grasp_is_reported_after_the_first_was_released(database):
    away = [state(50 + k, 0.0, 0.15) for k in range(20)]
    assert len(grasps(database, reach_and_hold(0) + away + reach_and_hold(70))) == 2


def test_a_hand_that_pauses_beside_the_object_does_not_grasp(database):
    assert grasps(database, [state(k, 0.0, 0.05) for k in range(40)]) == []


def flickering(share):
    """Return states of a still pinch whose thumb is tracked right in a share of the frames."""
    held = [state(k, 1.0, 0.03) for k in range(20)]
    for k, one in enumerate(held):
        one.state[6 + 12 : 26] = OPEN[12:]  # thumb, index and middle finger hold alone
        if (k * share) % 1.0 >= share - 1e-9:
            one.state[6:10] = OPEN[:4]
    return held


@pytest.mark.parametrize(("share", "count"), [(0.75, 1), (0.25, 0)])
def test_a_thumb_may_flicker_but_must_mostly_touch(database, share, count):
    assert len(grasps(database, flickering(share))) == count


def test_a_hand_that_passes_by_does_not_grasp(database):
    assert grasps(database, [state(k, 0.3, 0.4 - 0.02 * k) for k in range(40)]) == []


def test_a_lost_hand_grasps_nothing(database):
    assert grasps(database, [state(k, 1.0, lost=True) for k in range(40)]) == []


def test_a_left_hand_gives_the_features_of_the_mirrored_right_hand(database):
    held = {side: [state(k, 1.0, side=side) for k in range(20)] for side in ("right", "left")}
    right, left = (grasps(database, held[side])[0].features for side in ("right", "left"))
    for name in ("dir", "npos", "fcon"):
        np.testing.assert_allclose(getattr(left, name), getattr(right, name), atol=1e-5)
    assert left.fvol[0] == pytest.approx(right.fvol[0], abs=0.03)


def test_deviations_have_the_shape_of_the_features_and_grow_with_the_tracks(database):
    found = grasps(database, reach_and_hold(0))[0]
    assert found.std.dir.shape == (4,)
    assert found.std.fcon.shape == (20,)
    np.testing.assert_allclose(found.std.fcon, 0.003, rtol=0.9)


def test_an_object_outside_the_database_is_passed_over(database):
    few = ObjectDatabase((database["mug_0"],))
    assert grasps(few, reach_and_hold(0)) == []


def test_thresholds_of_zero_are_refused():
    with pytest.raises(ValueError, match="expected window"):
        GraspConfig(window=0.0)


def test_the_scene_helper_is_consistent():
    scene = state(0, 1.0)
    relative = inverse(scene.T_table_objects[0]) @ scene.T_table_hand
    np.testing.assert_allclose(relative, T_OBJECT_HAND, atol=1e-9)


@pytest.mark.parametrize("odd", [0, 10**6], ids=["long ago", "far in the future"])
@pytest.mark.parametrize("place", [10, 30, 33])
def test_one_odd_stamp_does_not_lose_a_grasp_in_progress(database, odd, place):
    states = reach_and_hold(1000)
    states.insert(place, state(odd, 1.0))
    found = grasps(database, states)
    assert len(found) == 1
    assert 1026 * FRAME <= found[0].stamp <= 1045 * FRAME
