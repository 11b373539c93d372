"""Users' own meshes: one entry is enough, and what is wrong with it is said."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from scipy.spatial import cKDTree

from intent_perception.geometry.boxes import decompose
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.database import ObjectDatabase, ObjectModel


def database(folder: Path, shape: trimesh.Trimesh, **more: object) -> ObjectDatabase:
    shape.export(folder / "thing.stl")
    entry = {"name": "thing", "mesh": "thing.stl", "unit": "mm", "class": "tool"} | more
    (folder / "mine.yaml").write_text(yaml.safe_dump({"only": True, "objects": [entry]}))
    return ObjectDatabase.load(folder)


def loaded(folder: Path, shape: trimesh.Trimesh, **more: object) -> ObjectModel:
    return database(folder, shape, **more)["thing"]


def closed_box(x: float = 40, y: float = 60, z: float = 150) -> trimesh.Trimesh:
    return trimesh.creation.box((x, y, z))


def test_one_entry_is_enough(tmp_path: Path) -> None:
    model = loaded(tmp_path, closed_box())
    np.testing.assert_allclose(model.size, [0.04, 0.06, 0.15], atol=1e-7)
    assert model.object_class == "tool"
    assert model.mesh.is_watertight
    np.testing.assert_allclose(model.require_volume().volume, 0.04 * 0.06 * 0.15, rtol=1e-6)
    assert model.convexity == pytest.approx(1.0)
    assert len(model.parts) == 1
    assert model.functions is None


def test_mesh_keeps_the_frame_of_its_file(tmp_path: Path) -> None:
    moved = closed_box().apply_translation([100, 0, 0])
    np.testing.assert_allclose(loaded(tmp_path, moved).center, [0.1, 0, 0], atol=1e-7)


def test_box_has_three_half_turns_and_three_rests(tmp_path: Path) -> None:
    model = loaded(tmp_path, closed_box().apply_translation([10, 20, 30]))
    assert model.symmetry.axis is None
    assert len(model.symmetry.turns) == 3
    assert len(model.stable_poses) == 3
    for T_table_object in model.stable_poses:
        points = model.mesh.transformed(T_table_object).vertices
        assert abs(points[:, 2].min()) < 1e-9


def test_cylinder_has_an_axis_and_two_rests(tmp_path: Path) -> None:
    shape = trimesh.creation.cylinder(30, 120, sections=64).apply_translation([50, 0, 0])
    model = loaded(tmp_path, shape)
    assert model.symmetry.axis is not None
    assert abs(model.symmetry.axis[2]) == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(model.symmetry.center[:2], [0.05, 0], atol=1e-3)  # type: ignore[index]
    assert len(model.symmetry.turns) == 1
    assert len(model.stable_poses) == 2


def test_symmetries_take_the_surface_to_itself(tmp_path: Path) -> None:
    model = loaded(tmp_path, trimesh.creation.cylinder(30, 120, sections=6))
    surface = cKDTree(model.mesh.sample_surface(50_000, np.random.default_rng(1))[0])
    points = model.mesh.sample_surface(200, np.random.default_rng(0))[0]
    assert len(model.symmetry.turns) == 11  # the dihedral group of a hexagonal prism
    for turn in model.symmetry.turns:
        moved = points @ turn[:3, :3].T + turn[:3, 3]
        assert np.quantile(surface.query(moved)[0], 0.95) < 0.002


def test_object_without_symmetry_has_none(tmp_path: Path) -> None:
    shape = trimesh.util.concatenate(
        [closed_box(), closed_box(30, 30, 30).apply_translation([40, 50, 20])]
    )
    symmetry = loaded(tmp_path, shape).symmetry
    assert symmetry.axis is None
    assert symmetry.turns == ()


def test_parts_of_a_bent_object_follow_it(tmp_path: Path) -> None:
    bent = trimesh.util.concatenate(
        [closed_box(20, 20, 150), closed_box(80, 20, 20).apply_translation([50, 0, 65])]
    )
    model = loaded(tmp_path, bent)
    volume = sum(part.mesh.volume for part in model.parts)
    assert volume < 0.7 * model.mesh.convex_hull.volume
    assert all(part.mesh.is_watertight for part in model.parts)


def test_wrong_unit_is_refused_with_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"150 m .* unit is probably mm"):
        loaded(tmp_path, closed_box(), unit="m")
    metres = closed_box().apply_scale(0.001)
    with pytest.raises(ValueError, match="unit is probably m"):
        loaded(tmp_path, metres)


def test_open_mesh_is_an_object_without_volume(tmp_path: Path) -> None:
    shape = closed_box()
    shape.update_faces(np.arange(len(shape.faces)) > 1)
    model = loaded(tmp_path, shape)
    assert len(model.stable_poses)
    with pytest.raises(ValueError, match=r"thing has no volume: .* open .* edges.*close its holes"):
        model.require_volume()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"unit": "furlong"}, "expected a unit of m, dm, cm, mm, in, got 'furlong'"),
        ({"colour": [1, 0, 0]}, r"has unknown \['colour'\]"),
        ({"color": [1, 0]}, "expected 3 numbers for color"),
        ({"color": [255, 0, 0]}, "values in 0..1"),
        ({"mass": -1}, "expected mass above 0"),
        ({"symmetry": "round"}, "object 'thing'"),
        ({"symmetry": {"turns": [[0, 0, 0, 1e300, 0, 0]]}}, "turns of numbers within 10"),
        ({"stable_poses": [[0, 0, float("nan"), 0, 0, 0]]}, "stable_poses of numbers within 10"),
        ({"functions": {"tip": [1, 2]}}, "expected 3 numbers for tip"),
        ({"unit": None}, r"lacks \['unit'\]"),
        ({"mesh": "none.stl"}, "none.stl does not exist"),
        ({"name": "a b"}, "without blanks"),
    ],
)
def test_wrong_entries_name_the_cause(
    tmp_path: Path, entry: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        loaded(tmp_path, closed_box(), **entry)


@pytest.mark.parametrize("text", ["objects: []", "{", "[1, 2]", "objects: [{name: x}]"])
def test_damaged_databases_name_the_file(tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(ValueError, match=r"mine\.yaml"):
        ObjectDatabase.load(tmp_path)


def test_damaged_mesh_names_the_file(tmp_path: Path) -> None:
    (tmp_path / "bad.ply").write_bytes(b"ply\nnonsense")
    with pytest.raises(ValueError, match=r"bad\.ply"):
        loaded(tmp_path, closed_box(), mesh="bad.ply")


def test_point_cloud_is_refused_with_the_reason(tmp_path: Path) -> None:
    trimesh.PointCloud(np.random.default_rng(0).uniform(size=(50, 3))).export(tmp_path / "c.ply")
    with pytest.raises(ValueError, match=r"c\.ply holds none \(a point cloud\?\)"):
        loaded(tmp_path, closed_box(), mesh="c.ply")


def test_flat_sheet_is_refused_with_the_reason(tmp_path: Path) -> None:
    sheet = trimesh.Trimesh(
        [[0, 0, 0], [90, 0, 0], [90, 90, 0], [0, 90, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    with pytest.raises(ValueError, match="flat set"):
        loaded(tmp_path, sheet)


def test_keys_left_empty_count_as_left_out(tmp_path: Path) -> None:
    model = loaded(tmp_path, closed_box(), functions=None, symmetry=None, color=None)
    assert model.functions is None
    assert len(model.symmetry.turns) == 3


def test_faces_of_an_inverted_mesh_are_turned_outwards(tmp_path: Path) -> None:
    shape = closed_box()
    shape.invert()
    assert loaded(tmp_path, shape).require_volume().volume > 0


def test_faces_of_mixed_orientation_are_made_consistent(tmp_path: Path) -> None:
    shape = trimesh.creation.icosphere(subdivisions=3, radius=40)
    mixed = np.array(shape.faces)
    mixed[::3] = mixed[::3, ::-1]
    model = loaded(tmp_path, trimesh.Trimesh(shape.vertices, mixed, process=False))
    assert model.require_volume().volume == pytest.approx(shape.volume * 1e-9, rel=1e-4)


def test_surface_samples_lie_on_the_surface_evenly() -> None:
    box = closed_box(2, 2, 2)
    mesh = Mesh.of(box.vertices, box.faces)
    points, normals, _ = mesh.sample_surface(6000, np.random.default_rng(0))
    np.testing.assert_allclose(np.abs(points).max(axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("ij,ij->i", points, normals), 1.0)
    assert np.abs(points.mean(axis=0)).max() < 0.03


@pytest.mark.parametrize("name", ["mug_0", "hammer_1", "knife_2"])
def test_shipped_boxes_are_those_that_the_mesh_decomposes_into(name):
    model = ObjectDatabase.load()[name]
    assert model.stored_boxes is not None
    computed = decompose(model.mesh)
    for stored, box in zip(model.stored_boxes, computed, strict=True):
        np.testing.assert_allclose(stored.center, box.center, atol=1e-4)
        np.testing.assert_allclose(stored.half_size, box.half_size, atol=1e-4)
