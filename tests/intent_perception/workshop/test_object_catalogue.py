"""The shipped objects: closed, annotated, of household size, and what the generator makes."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import transform_points
from intent_perception.objects.database import OBJECT_CLASSES, ObjectDatabase, ObjectModel
from intent_perception.workshop.things.object_catalogue import make_clutter, make_objects

MODELS = ObjectDatabase.load()
CLUTTER = ObjectDatabase.clutter()
EVERYTHING = MODELS.joined(CLUTTER).models


def named(model: ObjectModel) -> str:
    return model.name


def test_there_are_eight_objects_of_each_class_and_clutter() -> None:
    expected = [f"{name}_{k}" for name in OBJECT_CLASSES for k in range(8)]
    assert list(MODELS.names) == expected
    assert len(CLUTTER) >= 8
    assert not {model.object_class for model in CLUTTER} & set(OBJECT_CLASSES)


def test_colours_are_distinct() -> None:
    colors = np.array([model.color for model in EVERYTHING])
    distance = np.linalg.norm(colors[:, None] - colors, axis=2) + np.eye(len(colors))
    assert distance.min() > 0.02


@pytest.mark.parametrize("model", EVERYTHING, ids=named)
def test_mesh_is_a_volume_of_few_triangles_around_its_origin(model: ObjectModel) -> None:
    volume = model.require_volume().volume
    reference = trimesh.Trimesh(model.mesh.vertices, model.mesh.faces, process=False)
    assert reference.is_volume
    assert volume == pytest.approx(reference.volume)
    assert len(model.mesh.faces) < 7000
    np.testing.assert_allclose(model.center, 0.0, atol=1e-6)


@pytest.mark.parametrize("model", EVERYTHING, ids=named)
def test_convex_parts_fill_the_object(model: ObjectModel) -> None:
    for part in model.parts:
        assert part.mesh.volume == pytest.approx(part.mesh.convex_hull.volume, rel=1e-4)
    points, normals, _ = model.mesh.sample_surface(1500, np.random.default_rng(0))
    inside, outside = np.zeros(1500, dtype=bool), np.zeros(1500, dtype=bool)
    for part in model.parts:
        inside |= contains(part.mesh, points - 0.0006 * normals, 0.0006)
        outside |= contains(part.mesh, points, -0.0015)
    assert inside.mean() > 0.97
    assert outside.mean() < 0.06


def contains(convex: Mesh, points: np.ndarray, slack: float) -> np.ndarray:
    heights = points @ convex.normals.T - np.einsum(
        "ij,ij->i", convex.normals, convex.triangles[:, 0]
    )
    return np.asarray(heights.max(axis=1) < slack)


@pytest.mark.parametrize("model", EVERYTHING, ids=named)
def test_symmetries_move_no_surface_by_more_than_the_noise(model: ObjectModel) -> None:
    own = model.mesh.sample_surface(40_000, np.random.default_rng(0))[0]
    points = model.mesh.sample_surface(300, np.random.default_rng(1))[0]
    tree = cKDTree(own)
    for turn in model.symmetry.transforms(steps=9):
        assert np.quantile(tree.query(transform_points(turn, points))[0], 0.9) < 0.003


@pytest.mark.parametrize("model", EVERYTHING, ids=named)
def test_stable_poses_stand_on_the_table_and_vessels_upright_first(model: ObjectModel) -> None:
    for T_table_object in model.stable_poses:
        assert abs(model.mesh.transformed(T_table_object).bounds[0, 2]) < 2e-5
        np.testing.assert_array_equal(T_table_object[:2, 3], 0.0)
    upright = model.stable_poses[0, 2, 2] > 0.999
    assert upright == (model.object_class not in ("knife", "hammer", "screwdriver"))


@pytest.mark.parametrize("model", MODELS.models, ids=named)
def test_each_class_has_its_functions(model: ObjectModel) -> None:
    functions = model.functions
    assert functions is not None
    vessel = model.object_class in ("bottle", "glass", "mug")
    assert (functions.opening is not None) == vessel
    assert (functions.edge is not None) == (model.object_class == "knife")
    assert (functions.face is not None) == (model.object_class == "hammer")
    assert (functions.tip is not None) == (model.object_class in ("knife", "screwdriver"))
    has_handle = model.object_class in ("mug", "knife", "hammer", "screwdriver")
    assert (functions.handle == ("handle",)) == has_handle
    names = {part.name for part in model.parts}
    assert set(functions.handle) | set(functions.functional) <= names


@pytest.mark.parametrize("model", MODELS.models, ids=named)
def test_annotated_points_lie_on_the_object(model: ObjectModel) -> None:
    functions = model.functions
    assert functions is not None
    points = []
    if functions.opening is not None:
        assert functions.opening.center[2] == pytest.approx(model.mesh.bounds[1, 2], abs=1e-5)
    if functions.edge is not None:
        points += [functions.edge.start, functions.edge.end]
    if functions.face is not None:
        points.append(functions.face.center)
        assert functions.face.center[0] == pytest.approx(model.mesh.bounds[1, 0], abs=1e-5)
    if functions.tip is not None:
        points.append(functions.tip)
        assert functions.tip[2] == pytest.approx(model.mesh.bounds[1, 2], abs=1e-5)
    surface = model.mesh.sample_surface(30_000, np.random.default_rng(0))[0]
    for point in points:
        assert np.linalg.norm(surface - point, axis=1).min() < 0.002


@pytest.mark.parametrize("model", MODELS.of_class("mug"), ids=named)
def test_fingers_fit_through_the_handle(model: ObjectModel) -> None:
    handle = np.concatenate([p.mesh.vertices for p in model.parts if p.name == "handle"])
    middle = 0.5 * (handle[:, 2].min() + handle[:, 2].max())
    start = np.array([handle[:, 0].max() + 0.01, 0.0003, middle])
    hits = crossings(model.mesh, start, np.array([-1.0, 0.0, 0.0]))
    assert hits[2] - hits[1] >= 0.020  # from the handle's inside to the wall


def crossings(mesh: Mesh, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the sorted distances at which a ray crosses a mesh."""
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    speed = normal @ direction
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.einsum("ij,ij->i", normal, a - origin) / speed
    distance[~np.isfinite(distance)] = 0.0
    point = origin + distance[:, None] * direction
    sides = [
        np.einsum("ij,ij->i", np.cross(q - p, point - p), normal)
        for p, q in ((a, b), (b, c), (c, a))
    ]
    hit = (speed != 0) & (np.min(sides, axis=0) >= 0)
    rounded = np.round(distance[hit], 6)
    return np.unique(rounded[rounded > 0])


