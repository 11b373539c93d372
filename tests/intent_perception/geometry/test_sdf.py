"""The distance grid against closed forms, and against trimesh's volume test for the sign."""

import numpy as np
import pytest
import trimesh

from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase

MODELS = ObjectDatabase.load()


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh.of(shape.vertices, shape.faces)


def box_distance(points: np.ndarray, half: np.ndarray) -> np.ndarray:
    away = np.abs(points) - half
    outside = np.linalg.norm(np.maximum(away, 0.0), axis=1)
    return np.asarray(outside + np.minimum(away.max(axis=1), 0.0))


def test_distance_to_a_box_is_the_closed_form() -> None:
    half = np.array([0.02, 0.03, 0.05])
    field = SignedDistance.from_mesh(mesh_of(trimesh.creation.box(2 * half)))
    points = np.random.default_rng(0).uniform(-1, 1, (3000, 3)) * (half + 0.03)
    error = np.abs(field.distance(points) - box_distance(points, half))
    assert np.median(error) < 5e-5
    assert error.max() < 0.0015  # at edges, between the grid points


def test_distance_to_a_sphere_is_the_closed_form() -> None:
    shape = trimesh.creation.icosphere(subdivisions=4, radius=0.04)
    field = SignedDistance.from_mesh(mesh_of(shape))
    points = np.random.default_rng(0).uniform(-0.06, 0.06, (3000, 3))
    error = np.abs(field.distance(points) - (np.linalg.norm(points, axis=1) - 0.04))
    assert error.max() < 4e-4


def test_gradient_is_that_of_finite_differences_and_points_outwards() -> None:
    shape = trimesh.creation.icosphere(subdivisions=4, radius=0.04)
    field = SignedDistance.from_mesh(mesh_of(shape))
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(500, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = direction * rng.uniform(0.02, 0.06, (500, 1))
    np.testing.assert_allclose(field.gradient(points), direction, atol=0.06)


def test_distance_grows_by_the_way_outside_the_grid() -> None:
    field = SignedDistance.from_mesh(mesh_of(trimesh.creation.box((0.04, 0.04, 0.04))))
    assert field.distance([0.3, 0.0, 0.0]) == pytest.approx(0.28, abs=1e-5)


@pytest.mark.parametrize("name", ["mug_0", "knife_4"])
def test_points_beside_the_surface_are_on_the_right_side(name: str) -> None:
    mesh = MODELS[name].mesh
    field = SignedDistance.from_mesh(mesh, spacing=0.001, margin=0.005)
    points, normals, _ = mesh.sample_surface(2000, np.random.default_rng(0))
    assert np.mean(field.distance(points + 0.001 * normals) > 0) > 0.995
    inner = field.distance(points - 0.0004 * normals)
    assert np.mean(inner < 0) > 0.9  # blades are as thin as the grid


def test_grid_points_have_the_exact_distance() -> None:
    mesh = MODELS["mug_0"].mesh
    field = SignedDistance.from_mesh(mesh)
    rng = np.random.default_rng(0)
    cells = np.stack([rng.integers(0, n, 120) for n in field.values.shape], axis=1)
    points = field.origin + cells * field.spacing
    reference = triangle_distances(mesh, points)
    np.testing.assert_allclose(np.abs(field.values[tuple(cells.T)]), reference, atol=2e-4)


def triangle_distances(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    repeated = np.repeat(points, len(mesh.faces), axis=0)
    triangles = np.tile(mesh.triangles, (len(points), 1, 1))
    closest = trimesh.triangles.closest_point(triangles, repeated)
    distance = np.linalg.norm(closest - repeated, axis=1)
    return np.asarray(distance.reshape(len(points), -1).min(axis=1))


def test_inside_of_a_mug_is_outside_of_the_object() -> None:
    field = SignedDistance.from_mesh(MODELS["mug_0"].mesh)
    assert field.distance([-0.018, 0.0, 0.0]) > 0.02


def test_open_box_still_has_an_inside() -> None:
    shape = trimesh.creation.box((0.05, 0.05, 0.05))
    shape.update_faces(np.arange(12) > 1)
    field = SignedDistance.from_mesh(mesh_of(shape))
    assert field.distance([0.001, 0.002, 0.003]) < 0
    assert field.distance([0.0, 0.0, 0.04]) > 0


def test_wrong_spacing_is_refused() -> None:
    with pytest.raises(ValueError, match="spacing"):
        SignedDistance.from_mesh(MODELS["mug_0"].mesh, spacing=0.0)
