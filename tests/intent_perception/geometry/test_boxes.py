"""Boxes of least volume and the decomposition into them."""

import numpy as np
import pytest
import trimesh

from intent_perception.geometry.boxes import Box, decompose, minimum_volume_box
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import rotation_from_vector
from intent_perception.objects.database import ObjectDatabase

MODELS = ObjectDatabase.load()


def test_box_around_a_turned_box_is_that_box() -> None:
    rng = np.random.default_rng(0)
    edges = np.array([0.03, 0.08, 0.21])
    for vector in rng.normal(size=(5, 3)):
        points = rng.uniform(-0.5, 0.5, (400, 3))
        side = rng.integers(0, 3, 400)
        points[np.arange(400), side] = np.sign(points[np.arange(400), side]) * 0.5
        corners = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, 8).T
        turned = np.concatenate([points, corners]) * edges @ rotation_from_vector(vector).T + 0.1
        box = minimum_volume_box(turned)
        assert box.volume == pytest.approx(np.prod(edges), rel=0.04)
        np.testing.assert_allclose(np.sort(2 * box.half_size), edges, rtol=0.03)
        np.testing.assert_allclose(box.center, 0.1, atol=0.002)


def test_box_holds_all_its_points_and_is_no_larger_than_trimeshs() -> None:
    for name in ("mug_0", "hammer_0", "knife_2"):
        mesh = MODELS[name].mesh
        points = mesh.sample_surface(1500, np.random.default_rng(0))[0]
        box = minimum_volume_box(points)
        assert box.contains(points, 1e-6).all()
        reference = trimesh.bounds.oriented_bounds(points)[1]
        assert box.volume < 1.08 * np.prod(reference)


def test_rotation_is_right_handed() -> None:
    for box in decompose(MODELS["hammer_3"].mesh):
        np.testing.assert_allclose(box.rotation.T @ box.rotation, np.eye(3), atol=1e-9)
        assert np.linalg.det(box.rotation) == pytest.approx(1.0)


def test_hammer_is_cut_into_handle_and_head() -> None:
    model = MODELS["hammer_0"]
    boxes = decompose(model.mesh)
    assert 2 <= len(boxes) <= 8
    assert model.functions is not None
    assert model.functions.face is not None
    head = min(boxes, key=lambda box: np.linalg.norm(box.center - model.functions.face.center))  # type: ignore[union-attr]
    handle = min(boxes, key=lambda box: box.center[2])
    assert head is not handle
    assert 2 * handle.half_size.max() > 0.12


def test_plain_box_is_left_whole() -> None:
    shape = trimesh.creation.box((0.05, 0.08, 0.2))
    assert len(decompose(Mesh.of(shape.vertices, shape.faces))) == 1


@pytest.mark.parametrize("name", ["mug_0", "bottle_1", "screwdriver_5", "wine"])
def test_boxes_cover_the_surface_and_save_volume(name: str) -> None:
    mesh = MODELS["glass_6" if name == "wine" else name].mesh
    points = mesh.sample_surface(3000, np.random.default_rng(5))[0]
    boxes = decompose(mesh)
    covered = np.any([box.contains(points, 0.001) for box in boxes], axis=0)
    assert covered.mean() > 0.98
    assert sum(box.volume for box in boxes) < 0.9 * minimum_volume_box(points).volume


def test_flat_points_have_a_box() -> None:
    points = np.random.default_rng(0).uniform(size=(50, 3)) * [0.1, 0.2, 0.0]
    assert isinstance(minimum_volume_box(points), Box)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match="four points"):
        decompose(np.zeros((2, 3)))
