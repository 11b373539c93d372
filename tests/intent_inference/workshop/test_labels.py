"""A grasp with a known answer for each rule, and refusals with their reason."""

from dataclasses import replace

import numpy as np
import pytest

from intent_inference.grasping.autograsp import close_hand
from intent_inference.grasping.contacts import Contacts, touching
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.labels import TASKS, label_grasp
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.database import ObjectDatabase


@pytest.fixture(scope="module")
def targets():
    database = ObjectDatabase.load()
    names = ("glass_0", "mug_0", "bottle_0", "knife_0", "hammer_0", "screwdriver_0")
    return {name: TaskObject(database[name]) for name in names}


@pytest.fixture(scope="module")
def hand():
    return GraspingHand.load("human")


def fist(hand, target, approach, thumb, at, shape=0):
    """Close the hand that comes along `approach` with its thumb side towards `thumb`."""
    preshape = hand.preshapes[shape]
    z, y = np.array(approach, float), -np.array(thumb, float)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(y, z), y, z], axis=1)
    start = np.array(at, float) - 0.25 * z
    pose[:3, 3] = start - pose[:3, :3] @ preshape.center
    hypothesis = GraspHypothesis("power", pose, z, 0.4, preshape.open, preshape.rates)
    _, grasp = close_hand(hand, target.field, hypothesis)
    assert grasp is not None
    contacts = touching(hand, target.field, grasp.spheres, grasp.clearance)
    return label_grasp(target, hand, grasp.T_object_hand, grasp.joints, contacts)


UP, DOWN, SIDE = [0, 0, 1], [0, 0, -1], [0, -1, 0]


def test_a_glass_held_at_its_side_thumb_up_can_be_poured_from_but_not_turned_over(hand, targets):
    labels = fist(hand, targets["glass_0"], SIDE, UP, [0, 0, 0])
    assert labels["pouring"].afforded
    assert labels["dish-washing"].afforded is False
    assert labels["dish-washing"].terms["thumb"] < 0


def test_a_glass_held_thumb_down_can_be_turned_over_but_not_poured_from(hand, targets):
    labels = fist(hand, targets["glass_0"], SIDE, DOWN, [0, 0, -0.02])
    assert min(labels["dish-washing"].terms[term] for term in ("behind", "inside", "thumb")) > 0
    assert labels["pouring"].afforded is False
    assert labels["pouring"].terms["thumb"] < 0


def test_a_hand_over_the_opening_can_neither_pour_nor_wash(hand, targets):
    labels = fist(hand, targets["glass_0"], DOWN, [0, 1, 0], [0, 0, 0.06])
    assert labels["pouring"].terms["column"] < 0
    assert labels["dish-washing"].terms["behind"] < 0


def test_a_bottle_is_never_for_washing_dishes_or_as_a_tool(hand, targets):
    labels = fist(hand, targets["bottle_0"], SIDE, UP, [0, 0, -0.03])
    assert labels["dish-washing"].afforded is False
    assert labels["tool-use"].afforded is False


def hammer_labels(hand, target, thumb, height, approach=SIDE):
    """Grip the hammer's handle; approach -y has the fingers along +x, where the face points."""
    return fist(hand, target, approach, thumb, [target.center_of_mass[0] * 0, 0, height])


def test_a_hammer_is_used_thumb_towards_the_head_and_face_to_the_knuckles(hand, targets):
    target = targets["hammer_0"]
    low = target.mesh.bounds[0, 2] + 0.07
    right = hammer_labels(hand, target, UP, low)["tool-use"]
    turned = hammer_labels(hand, target, DOWN, low)["tool-use"]
    assert right.terms["thumb"] > 0 > turned.terms["thumb"]
    assert right.terms["handle"] > 0
    assert right.terms["clear"] > 0


def test_a_hammer_held_at_its_head_is_no_tool(hand, targets):
    target = targets["hammer_0"]
    labels = hammer_labels(hand, target, UP, target.mesh.bounds[1, 2] - 0.02)
    assert labels["tool-use"].afforded is False
    assert labels["tool-use"].terms["clear"] < 0


def test_fingers_on_the_cutting_edge_forbid_to_hand_the_knife_over(hand, targets):
    target = targets["knife_0"]
    edge = target.model.functions.edge
    middle = 0.5 * (edge.start + edge.end)
    contacts = Contacts(
        np.array([middle, middle + 0.001]),
        np.array([edge.direction, -edge.direction]),
        np.array([2, 6]),
        np.ones(2),
    )
    pose = np.eye(4)
    pose[:3, 3] = middle + np.array([0.0, 0.3, 0.0])
    labels = label_grasp(target, hand, pose, hand.preshapes[0].open, contacts)
    assert labels["hand-over"].terms["edge"] < 0
    assert labels["hand-over"].afforded is False


def test_a_hand_far_away_leaves_every_receiver_room(hand, targets):
    pose = np.eye(4)
    pose[:3, 3] = [1.0, 1.0, 1.0]
    labels = label_grasp(targets["mug_0"], hand, pose, hand.preshapes[0].open)
    assert labels["hand-over"].afforded


def test_a_label_is_afforded_exactly_where_its_margin_is_not_negative(hand, targets):
    labels = fist(hand, targets["mug_0"], SIDE, UP, [0, 0, 0])
    for task in TASKS:
        assert labels[task].afforded == (labels[task].margin >= 0)


def test_a_mesh_without_annotations_gives_empty_labels(hand, targets):
    model = replace(targets["glass_0"].model, functions=None)
    labels = label_grasp(TaskObject(model), hand, np.eye(4), hand.preshapes[0].open)
    assert all(labels[task].afforded is None for task in TASKS)


def test_a_class_that_no_rule_knows_gives_no_false_negatives(hand, targets):
    model = replace(targets["glass_0"].model, object_class="vase")
    labels = label_grasp(TaskObject(model), hand, np.eye(4), hand.preshapes[0].open)
    assert labels["pouring"].afforded is None


def test_an_open_mesh_is_refused_with_the_reason(targets):
    mesh = targets["glass_0"].mesh
    model = replace(targets["glass_0"].model, mesh=Mesh(mesh.vertices, mesh.faces[:-10]))
    with pytest.raises(ValueError, match="open"):
        TaskObject(model)


def test_a_mesh_in_the_wrong_unit_is_refused_with_the_reason(targets):
    model = replace(targets["glass_0"].model, mesh=targets["glass_0"].mesh.scaled(1000.0))
    with pytest.raises(ValueError, match="unit"):
        TaskObject(model)
