"""Scanned and artist-made meshes (INTENT_DATA): one entry each is enough."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from intent_perception.objects.database import ObjectDatabase, ObjectModel

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def meshes(real_data: Path) -> Path:
    return real_data / "meshes"


def database(folder: Path, files: list[Path], unit: str = "m") -> ObjectDatabase:
    entries = [
        {"name": file.stem, "mesh": str(file), "unit": unit, "class": "thing"} for file in files
    ]
    (folder / "models.yaml").write_text(yaml.safe_dump({"only": True, "objects": entries}))
    return ObjectDatabase.load(folder)


def loaded(folder: Path, file: Path) -> ObjectModel:
    return database(folder, [file]).models[0]


def test_every_scanned_object_loads_with_its_size(meshes: Path, tmp_path: Path) -> None:
    files = sorted((meshes / "ycb_bop").glob("*.ply"))
    models = database(tmp_path, files)
    assert len(models) == 21
    np.testing.assert_allclose(models["003_cracker_box"].size, [0.072, 0.164, 0.213], atol=0.002)
    for model in models:
        assert 0.05 < model.diameter < 0.35
        assert len(model.stable_poses)
    closed = [model.name for model in models if model.mesh.is_watertight]
    assert len(closed) >= 20


@pytest.mark.parametrize(
    ("name", "axis", "turns"),
    [
        ("ycb_bop/002_master_chef_can.ply", True, None),
        ("ycb_bop/024_bowl.ply", True, 0),
        ("ycb_bop/025_mug.ply", False, 0),
        ("ycb_bop/035_power_drill.ply", False, 0),
        ("contactdb_object_sim/wineglass.stl", True, 0),
        ("contactdb_object_sim/hammer.stl", False, 0),
        ("sweethome3d/split_katorlegaz_glass13.obj", True, 0),
    ],
)
def test_symmetry_of_real_objects(
    meshes: Path, tmp_path: Path, name: str, axis: bool, turns: int | None
) -> None:
    symmetry = loaded(tmp_path, meshes / name).symmetry
    assert (symmetry.axis is not None) == axis
    assert turns is None or len(symmetry.turns) == turns


def test_a_real_mug_keeps_its_cavity_in_parts(meshes: Path, tmp_path: Path) -> None:
    model = loaded(tmp_path, meshes / "contactdb_object_sim" / "mug.stl")
    filled = sum(part.mesh.volume for part in model.parts)
    assert filled < 1.6 * model.require_volume().volume
    assert filled < 0.5 * model.mesh.convex_hull.volume


def test_open_real_meshes_are_recognisable_but_have_no_volume(meshes: Path, tmp_path: Path) -> None:
    names = ("bowl", "camera", "hammer_head", "hammer_neck", "knife_blade", "knife_handle",
             "phone", "stapler")  # fmt: skip
    files = [meshes / "contactdb_object_sim" / f"{name}.stl" for name in names]
    for model in database(tmp_path, files):
        points = model.mesh.sample_surface(100, np.random.default_rng(0))[0]
        assert np.all(np.isfinite(points))
        with pytest.raises(ValueError, match=r"open or inconsistent edges.*close its holes"):
            model.require_volume()


def test_wrong_unit_of_a_real_mesh_is_named(meshes: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="its unit is probably m"):
        database(tmp_path, [meshes / "ycb_bop" / "025_mug.ply"], unit="mm")


def test_artists_meshes_load(meshes: Path, tmp_path: Path) -> None:
    files = sorted((meshes / "sweethome3d").glob("split_*.obj"))
    assert len(database(tmp_path, files)) == len(files)
