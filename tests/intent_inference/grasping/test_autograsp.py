"""Hands as tables, URDF and spheres agree; closing a hand neither penetrates nor misses."""

import numpy as np
import pytest

from intent_inference.grasping.autograsp import Fate, close_hand, hand_spheres
from intent_inference.grasping.contacts import (
    Contacts,
    gravity_residual,
    holding_force,
    opposed,
    touching,
)
from intent_inference.grasping.grasp_candidates import CandidateSource
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis, approaches, rim_approaches
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.grasping.urdf import table_from_urdf, urdf_text
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.scene.joint_table import link_poses, placed_capsules


@pytest.fixture(scope="module")
def database():
    return ObjectDatabase.load()


@pytest.fixture(scope="module", params=["human", "schunk"])
def hand(request):
    return GraspingHand.load(request.param)


def posture(hand, share):
    limits = hand.table.limits
    return limits[:, 0] + share * (limits[:, 1] - limits[:, 0])


def test_a_urdf_written_and_read_has_the_same_kinematics(hand, tmp_path):
    (tmp_path / "hand.urdf").write_text(urdf_text(hand.table, hand.effort))
    table = table_from_urdf(tmp_path / "hand.urdf")
    joints = posture(hand, 0.7)
    drivers = [f"joint_{k}" for k, d in enumerate(hand.table.drivers) if d >= 0]
    angles = [hand.table.ratios[k] * joints[d] for k, d in enumerate(hand.table.drivers) if d >= 0]
    order = [drivers.index(name) for name in table.joint_names]
    read = link_poses(table, np.array(angles)[order])[0]
    written = link_poses(hand.table, joints)[0]
    kept = [k for k, name in enumerate(hand.table.link_names) if name in table.link_names]
    places = [table.link_names.index(hand.table.link_names[k]) for k in kept]
    assert len(kept) >= len(hand.table.link_names) - 1  # the Schunk's thumb stands on the palm
    np.testing.assert_allclose(read[places], written[kept], atol=1e-5)


def test_a_mesh_that_is_not_there_is_named(tmp_path):
    (tmp_path / "x.urdf").write_text(
        '<robot name="x"><link name="palm"><collision><geometry><mesh filename="a.stl"/>'
        "</geometry></collision></link></robot>"
    )
    with pytest.raises(ValueError, match=r"the mesh a\.stl was not found"):
        table_from_urdf(tmp_path / "x.urdf")


def test_an_unknown_hand_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="human"):
        GraspingHand.load("tentacle")


def test_the_spheres_of_the_kernel_lie_in_the_capsules_of_the_table(hand):
    joints = posture(hand, 0.6)
    spheres = hand_spheres(hand, np.eye(4), joints)
    ends = placed_capsules(hand.table, joints)[0]
    for capsule, link in enumerate(hand.table.capsules.links):
        start, axis = ends[capsule, 0], ends[capsule, 1] - ends[capsule, 0]
        members = spheres[hand.arrays.sphere_links == link]
        share = np.clip((members - start) @ axis / (axis @ axis), 0, 1)
        gap = np.linalg.norm(members - start - share[:, None] * axis, axis=1)
        assert gap.min() < 1e-5


def test_candidates_touch_oppose_and_hardly_penetrate(hand, database):
    target = TaskObject(database["bottle_1"])
    source = CandidateSource(target, hand, np.random.default_rng(0))
    found = source.take(5, 2000)
    assert len(found) == 5
    for candidate in found:
        assert candidate.grasp.clearance.min() > -0.003
        assert opposed(hand, candidate.contacts)
        assert candidate.residual <= source.filter.residual


def test_a_hand_that_approaches_beside_the_object_misses(hand, database):
    target = TaskObject(database["glass_0"])
    pose = np.eye(4)
    pose[:3, 3] = [0.5, 0.5, 0.0]
    preshape = hand.preshapes[0]
    hypothesis = GraspHypothesis(
        "power", pose, np.array([0.0, 0.0, 1.0]), 0.2, preshape.open, preshape.rates
    )
    assert close_hand(hand, target.field, hypothesis) == (Fate.MISSED, None)


