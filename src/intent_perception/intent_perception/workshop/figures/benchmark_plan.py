"""What the benchmark of recognition is measured on: scenes, files and how they are compared."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_text
from intent_perception.geometry.transforms import inverse, rotation_angle
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.workshop.scenes.table_scenes import TabletopScene, tabletop_scene

CLASSES = ("bottle", "glass", "mug", "knife", "hammer", "screwdriver")


@dataclass(frozen=True)
class Plan:
    """How much is measured."""

    seed: int
    """Of the first scene; scenes below 1000 are for development."""
    scenes: int
    """Scenes with known objects, of each size of the library."""
    empty: int
    """Scenes with none of the models."""
    scans: int
    """Seeds with which the laser scan is searched."""
    data: Path
    """Folder of the real data."""
    pictures: Path | None
    """Where pictures are written, if anywhere."""


def scenes(
    plan: Plan, models: Sequence[ObjectModel], clutter: Sequence[ObjectModel]
) -> Iterator[tuple[int, TabletopScene]]:
    """Yield seed and scene: first 1 to 6 of the models each, then clutter alone."""
    for first, count, things in ((0, plan.scenes, models), (500, plan.empty, clutter)):
        for index in range(count):
            seed = plan.seed + first + index
            rng = np.random.default_rng(seed)
            chosen = rng.choice(len(things), min(1 + index % 6, len(things)), replace=False)
            yield seed, tabletop_scene([things[k] for k in chosen], rng)


def pose_difference(T_true: Array, T_found: Array, center: Array) -> tuple[float, float]:
    """Return the distance between the placed centres [m] and the angle between two poses [rad]."""
    difference = inverse(T_true) @ T_found
    shift = np.linalg.norm(difference[:3, :3] @ center + difference[:3, 3] - center)
    return float(shift), float(rotation_angle(difference[:3, :3]))


def file_database(folder: Path, files: dict[str, str], unit: str) -> ObjectDatabase:
    """Return the objects of mesh files: name -> file in a folder, all in one unit."""
    entries = [
        {"name": name, "mesh": str((folder / file).resolve()), "unit": unit, "class": name}
        for name, file in files.items()
    ]
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "objects.yaml"
        write_text(path, yaml.safe_dump({"only": True, "objects": entries}))
        return ObjectDatabase.load(path)
