"""What is damaged, and what then reads it: one subject for each kind of input."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from tests.faults import mutation
from tests.faults.bag_subjects import BAG_SUBJECTS
from tests.faults.mutation import Rng
from tests.faults.outcome import Answer, Subject
from tests.faults.result_subjects import RESULT_SUBJECTS, features, finite

from intent_imitation.demo.known_truth import truth_of
from intent_imitation.planner.grasp_library import GraspLibrary
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.network.model_file import load_model
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception import SHARE
from intent_perception.geometry.camera import read_camera
from intent_perception.geometry.cloud import read_cloud
from intent_perception.geometry.coded_images import read_picture, write_picture
from intent_perception.geometry.transforms import make_pose, require_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.scene.camera_calibration import read_calibration
from intent_tracking.fit.hand_shape import load_shape

ROOT = Path(__file__).resolve().parents[2]
INFERENCE = ROOT / "src/intent_inference/intent_inference/share"
IMITATION = ROOT / "src/intent_imitation/intent_imitation/share"
MESHES = SHARE / "objects" / "meshes"


@cache
def _arrays(path: Path) -> dict[str, Any]:
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}


def _array_file(path: Path) -> Callable[[Rng, Path], Path]:
    def make(rng: Rng, folder: Path) -> Path:
        (folder / path.name).write_bytes(mutation.damaged_arrays(rng, _arrays(path)))
        return folder / path.name

    return make


def _use_model(path: Path) -> Answer:
    posterior = load_model(path).posterior(features())
    return Answer(finite(posterior) and posterior.min() >= 0.0 and posterior.max() <= 1.0)


def _use_library(path: Path) -> Answer:
    library = GraspLibrary.load(path)
    for grasps in library.sets.values():
        require_pose(grasps.T_object_hand, "pose")
    shape = library.kinds.shapes[0]
    return Answer(finite(*library.kinds.chances(shape).values()))


def _use_mesh(path: Path) -> Answer:
    entry = {"name": "thing", "mesh": path.name, "unit": "m", "class": "mug"}
    file = path.parent / "objects.yaml"
    file.write_text(yaml.safe_dump({"objects": [entry]}))
    return _use_database(file)


def _use_database(path: Path) -> Answer:
    models = ObjectDatabase.load(path)
    values = [v for m in models for v in (m.size, m.mass, m.friction, m.stable_poses, m.color)]
    turns = [m.symmetry.transforms(4) for m in models]
    small = all(m.size.max() <= 1.0 for m in models)
    return Answer(finite(*values, *turns) and small)


def _mesh_file(rng: Rng, folder: Path) -> Path:
    import trimesh

    suffix = str(rng.choice(["ply", "stl", "obj", "off", "glb"]))
    mesh = trimesh.creation.cylinder(0.03, 0.1, sections=12)
    content = mesh.export(file_type=suffix)
    path = folder / f"thing.{suffix}"
    if isinstance(content, str):
        path.write_text(mutation.damaged_text(rng, content))
    else:
        path.write_bytes(mutation.damaged_bytes(rng, content))
    return path


def _database_file(rng: Rng, folder: Path) -> Path:
    text = (SHARE / "objects" / "objects.yaml").read_text()
    head, *entries = text.split("\n  - name")
    text = f"{head}\n  - name{entries[int(rng.integers(len(entries)))]}\n"
    text = text.replace("mesh: meshes/", f"mesh: {MESHES}/")
    if rng.random() < 0.1:
        text = _yaml_bomb() + text
    path = folder / "objects.yaml"
    path.write_text(mutation.damaged_text(rng, text))
    return path


def _yaml_bomb() -> str:
    lines = ["bomb:", " - &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f" - &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    return "\n".join(lines) + "\n"


def _hand_file(rng: Rng, folder: Path) -> Path:
    source = ROOT / "tests/data/parallel_gripper"
    description = (source / "gripper.yaml").read_text()
    (urdf,) = source.glob("*.urdf")
    model = urdf.read_text()
    if rng.random() < 0.5:
        description = mutation.damaged_text(rng, description)
    else:
        model = mutation.damaged_text(rng, model)
    (folder / urdf.name).write_text(model)
    (folder / "gripper.yaml").write_text(description)
    return folder / "gripper.yaml"


def _use_hand(path: Path) -> Answer:
    hand = GraspingHand.load(path)
    spheres = hand.arrays.sphere_centers, hand.arrays.sphere_radii
    return Answer(finite(*spheres, hand.effort, hand.table.limits) and spheres[1].min() > 0.0)


def _json_file(content: dict[str, Any]) -> Callable[[Rng, Path], Path]:
    def make(rng: Rng, folder: Path) -> Path:
        path = folder / "file.json"
        path.write_text(mutation.damaged_text(rng, json.dumps(content, indent=1)))
        return path

    return make


_CAMERA = {"width": 640, "height": 480, "fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5}
_POSE = {"T_table_camera": make_pose(np.eye(3), [0.1, 0.2, 0.9]).tolist(), "source": "table"}


def _use_camera(path: Path) -> Answer:
    camera = read_camera(path)
    return Answer(finite(camera.matrix) and camera.rays()[::50, ::50].max() < 1e3)


def _use_calibration(path: Path) -> Answer:
    return Answer(finite(read_calibration(path)))


@cache
def _table_text() -> str:
    from intent_perception.basics.checked_files import read_text

    lines = read_text(INFERENCE / "data" / "human.csv.gz").splitlines()
    return "\n".join(lines[:40]) + "\n"


def _table_file(rng: Rng, folder: Path) -> Path:
    import gzip

    text = _table_text()
    if rng.random() < 0.3:
        path = folder / "grasps.csv.gz"
        path.write_bytes(mutation.damaged_bytes(rng, gzip.compress(text.encode(), mtime=0)))
        return path
    path = folder / "grasps.csv"
    if rng.random() < 0.2:
        text = text.replace(",", str(rng.choice([";", "\t", "|", ", ", ",,"])))
    path.write_text(mutation.damaged_text(rng, text))
    return path


def _use_table(path: Path) -> Answer:
    table = read_grasps(path)
    known = all(np.all(np.isin(v[np.isfinite(v)], (0.0, 1.0))) for v in table.labels.values())
    small = all(np.nanmax(np.abs(v)) < 100 for n, v in table.features.items() if n != "obcl")
    fewer = 4 - len(table.labels)
    # A task whose name or header was damaged is another column; that is named by `unused`.
    return Answer(known and small and (fewer <= 0 or bool(table.unused)), left_out=fewer > 0)


def _picture_file(rng: Rng, folder: Path) -> Path:
    path = folder / f"picture.{rng.choice(['png', 'jpg'])}"
    image = rng.integers(0, 255, (60, 80, 3), dtype=np.uint8)
    np.save(folder / "image.npy", image)
    write_picture(path, image)
    content = bytearray(path.read_bytes())
    if path.suffix == ".png" and rng.random() < 0.3:
        content[16:24] = int(rng.integers(2**62)).to_bytes(8, "big")
    path.write_bytes(mutation.damaged_bytes(rng, bytes(content)))
    return path


def _use_picture(path: Path) -> Answer:
    image = read_picture(path, 1)[..., ::-1]
    true = np.load(path.parent / "image.npy")
    # JPEG has no checksum.
    return Answer(path.suffix == ".jpg" or np.array_equal(image, true))


def _cloud_file(rng: Rng, folder: Path) -> Path:
    points = rng.normal(size=(400, 3)) * 0.1
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    names = "".join(f"property float {n}\n" for n in ("x", "y", "z", "nx", "ny", "nz"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex 400\n{names}end_header\n"
    body = np.concatenate([points, normals], axis=1).astype("<f4").tobytes()
    path = folder / "cloud.ply"
    if rng.random() < 0.4:
        path.write_bytes(mutation.damaged_text(rng, head).encode() + body)
    else:
        path.write_bytes(mutation.damaged_bytes(rng, head.encode() + body))
    return path


def _use_cloud(path: Path) -> Answer:
    return Answer(finite(*read_cloud(path, "m")))


def _truth_file(rng: Rng, folder: Path) -> Path:
    content = mutation.damaged_arrays(rng, _arrays(ROOT / "bags/robot_table/truth.npz"))
    (folder / "truth.npz").write_bytes(content)
    return folder


def _use_truth(path: Path) -> Answer:
    truth_of(str(path), [])
    return Answer(True)


def _shape_file(rng: Rng, folder: Path) -> Path:
    arrays = {"hand_side": np.array("left"), "hand_shape": np.linspace(0.9, 1.1, 22)}
    (folder / "hand.npz").write_bytes(mutation.damaged_arrays(rng, arrays))
    return folder / "hand.npz"


def _use_shape(path: Path) -> Answer:
    shape = load_shape(path)
    return Answer(finite(shape) and shape.min() > 0.1 and shape.max() < 10.0)


SUBJECTS: tuple[Subject, ...] = (
    *BAG_SUBJECTS,
    Subject("model", _array_file(INFERENCE / "models" / "human.npz"), _use_model),
    Subject("grasp library", _array_file(IMITATION / "libraries" / "schunk.npz"), _use_library),
    Subject("mesh with parts", _array_file(MESHES / "mug_0.npz"), _use_mesh),
    Subject("mesh of a user", _mesh_file, _use_mesh),
    Subject("object database", _database_file, _use_database),
    Subject("robot hand", _hand_file, _use_hand),
    Subject("camera", _json_file(_CAMERA), _use_camera),
    Subject("calibration", _json_file(_POSE), _use_calibration),
    Subject("table of grasps", _table_file, _use_table),
    Subject("picture", _picture_file, _use_picture),
    Subject("point cloud", _cloud_file, _use_cloud),
    Subject("truth of a bag", _truth_file, _use_truth),
    *RESULT_SUBJECTS,
    Subject("hand shape", _shape_file, _use_shape),
)