@pytest.mark.parametrize("object_class", OBJECT_CLASSES)
def test_siblings_differ_in_size_and_shape(object_class: str) -> None:
    siblings = MODELS.of_class(object_class)
    for k, model in enumerate(siblings):
        for other in siblings[:k]:
            sizes = np.abs(model.size - other.size).max()
            shape = abs(model.convexity - other.convexity)
            assert sizes > 0.004 or shape > 0.02, (model.name, other.name)


@pytest.mark.parametrize("model", MODELS.models, ids=named)
def test_size_is_that_of_a_household_object(model: ObjectModel) -> None:
    low, high = {
        "bottle": (0.12, 0.32), "glass": (0.08, 0.21), "mug": (0.06, 0.15),
        "knife": (0.17, 0.37), "hammer": (0.22, 0.38), "screwdriver": (0.09, 0.33),
    }[model.object_class]  # fmt: skip
    assert low < model.size[2] < high
    assert 0.02 < model.mass < 1.5


def every_rest_is_among(some: ObjectModel, others: ObjectModel) -> bool:
    """Up and height say how a thing rests; where it is round, rounding chooses on which line."""
    rests, known = (np.asarray(m.stable_poses)[:, 2] for m in (some, others))
    turns = some.symmetry.transforms(steps=720)[:, :3, :3]
    likeness = np.einsum("rk,skj,oj->ros", rests[:, :3], turns, known[:, :3]).max(axis=2)
    height = np.abs(rests[:, None, 3] - known[None, :, 3])
    same = (likeness > np.cos(np.radians(0.5))) & (height < 1e-4)
    return bool(same.any(axis=1).all())


@pytest.mark.slow
def test_shipped_files_are_what_the_generator_makes() -> None:
    for made, stored in zip(make_objects() + make_clutter(), EVERYTHING, strict=True):
        assert made.name == stored.name
        np.testing.assert_allclose(made.mesh.bounds, stored.mesh.bounds, atol=2e-6)
        assert made.mesh.volume == pytest.approx(stored.mesh.volume, rel=1e-3)
        assert len(made.parts) == len(stored.parts)
        assert every_rest_is_among(made, stored)
        assert every_rest_is_among(stored, made)
