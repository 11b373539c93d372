"""What a task demands of shape and pose."""

import numpy as np
import pytest

from intent_imitation.planner.preconditions import fits_pose, is_vessel
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.database import CLUTTER, ObjectDatabase, ObjectModel

UPRIGHT = np.eye(4)
FLIPPED = make_pose(rotation_from_vector([np.pi, 0.0, 0.0]), np.zeros(3))


def model(name: str) -> ObjectModel:
    return ObjectDatabase.load(CLUTTER if "_" not in name or name == "toy_car" else None)[name]


@pytest.mark.parametrize("name", ["bottle_3", "glass_2", "mug_5"])
def test_vessels_are_known_by_their_shape(name: str) -> None:
    assert is_vessel(model(name), SignedDistance.from_mesh(model(name).mesh))


@pytest.mark.parametrize("name", ["ball", "box", "toy_car", "sponge", "hammer_1"])
def test_balls_boxes_toys_and_hammers_are_no_vessels(name: str) -> None:
    assert not is_vessel(model(name), SignedDistance.from_mesh(model(name).mesh))


@pytest.mark.parametrize("annotated", [True, False])
def test_only_an_upright_mug_pours_and_any_may_be_washed(annotated: bool) -> None:
    mug = model("mug_5")
    distance = SignedDistance.from_mesh(mug.mesh)
    assert fits_pose("pouring", mug, UPRIGHT, distance, annotated)
    assert not fits_pose("pouring", mug, FLIPPED, distance, annotated)
    assert fits_pose("dish-washing", mug, FLIPPED, distance, annotated)
