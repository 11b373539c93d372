"""Own meshes: lying vessels are turned, misspelt classes refused, odd sizes and colours told."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from intent_perception.objects.database import ObjectDatabase, ObjectModel

PROFILE = np.array(
    [
        [0, 0],
        [35, 0],
        [35, 120],
        [14, 160],
        [14, 200],
        [11, 200],
        [11, 158],
        [31, 118],
        [31, 5],
        [0, 5],
    ]
)


def bottle(turn: tuple[float, ...] = (0, 0, 0)) -> trimesh.Trimesh:
    shape = trimesh.creation.revolve(PROFILE, sections=48)
    shape.apply_transform(trimesh.transformations.euler_matrix(*np.radians(turn)))
    return shape


def entry_file(folder: Path, mesh: str, only: bool = True, **more: object) -> Path:
    entry = {"name": "mine", "mesh": mesh, "unit": "mm", "class": "bottle"} | more
    content = {"objects": [entry]} | ({"only": True} if only else {})
    (folder / "mine.yaml").write_text(yaml.safe_dump(content))
    return folder


def loaded(folder: Path, shape: trimesh.Trimesh, **more: object) -> tuple[ObjectModel, str]:
    shape.export(folder / "mine.stl")
    database = ObjectDatabase.load(entry_file(folder, "mine.stl", **more))
    return database["mine"], " ".join(database.notes)


@pytest.mark.parametrize(
    ("up", "turn"),
    [
        ("y", (-90, 0, 0)),
        ("-y", (90, 0, 0)),
        ("x", (0, 90, 0)),
        ("-x", (0, -90, 0)),
        ("-z", (180, 0, 0)),
    ],
)
def test_up_stands_the_object_on_its_bottom(
    tmp_path: Path, up: str, turn: tuple[float, ...]
) -> None:
    model, notes = loaded(tmp_path, bottle(turn), up=up)
    assert notes == ""
    np.testing.assert_allclose(model.size, [0.07, 0.07, 0.2], atol=5e-4)
    high = model.mesh.vertices[:, 2] > model.mesh.bounds[1, 2] - 1e-4
    assert np.hypot(*model.mesh.vertices[high, :2].T).max() == pytest.approx(0.014, abs=1e-4)


def test_a_lying_bottle_is_turned_with_a_warning(tmp_path: Path) -> None:
    model, notes = loaded(tmp_path, bottle((-90, 0, 0)))
    assert "does not stand along z: it was turned as with up: y" in notes
    assert model.size[2] == pytest.approx(0.2, abs=1e-4)


def test_an_upright_bottle_is_left_as_it_is(tmp_path: Path) -> None:
    model, notes = loaded(tmp_path, bottle())
    assert notes == ""
    assert model.mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)


def test_an_axis_that_lays_a_bottle_down_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="up: x lays the bottle down, its axis is z: give up: z"):
        loaded(tmp_path, bottle(), up="x")


def test_an_upside_down_bottle_is_told(tmp_path: Path) -> None:
    assert "seems to be upside down" in loaded(tmp_path, bottle((180, 0, 0)))[1]


@pytest.mark.parametrize(
    ("name", "meant"), [("botle", "bottle"), ("Mug", "mug"), ("hamer", "hammer")]
)
def test_a_misspelt_class_is_refused_with_the_right_one(
    tmp_path: Path, name: str, meant: str
) -> None:
    with pytest.raises(ValueError, match=f"class '{name}' is not known, did you mean '{meant}'"):
        loaded(tmp_path, bottle(), **{"class": name})


def test_a_truly_other_class_is_allowed_and_said(tmp_path: Path) -> None:
    model, notes = loaded(tmp_path, bottle(), **{"class": "teapot"})
    assert model.object_class == "teapot"
    assert "its class 'teapot' is none of bottle" in notes


def test_a_class_that_contradicts_the_shape_is_told(tmp_path: Path) -> None:
    assert "vessel rather than a knife" in loaded(tmp_path, bottle(), **{"class": "knife"})[1]


def test_a_size_in_inches_is_suspected(tmp_path: Path) -> None:
    shape = bottle().apply_scale(1.0 / 25.4)  # 7.9 of them
    assert "is its unit in?" in loaded(tmp_path, shape, unit="cm")[1]


def test_own_objects_are_added_to_the_shipped_ones(tmp_path: Path) -> None:
    bottle().export(tmp_path / "mine.stl")
    database = ObjectDatabase.load(entry_file(tmp_path, "mine.stl", only=False))
    assert len(database) == 49
    assert database.names[0] == "mine"
    assert ObjectDatabase.load(tmp_path, alone=True).names == ("mine",)


def test_an_own_object_replaces_the_shipped_one_of_its_name(tmp_path: Path) -> None:
    bottle().export(tmp_path / "mine.stl")
    database = ObjectDatabase.load(entry_file(tmp_path, "mine.stl", only=False, name="bottle_0"))
    assert len(database) == 48
    assert database["bottle_0"].size[2] == pytest.approx(0.2, abs=1e-3)


def test_the_colour_of_an_obj_is_that_of_its_material(tmp_path: Path) -> None:
    bottle().export(tmp_path / "plain.obj")
    text = (tmp_path / "plain.obj").read_text()
    (tmp_path / "mine.obj").write_text("mtllib mine.mtl\nusemtl red\n" + text)
    (tmp_path / "mine.mtl").write_text("newmtl red\nKd 0.8 0.1 0.2\n")
    model = ObjectDatabase.load(entry_file(tmp_path, "mine.obj"))["mine"]
    np.testing.assert_allclose(model.color, [0.8, 0.1, 0.2], atol=0.01)


def test_the_colour_of_a_texture_is_its_mean_where_it_is_used(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[:, :4], picture[:, 4:] = (0, 200, 0), (200, 0, 0)
    image.fromarray(picture).save(tmp_path / "paint.png")
    shape = bottle()
    uv = np.full((len(shape.vertices), 2), 0.25)  # all on the green half
    corners = "\n".join(f"v {x} {y} {z}" for x, y, z in shape.vertices)
    texture = "\n".join(f"vt {u} {v}" for u, v in uv)
    faces = "\n".join(f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in shape.faces + 1)
    text = f"mtllib mine.mtl\n{corners}\n{texture}\nusemtl paint\n{faces}\n"
    (tmp_path / "mine.obj").write_text(text)
    (tmp_path / "mine.mtl").write_text("newmtl paint\nmap_Kd paint.png\n")
    model = ObjectDatabase.load(entry_file(tmp_path, "mine.obj"))["mine"]
    np.testing.assert_allclose(model.color, [0.0, 0.78, 0.0], atol=0.02)


@pytest.mark.parametrize("kind", ["ply", "glb"])
def test_the_colour_of_faces_is_kept(tmp_path: Path, kind: str) -> None:
    shape = bottle()
    shape.visual.face_colors = np.tile([30, 60, 240, 255], (len(shape.faces), 1))
    shape.export(tmp_path / f"mine.{kind}")
    model = ObjectDatabase.load(entry_file(tmp_path, f"mine.{kind}"))["mine"]
    np.testing.assert_allclose(model.color, np.array([30, 60, 240]) / 255.0, atol=0.01)
