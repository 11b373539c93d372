"""Scenes of things that are in no database: drawn anew, made by artists, scanned by others."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh, read_mesh
from intent_perception.objects.families.designed_object import (
    AXIS,
    NOTHING,
    DesignedObject,
    finish,
)
from intent_perception.objects.model import Functions, ObjectModel
from intent_perception.workshop.scenes.sensor_noise import KinectNoise
from intent_perception.workshop.scenes.table_scenes import TabletopScene, tabletop_scene
from intent_perception.workshop.things.unseen_things import OF_CLASS, unseen_thing

_GAPS = (0.02, 0.10)
_DISTANCES = (0.60, 1.05)
_STANDING = 0.8
_NONE = 0.36  # share of things that belong to no class
_FROM_FILE = 0.35
HELD_BACK = 1000
"""From this seed on all files are used, below it every second one."""
_UP = {
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
FILES: dict[str, tuple[tuple[str, str], ...]] = {
    "bottle": (
        ("sweethome3d/blendswapcc0_mamadeira.obj", "y"),
        ("sweethome3d/blendswapcc0_yogurtBottle.obj", "y"),
        ("sweethome3d/blendswapccby_beer_bottle.obj", "y"),
        ("sweethome3d/katorlegaz_red-wine-bottle-01.obj", "y"),
        ("sweethome3d/scopia_medicoscopia_bottle.obj", "y"),
        ("sweethome3d/scopia_wine_bottle.obj", "y"),
        ("sweethome3d/scopia_medicoscopia_bottle2.obj", "y"),
        ("contactdb_object_sim/waterbottle.stl", "z"),
    ),
    "glass": (
        ("sweethome3d/blendswapcc0_plasticCup.obj", "y"),
        ("sweethome3d/blendswapccby_cocktailGlass.obj", "y"),
        ("sweethome3d/blendswapccby_glass.obj", "y"),
        ("sweethome3d/katorlegaz_12-oz-glass.obj", "y"),
        ("sweethome3d/katorlegaz_highball-glass.obj", "y"),
        ("sweethome3d/split_katorlegaz_glass13.obj", "y"),
        ("sweethome3d/split_scopia_watercup.obj", "y"),
        ("sweethome3d/split_scopia_winecup.obj", "y"),
        ("contactdb_object_sim/cup.stl", "z"),
        ("contactdb_object_sim/wineglass.stl", "z"),
    ),
    "mug": (
        ("sweethome3d/katorlegaz_coffee-mug.obj", "y"),
        ("contactdb_object_sim/coffeemug.stl", "z"),
        ("ycb_bop/025_mug.ply", "z"),
    ),
    "knife": (
        ("sweethome3d/blendswapccby_kitchenKnife.obj", "y"),
        ("sweethome3d/blendswapccby_knife.obj", "y"),
        ("sweethome3d/split_cc0_chefknife.obj", "y"),
        ("sweethome3d/split_cc0_cleaver.obj", "y"),
        ("sweethome3d/split_cc0_utilityknife.obj", "y"),
        ("sweethome3d/split_katorlegaz_tableknife.obj", "y"),
        ("sweethome3d/split_scopia_tableknife.obj", "y"),
        ("contactdb_object_sim/knife.stl", "y"),
    ),
    "hammer": (
        ("sweethome3d/scopia_marteau.obj", "x"),
        ("contactdb_object_sim/hammer.stl", "x"),
    ),
    "screwdriver": (("sweethome3d/scopia_tournevis.obj", "x"),),
    "": (
        ("contactdb_object_sim/apple.stl", "z"),
        ("contactdb_object_sim/banana.stl", "z"),
        ("contactdb_object_sim/camera.stl", "z"),
        ("contactdb_object_sim/flashlight.stl", "z"),
        ("contactdb_object_sim/fryingpan.stl", "z"),
        ("contactdb_object_sim/lightbulb.stl", "x"),
        ("contactdb_object_sim/phone.stl", "z"),
        ("contactdb_object_sim/scissors.stl", "z"),
        ("contactdb_object_sim/stapler.stl", "z"),
        ("contactdb_object_sim/teapot.stl", "z"),
        ("contactdb_object_sim/toothpaste.stl", "z"),
        ("sweethome3d/blendswapcc0_tetrapak.obj", "y"),
        ("sweethome3d/blendswapccby_fork.obj", "y"),
        ("sweethome3d/blendswapccby_spoon.obj", "y"),
        ("ycb_bop/002_master_chef_can.ply", "z"),
        ("ycb_bop/003_cracker_box.ply", "z"),
        ("ycb_bop/004_sugar_box.ply", "z"),
        ("ycb_bop/005_tomato_soup_can.ply", "z"),
        ("ycb_bop/007_tuna_fish_can.ply", "z"),
        ("ycb_bop/010_potted_meat_can.ply", "z"),
        ("ycb_bop/024_bowl.ply", "z"),
        ("ycb_bop/035_power_drill.ply", "z"),
        ("ycb_bop/036_wood_block.ply", "z"),
        ("ycb_bop/040_large_marker.ply", "y"),
        ("ycb_bop/061_foam_brick.ply", "z"),
    ),
}
"""Meshes of others by class: the file, and which of its axes is up, or along a tool."""
STANDING = ("bottle", "glass", "mug")


def unseen_scene(seed: int, meshes: Path | None) -> TabletopScene:
    """Return the scene of a seed.

    Args:
        seed: of everything in it.
        meshes: folder with the meshes of others, None = only drawn things.
    """
    rng = np.random.default_rng(seed)
    things = [_thing(seed, k, meshes, rng) for k in range(int(rng.integers(2, 6)))]
    return household_scene(things, rng)


def household_scene(things: list[ObjectModel], rng: np.random.Generator) -> TabletopScene:
    """Return a scene of some things that stand apart, before a camera with more or less noise."""
    strength = rng.uniform(0.5, 1.2)
    noise = KinectNoise()
    noise = replace(
        noise,
        axial_floor=strength * noise.axial_floor,
        axial_growth=strength * noise.axial_growth,
        nearest=0.2,
    )
    return tabletop_scene(things, rng, noise, _STANDING, _GAPS, _DISTANCES)


def _thing(seed: int, number: int, meshes: Path | None, rng: np.random.Generator) -> ObjectModel:
    kind = "" if rng.random() < _NONE else str(rng.choice(list(OF_CLASS)))
    name = f"thing_{number}"
    if meshes is None or rng.random() >= _FROM_FILE:
        return unseen_thing(kind, rng, name)
    files = FILES[kind] if seed >= HELD_BACK else FILES[kind][::2]
    file, up = files[rng.integers(len(files))]
    scale = rng.uniform(0.92, 1.08)
    return foreign_thing(meshes / file, up, kind, name, rng.uniform(0.1, 0.95, 3), scale)


def foreign_thing(
    path: Path, up: str, kind: str, name: str, color: Array, scale: float | Array = 1.0
) -> ObjectModel:
    """Return the thing of a mesh file, with the given axis of it as z; scales may be of x, y, z."""
    mesh, _ = read_mesh(path)
    turned = Mesh(scale * mesh.vertices @ _UP[up].T, mesh.faces)
    red, green, blue = (float(value) for value in color)
    draft = DesignedObject(
        mesh=turned,
        parts=(),
        functions=Functions(),
        symmetry=AXIS if kind in ("bottle", "glass") else NOTHING,
        mass=0.3,
        friction=0.5,
        color=(red, green, blue),
        upright=kind in STANDING or kind == "",
    )
    return finish(draft, name, kind)
