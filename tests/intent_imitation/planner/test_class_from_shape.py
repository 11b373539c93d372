"""An object of unknown class gets soft evidence of its class from its shape, and may be of none."""

import numpy as np
import pytest

from intent_imitation.planner.affordance import task_chances
from intent_imitation.planner.class_from_shape import Kinds, shape_of
from intent_imitation.planner.grasp_library import GraspLibrary
from intent_inference.network.model_file import shipped_model
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import CLUTTER, ObjectDatabase


@pytest.fixture(scope="module")
def practised() -> Kinds:
    """Return what a robot knows that has met the first half of the objects of each class."""
    kinds = GraspLibrary.load().kinds
    return kinds.only([name for name in kinds.names if int(name.rsplit("_", 1)[1]) < 4])


def shape(name: str) -> np.ndarray:
    source = None if name.rsplit("_", 1)[-1].isdigit() else CLUTTER
    model = ObjectDatabase.load(source)[name]
    return shape_of(model, SignedDistance.from_mesh(model.mesh))


@pytest.mark.parametrize("name", ["bottle_5", "glass_4", "mug_7", "knife_7", "hammer_7"])
def test_a_new_object_of_a_known_kind_is_taken_for_it(practised: Kinds, name: str) -> None:
    chances = practised.chances(shape(name))
    assert max(chances, key=lambda kind: chances[kind]) == name.rsplit("_", 1)[0]
    assert sum(chances.values()) > 0.5


@pytest.mark.parametrize("name", ["toy_car", "box", "ball", "sponge"])
def test_a_thing_unlike_all_that_was_practised_is_of_no_kind(practised: Kinds, name: str) -> None:
    assert sum(practised.chances(shape(name)).values()) < 0.2


def test_a_quarter_turn_about_the_vertical_changes_no_descriptor() -> None:
    model = ObjectDatabase.load()["mug_1"]
    distance = SignedDistance.from_mesh(model.mesh)
    turned = SignedDistance(
        distance.origin, distance.spacing, np.ascontiguousarray(distance.values.swapaxes(0, 1))
    )
    np.testing.assert_allclose(shape_of(model, turned), shape_of(model, distance), atol=1e-12)


def test_a_robot_without_practice_knows_no_kinds() -> None:
    assert Kinds((), (), np.zeros((0, 0))).chances(np.zeros(28)) == {}


def test_no_odd_feature_makes_a_hammer_pour() -> None:
    model = shipped_model("schunk")
    odd = {"size": np.array([[0.07, 0.07, 0.2]]), "conv": np.array([[0.95]])}
    sure = task_chances(model, {"obcl": np.array(["hammer"]), **odd}, {"hammer": 1.0})
    assert sure[0, model.tasks.index("pouring")] < 0.1


def test_an_object_of_no_known_kind_is_trusted_less_than_the_networks_say() -> None:
    model = shipped_model("schunk")
    odd = {"obcl": np.array([""]), "size": np.array([[0.07, 0.07, 0.2]])}
    stranger = task_chances(model, odd, {"bottle": 0.0})[0]
    column = model.tasks.index("pouring")
    assert stranger[column] < 0.7 * model.posterior(odd)[0, column]
