"""Tables as cameras see them that nobody mounted with care: from above, rolled, on a head.

Tables are large and small, bare wood or under a cloth with folds, partly covered, with a floor
below and a wall behind, and now and then an arm reaches over them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at, make_pose, rotation_from_vector
from intent_perception.objects.model import ObjectModel
from intent_perception.workshop.scenes.sensor_noise import observe
from intent_perception.workshop.scenes.table_scenes import placed_together

Placement = Literal["facing", "above", "quarter", "upside_down", "head"]
PLACEMENTS: tuple[Placement, ...] = get_args(Placement)
_MOST_THINGS = 5
_TABLE_HEIGHT = 0.72  # above the floor [m]
_FOLDS = 0.003  # height of a cloth's folds [m]


@dataclass(frozen=True, eq=False)
class TableView:
    """A frame of a table and where the camera truly is."""

    frame: RgbdFrame
    T_table_camera: Array
    """(4, 4) camera -> table."""
    placement: Placement


def table_views(seed: int, count: int, models: Sequence[ObjectModel]) -> Iterator[TableView]:
    """Yield so many views of tables, each placement in turn, the first with this seed."""
    for number in range(count):
        rng = np.random.default_rng(seed + number)
        yield table_view(PLACEMENTS[number % len(PLACEMENTS)], models, rng)


def table_view(
    placement: Placement, models: Sequence[ObjectModel], rng: np.random.Generator
) -> TableView:
    """Return a table with 1 to 5 of the models on it, seen by a camera of some placement."""
    chosen = rng.choice(len(models), rng.integers(1, _MOST_THINGS + 1), replace=False)
    things = [models[k] for k in chosen]
    T_table_camera = _camera(placement, rng)
    size = np.array([rng.uniform(0.45, 1.4), rng.uniform(0.4, 1.0)])
    room = [_top(size, rng.random() < 0.3, rng)]
    if rng.random() < 0.6:
        room.append(_box([4.0, 4.0, 0.02], [0.0, 0.0, -_TABLE_HEIGHT]))
    away = -T_table_camera[:2, 3] / max(float(np.linalg.norm(T_table_camera[:2, 3])), 1e-9)
    wall = rng.random() < 0.5
    if wall:
        turn = make_pose(
            rotation_from_vector([0.0, 0.0, np.arctan2(away[1], away[0])]), np.zeros(3)
        )
        behind = 0.5 * float(np.linalg.norm(size)) + rng.uniform(0.02, 0.5)
        room.append(_box([0.02, 4.0, 3.0], [behind, 0.0, 0.5]).transformed(turn))
    if rng.random() < 0.4 and (placement == "head" or not wall):
        room.append(_arm(placement, T_table_camera, rng))
    T_camera_table = inverse(T_table_camera)
    poses = [np.eye(4)] * len(room) + placed_together(things, rng, 0.6)
    meshes = [*room, *(thing.mesh for thing in things)]
    colors = np.array([*rng.uniform(0.2, 0.8, (len(room), 3)), *(m.color for m in things)])
    placed = np.stack([T_camera_table @ T for T in poses])
    seen = render(KINECT, meshes, placed, colors)
    assert seen.color is not None
    depth, color = observe(seen.depth, seen.color, rng)
    return TableView(RgbdFrame(0, color, depth, KINECT), T_table_camera, placement)


def _camera(placement: Placement, rng: np.random.Generator) -> Array:
    """Return T_table_camera (4, 4) of a placement."""
    low, high = {"above": (75.0, 90.0), "head": (40.0, 65.0)}.get(placement, (20.0, 50.0))
    near, far = (0.5, 0.8) if placement == "head" else (0.65, 1.05)
    down, turn = np.radians(rng.uniform(low, high)), rng.uniform(0.0, 2.0 * np.pi)
    sideways = np.cos(down) * np.array([np.cos(turn), np.sin(turn)])
    eye = rng.uniform(near, far) * np.array([*sideways, np.sin(down)])
    target = np.array([*rng.uniform(-0.05, 0.05, 2), 0.04])
    top = np.array([0.0, 0.0, 1.0]) - np.array(
        [*sideways, 0.0]
    )  # also where it looks straight down
    T_table_camera = look_at(eye, target, top)
    roll = {
        "above": rng.uniform(-180.0, 180.0),
        "quarter": rng.choice([-90.0, 90.0]) + rng.normal(0.0, 5.0),
        "upside_down": 180.0 + rng.normal(0.0, 5.0),
        "head": rng.normal(0.0, 10.0),
    }.get(placement, 0.0)
    turned = rotation_from_vector([0.0, 0.0, np.radians(roll)])
    return T_table_camera @ make_pose(turned, np.zeros(3))


def _top(size: Array, cloth: bool, rng: np.random.Generator) -> Mesh:
    """Return a table top of a size (2,), its upper side at z = 0, of wood or cloth with folds."""
    if not cloth:
        return _box([*size, 0.02], [0.0, 0.0, -0.01])
    steps = 40
    x, y = (np.linspace(-0.5 * edge, 0.5 * edge, steps) for edge in size)
    u, v = np.meshgrid(x, y, indexing="ij")
    z = np.zeros_like(u)
    for _ in range(4):
        angle, length = rng.uniform(0.0, np.pi), rng.uniform(0.08, 0.3)
        along = np.cos(angle) * u + np.sin(angle) * v
        z += 0.5 * _FOLDS * np.sin(2.0 * np.pi * along / length + rng.uniform(0.0, 2.0 * np.pi))
    z -= z.mean()
    corner = np.arange(steps * steps).reshape(steps, steps)
    a, b, c, d = (
        k.ravel() for k in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh.of(np.stack([u, v, z], axis=-1).reshape(-1, 3), faces)


def _arm(placement: Placement, T_table_camera: Array, rng: np.random.Generator) -> Mesh:
    """Return an arm over the table: of the wearer of a head camera, else of somebody else."""
    eye = T_table_camera[:2, 3]
    toward = np.arctan2(eye[1], eye[0]) + (0.0 if placement == "head" else np.pi)
    angle = toward + rng.uniform(-0.6, 0.6)
    direction = np.array([np.cos(angle), np.sin(angle), 0.25])
    start = np.array([*rng.uniform(-0.12, 0.12, 2), rng.uniform(0.05, 0.12)])
    side = np.array([-direction[1], direction[0], 0.0])
    ends = np.stack([start, start + 0.6 * direction])
    ring = [
        s * 0.04 * side + t * 0.035 * np.array([0.0, 0.0, 1.0]) for s in (-1, 1) for t in (-1, 1)
    ]
    return convex_hull(np.concatenate([ends + corner for corner in ring]))


def _box(size: Sequence[float], center: Sequence[float]) -> Mesh:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return convex_hull(corners * np.array(size) + np.array(center))
