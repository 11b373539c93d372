"""What is converted to a message and back is what it was."""

from dataclasses import fields
from typing import Any

import numpy as np

from intent_imitation.planner.plan import GraspCandidate, GraspPlan, ObjectChoice
from intent_imitation.ros.convert import plan_from_msg, plan_to_msg
from intent_inference.intention.contributions import Contribution
from intent_inference.intention.task_posterior import TaskPosterior
from intent_inference.ros.convert import posterior_from_msg, posterior_to_msg
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_perception.ros.convert import (
    FrameNames,
    object_markers,
    objects_from_msg,
    objects_to_msg,
    pose_from_msg,
    pose_to_msg,
)
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.ros.convert import (
    grasp_from_msg,
    grasp_to_msg,
    hand_markers,
    scene_transforms,
    state_from_msg,
    state_to_msg,
)
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.scene_state import SceneState

POSE = make_pose(rotation_from_vector(np.array([0.3, -0.2, 1.0])), np.array([0.1, -0.2, 0.3]))
STAMP = 1_234_567_890_123_456_789


def assert_same(one: Any, two: Any) -> None:
    """Compare two results field by field."""
    assert type(one) is type(two)
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_allclose(a, b, atol=1e-12, err_msg=field.name)
        elif hasattr(a, "__dataclass_fields__"):
            assert_same(a, b)
        elif isinstance(a, tuple) and a and hasattr(a[0], "__dataclass_fields__"):
            for x, y in zip(a, b, strict=True):
                assert_same(x, y)
        else:
            assert a == b, field.name


def test_a_pose_survives() -> None:
    np.testing.assert_allclose(pose_from_msg(pose_to_msg(POSE)), POSE, atol=1e-12)


def test_recognised_objects_survive() -> None:
    item = RecognizedObject("mug_1.2", "mug_1", "mug", POSE, 0.9, 0.7)
    objects = RecognizedObjects(STAMP, (item,), POSE)
    assert_same(objects_from_msg(objects_to_msg(objects, ObjectDatabase.load())), objects)


def test_a_scene_state_survives_with_its_nans() -> None:
    values = np.arange(32.0)
    values[:26] = np.nan
    state = SceneState(
        STAMP, "left", values, values, np.ones(22), ("a",), ("mug_1",), ("mug",), POSE,
        float("inf"), True, True, (False,),
    )  # fmt: skip
    assert_same(state_from_msg(state_to_msg(state)), state)


def test_a_stable_grasp_survives_with_what_was_not_observed() -> None:
    known = {"size": np.ones(3), "dir": np.array([0, 0, 0, 1.0]), "fcon": np.arange(20.0) / 10.0}
    names = [field.name for field in fields(GraspFeatures) if field.name != "object_class"]
    features = GraspFeatures("mug", **{name: known.get(name) for name in names})
    std = GraspFeatures(
        None, **{name: known.get(name) if name == "fcon" else None for name in names}
    )
    grasp = StableGrasp(STAMP, "mug_1", "mug_1", "mug", "right", features, std, POSE)
    assert_same(grasp_from_msg(grasp_to_msg(grasp)), grasp)


def test_a_posterior_survives() -> None:
    posterior = TaskPosterior(
        STAMP, "a", "mug", ("pouring", "hand-over"), np.array([0.2, 0.7]),
        np.array([0.1, 0.7, 0.2]), "GRASP", "hand-over", ("hand-over",), False, 3.5, ("fvol",),
        (Contribution("pouring", "dir", -1.5),),
    )  # fmt: skip
    assert_same(posterior_from_msg(posterior_to_msg(posterior)), posterior)


def test_a_plan_survives() -> None:
    grasp = GraspCandidate(
        "mug_1", POSE, np.array([0, 0, -1.0]), np.zeros(2), np.ones(2), 0.8, {"task": 0.9}, False
    )
    choice = ObjectChoice("mug_1", "mug", 0.8, True)
    plan = GraspPlan(STAMP, "pouring", False, (choice,), (grasp,), "schunk", ("a", "b"))
    assert_same(plan_from_msg(plan_to_msg(plan)), plan)


def tracked() -> SceneState:
    """A state with a hand and an object."""
    return SceneState(
        STAMP, "right", np.full(32, 0.1), np.ones(32), HandModel().shape, ("mug",), ("mug_1",),
        ("mug",), POSE, 1.0, True, False, (False,),
    )  # fmt: skip


def test_frames_are_called_as_the_parameters_say() -> None:
    names = FrameNames("left_table", "left_hand", "left_object_")
    transforms = scene_transforms(tracked(), names).transforms
    assert {t.header.frame_id for t in transforms} == {"left_table"}
    assert {t.child_frame_id for t in transforms} == {"left_hand", "left_object_mug"}


def test_no_two_markers_have_one_name() -> None:
    database = ObjectDatabase.load()
    objects = object_markers([(name, database[name]) for name in ("mug_0", "mug_1")])
    markers = [*objects.markers, *hand_markers(tracked()).markers]
    assert len({(marker.ns, marker.id) for marker in markers}) == len(markers) > 20
