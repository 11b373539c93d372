"""Write the shipped object database: 6 classes x 8 objects, and the clutter.

python -m intent_perception.parametric [--out FOLDER]
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from intent_perception.basics.arrays import Array
from intent_perception.basics.late_module import need
from intent_perception.basics.safe_files import write_text
from intent_perception.geometry.transforms import vector_from_pose
from intent_perception.objects.database import CLUTTER, SHIPPED
from intent_perception.objects.families.designed_object import finish
from intent_perception.objects.loading import write_parts
from intent_perception.objects.model import Functions, ObjectModel
from intent_perception.workshop.things.clutter import CLUTTER_MAKERS
from intent_perception.workshop.things.hammers import HAMMERS
from intent_perception.workshop.things.knives import KNIVES
from intent_perception.workshop.things.screwdrivers import SCREWDRIVERS
from intent_perception.workshop.things.vessels import BOTTLES, GLASSES, MUGS

MAKERS = {
    "bottle": BOTTLES,
    "glass": GLASSES,
    "mug": MUGS,
    "knife": KNIVES,
    "hammer": HAMMERS,
    "screwdriver": SCREWDRIVERS,
}
"""Makers of the eight objects of each class."""


def make_objects() -> list[ObjectModel]:
    """Return the 48 objects, named class_0 to class_7."""
    return [
        finish(make(), f"{object_class}_{index}", object_class)
        for object_class, makers in MAKERS.items()
        for index, make in enumerate(makers)
    ]


def make_clutter() -> list[ObjectModel]:
    """Return the clutter; each thing is its own class."""
    return [finish(make(), make.__name__, make.__name__) for make in CLUTTER_MAKERS]


def write_database(models: list[ObjectModel], file: Path) -> None:
    """Write models as a database file and a folder of meshes beside it."""
    folder = file.parent / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    for model in models:
        write_parts(folder / f"{model.name}.npz", model)
    lines = ["# Written by `python -m intent_perception.parametric`. Lengths in m.", "objects:"]
    for model in models:
        entry = yaml.safe_dump(_entry(model), sort_keys=False, default_flow_style=None, width=1000)
        indented = entry.rstrip().replace("\n", "\n    ")
        lines.append(f"  - {indented}")
    write_text(file, "\n".join(lines) + "\n")


def _entry(model: ObjectModel) -> dict[str, Any]:
    symmetry: dict[str, Any] = {}
    if model.symmetry.axis is not None:
        symmetry["axis"] = _numbers(model.symmetry.axis)
    if model.symmetry.turns:
        symmetry["turns"] = [_numbers(vector_from_pose(turn)) for turn in model.symmetry.turns]
    return {
        "name": model.name,
        "class": model.object_class,
        "mesh": f"meshes/{model.name}.npz",
        "unit": "m",
        "color": _numbers(model.color),
        "mass": model.mass,
        "friction": model.friction,
        "functions": _functions(model.functions or Functions()),
        "symmetry": symmetry,
        "stable_poses": [_numbers(vector_from_pose(pose)) for pose in model.stable_poses],
    }


def _functions(functions: Functions) -> dict[str, Any]:
    stored: dict[str, Any] = {}
    for name in ("opening", "edge", "face"):
        function = getattr(functions, name)
        if function is not None:
            values = vars(function).items()
            stored[name] = {key: _numbers(value) for key, value in values}
    if functions.tip is not None:
        stored["tip"] = _numbers(functions.tip)
    for name in ("handle", "functional"):
        if getattr(functions, name):
            stored[name] = list(getattr(functions, name))
    return stored


def _numbers(values: Array | float) -> Any:
    """Return plain numbers, rounded to a micrometre (or microradian)."""
    return (np.round(np.asarray(values, dtype=np.float64), 6) + 0.0).tolist()


def main() -> None:
    """Write objects.yaml, clutter.yaml and meshes/ into a folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=SHIPPED.parent, help="folder to write to")
    folder = parser.parse_args().out
    need("manifold3d")
    write_database(make_objects(), folder / SHIPPED.name)
    write_database(make_clutter(), folder / CLUTTER.name)
