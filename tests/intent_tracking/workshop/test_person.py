"""The demonstrator of the test bags: a body with laws of its own."""

import subprocess
import sys

import numpy as np
import pytest

from intent_perception.geometry.transforms import inverse, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.workshop.person.acting.approach import approaches, leaves_function_free
from intent_tracking.workshop.person.acting.hand_motion import Choreography, mirrored
from intent_tracking.workshop.person.acting.person_grasp import Grasp, Taker, load_residual
from intent_tracking.workshop.person.body.felt_solid import graspable
from intent_tracking.workshop.person.body.person_hand import (
    LOWER,
    UPPER,
    DemonstratorHand,
    sample_hand,
)
from intent_tracking.workshop.person.body.skin import (
    REST,
    Skin,
    blended_motion,
    make_skin,
    wrist_turn,
)


@pytest.fixture(scope="module")
def hand() -> DemonstratorHand:
    return sample_hand(np.random.default_rng(3))


@pytest.fixture(scope="module")
def skin(hand: DemonstratorHand) -> Skin:
    return make_skin(hand, 0.0035)


def test_a_left_hand_is_the_mirror_image_of_the_right_one() -> None:
    right = sample_hand(np.random.default_rng(5), "right")
    left = sample_hand(np.random.default_rng(5), "left")
    angles = np.random.default_rng(6).uniform(LOWER, UPPER)
    mirror = np.array([1.0, -1.0, 1.0])
    assert np.allclose(left.joint_positions(angles), right.joint_positions(angles) * mirror)


def test_bones_keep_their_length_in_every_posture(hand: DemonstratorHand) -> None:
    rng = np.random.default_rng(1)
    for _ in range(10):
        joints = hand.joint_positions(rng.uniform(LOWER, UPPER))[1:].reshape(5, 4, 3)
        lengths = np.linalg.norm(np.diff(joints, axis=1), axis=2)
        assert np.allclose(lengths, hand.bones)


def test_every_person_differs_from_the_tracked_hand_but_not_by_much() -> None:
    tracked = HandModel().joint_positions(REST)
    for seed in range(5):
        person = sample_hand(np.random.default_rng(seed)).joint_positions(REST)
        distance = np.linalg.norm(person - tracked, axis=1)[1:]
        assert 0.003 < distance.mean() < 0.02


def test_the_tracker_does_not_import_the_demonstrator() -> None:
    code = "import intent_tracking.tracker.tracker, sys; print(*sys.modules)"
    path = ":".join(p for p in sys.path if p)
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": path},
    )
    assert "intent_tracking.tracker.tracker" in done.stdout
    assert "demonstrator" not in done.stdout


def test_the_skin_encloses_its_bones(skin: Skin, hand: DemonstratorHand) -> None:
    assert 3.0e-4 < skin.rest.volume < 16.0e-4
    joints = hand.joint_positions(REST)
    nearest = np.linalg.norm(skin.rest.vertices[:, None] - joints[None], axis=2).min(axis=0)
    tips = [4, 8, 12, 16, 20]
    assert nearest[tips].max() < 0.004
    assert nearest[np.setdiff1d(np.arange(1, 21), tips)].min() > 0.004


def test_a_rigid_motion_of_all_links_moves_the_skin_rigidly() -> None:
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(50, 3))
    weights = rng.uniform(size=(50, 4))
    weights /= weights.sum(axis=1, keepdims=True)
    pose = sample_hand(rng).link_poses(REST)[5]
    moved = blended_motion(vertices, weights, np.tile(pose, (4, 1, 1)))
    assert np.allclose(moved, transform_points(pose, vertices))


def test_the_skin_keeps_its_volume_when_the_fingers_bend(skin: Skin) -> None:
    bent = REST.copy()
    bent[[5, 6, 9, 10, 13, 14, 17, 18]] = 0.8
    mesh = type(skin.rest)(skin.posed(bent), skin.rest.faces)
    assert mesh.volume == pytest.approx(skin.rest.volume, rel=0.04)


def test_the_forearm_points_to_the_elbow(hand: DemonstratorHand) -> None:
    rng = np.random.default_rng(2)
    T_hand = hand.link_poses(REST)[4]
    elbow = T_hand[:3, 3] - 0.25 * T_hand[:3, 0] + rng.normal(0.0, 0.05, 3)
    forearm = T_hand @ hand.link_poses(REST, wrist_turn(T_hand, elbow))[16]
    ahead = (elbow - T_hand[:3, 3]) / np.linalg.norm(elbow - T_hand[:3, 3])
    assert np.allclose(-forearm[:3, 0], ahead)


def test_two_opposed_contacts_hold_and_one_does_not() -> None:
    points = np.array([[0.03, 0, 0], [-0.03, 0, 0]])
    normals = np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    assert load_residual(points, normals) < 1e-6
    assert load_residual(points[:1], normals[:1]) > 0.5


def _grasp(skin: Skin, name: str, task: str) -> tuple[Grasp, Taker]:
    rng = np.random.default_rng(4)
    model = ObjectDatabase.load()[name]
    taker = Taker(skin, graspable(model), rng)
    up = model.stable_poses[0][2, :3]
    for grasp in taker.take(approaches(model, task, up, rng, 60)):
        points = transform_points(grasp.T_object_hand, taker.points(grasp.angles))
        if leaves_function_free(model, task, points):
            return grasp, taker
    raise AssertionError("no grasp")


def test_fingers_close_until_they_touch_and_do_not_sink_in(skin: Skin) -> None:
    grasp, taker = _grasp(skin, "bottle_0", "pouring")
    distances = taker.distances(grasp.angles, grasp.T_object_hand)
    assert -0.0045 < distances.min() < 0.0012
    assert {"thumb", "index"} <= grasp.touching
    assert taker.distances(grasp.open_angles, grasp.T_object_hand).min() > -0.002


def test_grasps_of_one_object_for_two_tasks_are_far_apart(skin: Skin) -> None:
    pour, _ = _grasp(skin, "bottle_0", "pouring")
    give, _ = _grasp(skin, "bottle_0", "hand-over")
    # thumb to the opening while pouring, palm down on it while giving
    assert pour.T_object_hand[2, 1] < -0.7
    assert give.T_object_hand[2, 2] < -0.7


def test_a_mirrored_motion_keeps_objects_in_the_hand() -> None:
    rng = np.random.default_rng(8)
    hand, thing = sample_hand(rng).link_poses(REST)[4], sample_hand(rng).link_poses(REST)[9]
    before = inverse(thing) @ hand
    after = inverse(mirrored(thing[None])[0]) @ mirrored(hand[None])[0]
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    assert np.allclose(after, flip @ before @ flip)
    assert np.linalg.det(after[:3, :3]) == pytest.approx(1.0)


def test_a_carried_object_stays_fixed_in_the_hand_in_spite_of_tremor() -> None:
    rng = np.random.default_rng(9)
    start, target = np.eye(4), np.eye(4)
    target[:3, 3] = [0.1, 0.05, 0.2]
    grip = sample_hand(rng).link_poses(REST)[4]
    stage = Choreography(start @ grip, REST, start[None], rng)
    stage.carry(20, 0, target, grip)
    motion = stage.motion()
    relative = inverse(motion.objects[1:, 0]) @ motion.hands[1:]
    assert np.allclose(relative, grip, atol=1e-9)
    assert not np.allclose(motion.objects[-1, 0], target, atol=1e-5)
