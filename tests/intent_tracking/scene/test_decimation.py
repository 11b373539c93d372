import numpy as np
import pytest

from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.scene.decimation import decimated


@pytest.fixture(scope="module")
def mug():
    return ObjectDatabase.load()["mug_0"].mesh


def uses_of_edges(faces):
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)[1]


def test_a_closed_surface_keeps_its_topology(mug):
    vertices, faces = decimated(mug.vertices, mug.faces, 200)
    uses = uses_of_edges(faces)
    assert len(faces) == 200
    assert np.all(uses == 2)
    assert len(vertices) - len(uses) + len(faces) == 0  # a mug has one handle


def test_two_hundred_triangles_stay_within_millimetres_of_a_mug(mug):
    vertices, faces = decimated(mug.vertices, mug.faces, 200)
    points, _, _ = Mesh.of(vertices, faces).sample_surface(2000, np.random.default_rng(0))
    gap = np.abs(SignedDistance.from_mesh(mug, 0.002, 0.02).distance(points))
    assert gap.mean() < 0.001
    assert gap.max() < 0.005


def test_faces_keep_their_outside_outside(mug):
    vertices, faces = decimated(mug.vertices, mug.faces, 200)
    assert Mesh.of(vertices, faces).volume == pytest.approx(mug.volume, rel=0.05)


def test_a_flat_square_needs_few_triangles_only():
    side = np.linspace(-0.05, 0.05, 11)
    x, y = np.meshgrid(side, side)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(121)], axis=1)
    corner = (np.arange(10)[:, None] * 11 + np.arange(10)).ravel()
    lower = np.stack([corner, corner + 1, corner + 12], axis=1)
    upper = np.stack([corner, corner + 12, corner + 11], axis=1)
    found, faces = decimated(vertices, np.concatenate([lower, upper]).astype(np.int32), 8)
    assert len(faces) <= 8
    assert np.ptp(found, axis=0) == pytest.approx([0.1, 0.1, 0.0], abs=1e-3)


def test_a_small_mesh_stays_as_it_is():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    found, kept = decimated(vertices, faces, 4)
    assert sorted(map(tuple, found)) == sorted(map(tuple, vertices))
    assert len(kept) == 4
