"""Two objects that are not in the shipped database: what a user would add by a YAML entry."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import yaml

from intent_perception.basics.safe_files import write_text
from intent_perception.objects.families.designed_object import AXIS, NOTHING, DesignedObject, finish
from intent_perception.objects.families.solids import (
    loft,
    loft_parts,
    rings_of,
    rounded,
    row,
    sweep,
    union,
    vessel,
)
from intent_perception.objects.loading import write_parts
from intent_perception.objects.model import Functions, ObjectModel, Opening


def own_models() -> tuple[ObjectModel, ...]:
    """Return a bellied cup with a round ear and a dressing bottle."""
    return finish(_cup(), "my_mug", "mug"), finish(_flask(), "my_bottle", "bottle")


def _cup() -> DesignedObject:
    profile = [(0.0, 0.031), (0.004, 0.035), (0.035, 0.0385), (0.075, 0.0400), (0.108, 0.0415)]
    sections = rounded([row(z, r) for z, r in profile])
    body = vessel(sections, 0.004, 0.006)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 29)
    wall = np.interp([0.024, 0.080], sections[:, 0], sections[:, 3]) - 0.0022
    x = np.linspace(wall[0], wall[1], 29) + 0.034 * np.cos(angle) ** 0.8
    rings = sweep(np.stack([x, 0.052 + 0.028 * np.sin(angle)], axis=1), 0.0048, 0.0075)
    parts = list(body.parts)
    for start in range(0, 28, 4):
        parts += loft_parts("handle", rings[start : start + 5, ::2], 0.2)
    return DesignedObject(
        mesh=union([body.mesh, loft(rings)]),
        parts=tuple(parts),
        functions=_poured_from(0.108, body.radius, ("handle",)),
        symmetry=NOTHING, mass=0.31, friction=0.6, color=(0.62, 0.24, 0.52), upright=True,
    )  # fmt: skip


def _flask() -> DesignedObject:
    profile = [(0.0, 0.033), (0.005, 0.036), (0.080, 0.0345), (0.120, 0.030), (0.150, 0.0165),
               (0.175, 0.0145), (0.180, 0.0175), (0.200, 0.0170)]  # fmt: skip
    sections = rounded([row(z, r) for z, r in profile])
    rings, coarse = rings_of(sections), rings_of(sections, 24)
    cuts = [0, *np.searchsorted(sections[:, 0], [0.118, 0.155]).tolist(), len(rings) - 1]
    parts = []
    for name, low, high in zip(("body", "shoulder", "neck"), cuts[:-1], cuts[1:], strict=True):
        parts += loft_parts(name, coarse[low : high + 1])
    return DesignedObject(
        mesh=loft(rings), parts=tuple(parts), functions=_poured_from(0.200, 0.015, ()),
        symmetry=AXIS, mass=0.45, friction=0.6, color=(0.75, 0.55, 0.15), upright=True,
    )  # fmt: skip


def _poured_from(height: float, radius: float, handle: tuple[str, ...]) -> Functions:
    opening = Opening(np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]), radius)
    return Functions(opening=opening, handle=handle)


def write_models(folder: Path, models: Iterable[ObjectModel]) -> None:
    """Write `models.yaml` and the meshes that it names into a bag's folder."""
    entries = []
    for model in models:
        write_parts(folder / f"{model.name}.npz", model)
        entries.append({
            "name": model.name, "class": model.object_class, "mesh": f"{model.name}.npz",
            "unit": "m", "color": [float(c) for c in model.color],
        })  # fmt: skip
    text = yaml.safe_dump({"only": True, "objects": entries}, sort_keys=False)
    write_text(folder / "models.yaml", text)