def test_distal_joints_follow_the_middle_ones(database):
    hand = GraspingHand.load("human")
    source = CandidateSource(TaskObject(database["bottle_1"]), hand, np.random.default_rng(1))
    for candidate in source.take(5, 2000):
        fingers = candidate.grasp.joints.reshape(5, 4)[1:]
        assert np.all(fingers[:, 3] <= fingers[:, 2] * 2 / 3 + np.radians(16.0))


def test_no_approach_is_wider_than_its_preshape_spans(hand, database):
    boxes = TaskObject(database["mug_0"]).geometry.boxes
    for choice in approaches(boxes, hand):
        width = 2.0 * np.abs(choice.closing @ choice.box.rotation) @ choice.box.half_size
        assert width <= choice.preshape.widest + 1e-9


def test_only_the_handle_of_a_mug_is_hooked(database):
    hand = GraspingHand.load("human")
    for name, hooked in (("mug_0", True), ("glass_0", False), ("hammer_0", False)):
        target = TaskObject(database[name])
        assert any(target.is_loop(box) for box in target.geometry.boxes) == hooked
        source = CandidateSource(target, hand, np.random.default_rng(0))
        drawn = {source.sampler.draw()[1].preshape for _ in range(400)}
        assert ("hook" in drawn) == hooked


def test_a_tool_is_on_its_handle_where_the_handle_is_nearest(database):
    target = TaskObject(database["hammer_0"])
    handle = np.isin(target.part_names(target.geometry.points), target.model.functions.handle)
    low, high = target.geometry.points[handle][0], target.functional_points[0]
    assert target.on_handle(low)
    assert not target.on_handle(high)


def test_rims_are_pinched_through_the_wall_from_above(database):
    opening = database["mug_0"].functions.opening
    found = rim_approaches(opening, GraspingHand.load("human"))
    assert found
    for approach in found:
        assert approach.closing @ opening.normal == pytest.approx(0.0, abs=1e-9)
        lateral = approach.box.center - opening.center
        lateral -= (lateral @ opening.normal) * opening.normal
        assert np.linalg.norm(lateral) == pytest.approx(opening.radius)
    assert not rim_approaches(opening, GraspingHand.load("schunk"))


def pinch(friction_height=0.0):
    return Contacts(
        np.array([[-0.02, 0.0, friction_height], [0.02, 0.0, friction_height]]),
        np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]),
        np.array([1, 2]),
        np.ones(2),
    )


def test_a_pinch_holds_a_weight_by_friction_with_the_force_of_coulombs_law():
    wrench = np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])
    force = holding_force(pinch(), wrench, np.zeros(3), 0.5)
    assert force == pytest.approx(
        2.0 / 0.5, rel=0.16
    )  # a cone of six edges inscribes the round one


def test_nothing_holds_a_weight_from_one_side():
    one = Contacts(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), np.array([1]), np.ones(1))
    assert holding_force(one, np.array([1.0, 0, 0, 0, 0, 0]), np.zeros(3), 0.5) == float("inf")
    assert gravity_residual(one, np.zeros(3), 0.05, 0.8, 1.0) == 1.0


def test_a_pinch_far_from_the_centre_of_mass_cannot_hold():
    assert gravity_residual(pinch(), np.zeros(3), 0.05, 0.8, 1.0) < 0.01
    assert gravity_residual(pinch(0.2), np.zeros(3), 0.05, 0.8, 10.0) > 0.1


def test_contacts_lie_on_the_surface(hand, database):
    target = TaskObject(database["bottle_1"])
    candidate = CandidateSource(target, hand, np.random.default_rng(2)).take(1, 2000)[0]
    contacts = touching(hand, target.field, candidate.grasp.spheres, candidate.grasp.clearance)
    np.testing.assert_allclose(target.field.distance(contacts.points), 0.0, atol=0.002)
