"""Scenes that the odds of the classes are fitted to, besides those of seeds below 1000.

Nothing of them is in a benchmark: numbers come from another stream of random numbers, of the mesh
files of others only those are used that seeds below 1000 use, and a few that no benchmark uses.
"""

from pathlib import Path

import numpy as np

from intent_perception.objects.model import ObjectModel
from intent_perception.workshop.scenes.table_scenes import TabletopScene
from intent_perception.workshop.scenes.unseen_scenes import FILES, foreign_thing, household_scene
from intent_perception.workshop.things.odd_things import odd_thing
from intent_perception.workshop.things.unseen_things import OF_CLASS, unseen_thing

_STREAM = 14
_NONE = 0.45  # share of things that belong to no class
_FROM_FILE = 0.35
_ODD = 0.7  # of the drawn things of no class
_STRETCH = (0.86, 1.16)  # of a file's thing along each axis
_MORE: dict[str, tuple[tuple[str, str], ...]] = {
    "mug": (("sweethome3d/blendswapcc0_beerGlass.obj", "y"),),
    "knife": tuple((f"sweethome3d/split_scopia_blockknife{k}.obj", "y") for k in range(1, 6)),
    "": (
        ("contactdb_object_sim/bowl.stl", "z"),
        ("contactdb_object_sim/eyeglasses.stl", "z"),
        ("contactdb_object_sim/toothbrush.stl", "z"),
        ("sweethome3d/blendswapcc0_cissors_swap.obj", "y"),
        ("sweethome3d/scopia_perceuse-electrique.obj", "y"),
        ("sweethome3d/scopia_teapot.obj", "y"),
    ),
}
"""Files that no benchmark shows, as in FILES."""


def training_scene(number: int, meshes: Path | None) -> TabletopScene:
    """Return a scene to fit to.

    Args:
        number: of the scene, from 0 on.
        meshes: folder with the meshes of others, None = only drawn things.
    """
    rng = np.random.default_rng([_STREAM, number])
    things = [_thing(k, meshes, rng) for k in range(int(rng.integers(2, 6)))]
    return household_scene(things, rng)


def _thing(number: int, meshes: Path | None, rng: np.random.Generator) -> ObjectModel:
    kind = "" if rng.random() < _NONE else str(rng.choice(list(OF_CLASS)))
    name = f"thing_{number}"
    if meshes is not None and rng.random() < _FROM_FILE:
        files = FILES[kind][::2] + _MORE.get(kind, ())
        file, up = files[rng.integers(len(files))]
        color, stretch = rng.uniform(0.1, 0.95, 3), rng.uniform(*_STRETCH, 3)
        return foreign_thing(meshes / file, up, kind, name, color, stretch)
    if not kind and rng.random() < _ODD:
        return odd_thing(rng, name)
    return unseen_thing(kind, rng, name)
