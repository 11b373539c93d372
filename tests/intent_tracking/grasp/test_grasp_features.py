"""Table I: independent of where the scene stands, sensible, and mirrored for left hands."""

import numpy as np
import pytest

from intent_perception.geometry.transforms import inverse, pose_from_vector
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_features import (
    GraspedShape,
    as_right_hand,
    grasp_features,
    hand_distances,
    palm_center,
)
from intent_tracking.scene.hand_model import HandModel

WRAP = np.radians([-4, -15, 35, 30] + [0, 55, 60, 40] * 4)
T_OBJECT_HAND = pose_from_vector([-0.10, -0.055, 0.02, np.pi / 2, 0.05, 0.02])
NAMES = ("size", "conv", "dir", "npos", "fcon", "fvol", "coc", "gbvl")


@pytest.fixture(scope="module")
def mug():
    return GraspedShape(ObjectDatabase.load()["mug_0"])


@pytest.fixture(scope="module")
def table():
    return HandModel().table


def test_features_are_unchanged_when_hand_and_object_move_together(mug, table):
    motion = pose_from_vector([0.3, -0.2, 0.8, 0.4, -1.1, 2.0])
    together = inverse(motion) @ (motion @ T_OBJECT_HAND)
    here = grasp_features(mug, T_OBJECT_HAND, WRAP, table)
    there = grasp_features(mug, together, WRAP, table)
    for name in NAMES:
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), atol=1e-6)


def test_shares_and_unit_vectors_stay_in_range(mug, table):
    features = grasp_features(mug, T_OBJECT_HAND, WRAP, table)
    assert 0.0 < features.conv[0] < 1.0
    assert 0.0 <= features.fvol[0] <= 1.0
    assert np.linalg.norm(features.npos) == pytest.approx(1.0)
    assert np.linalg.norm(features.dir) == pytest.approx(1.0)


def test_a_distant_hand_leaves_the_whole_object_free(mug, table):
    far = pose_from_vector([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert grasp_features(mug, far, WRAP, table).fvol[0] == 1.0


def test_a_mirrored_left_hand_has_the_features_of_the_right_hand(mug, table):
    flip_object, flip_hand = mug.mirror, np.diag([1.0, -1.0, 1.0, 1.0])
    left = flip_object @ T_OBJECT_HAND @ flip_hand
    np.testing.assert_allclose(as_right_hand(mug, left), T_OBJECT_HAND, atol=1e-12)


def test_the_mirror_of_a_mug_keeps_its_handle(mug):
    np.testing.assert_allclose(mug.mirror[:3, :3], np.diag([1.0, -1.0, 1.0]))


def test_the_palm_centre_lies_inside_the_palm(table):
    distance = hand_distances(palm_center(table)[None], table, WRAP)
    assert distance.min() < 0.005


def test_an_open_mesh_has_no_convexity_but_all_other_features(table):
    model = ObjectDatabase.load()["mug_0"]
    mesh = type(model.mesh)(model.mesh.vertices, model.mesh.faces[:-40])
    torn = type(model)(
        **{**{k: getattr(model, k) for k in model.__dataclass_fields__}, "mesh": mesh}
    )
    features = grasp_features(GraspedShape(torn), T_OBJECT_HAND, WRAP, table)
    assert features.conv is None
    assert features.coc is not None
