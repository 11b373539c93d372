"""Random table-top scenes with known poses, as the simulated camera sees them: for benchmarks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at, make_pose, rotation_from_vector
from intent_perception.objects.model import ObjectModel
from intent_perception.workshop.scenes.sensor_noise import KinectNoise, observe

_TABLE_SIZE = (1.4, 1.0, 0.02)
_GAP = 0.002  # between objects that touch [m]
_COLOR_SPREAD = 0.05  # paint differs from its model by this share of each channel
_LAMP_SPREAD = 0.05  # lamp and white balance too


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object of a scene and how much of it is seen."""

    model: ObjectModel
    """What stands there."""
    T_camera_object: Array
    """(4, 4) its true pose."""
    pixels: int
    """On which it is seen."""
    visibility: float
    """Those divided by the pixels it would cover alone."""


@dataclass(frozen=True, eq=False)
class TabletopScene:
    """One frame and the truth about it."""

    frame: RgbdFrame
    """What the camera measures."""
    objects: tuple[PlacedObject, ...]
    """What is there."""
    T_table_camera: Array
    """(4, 4) camera -> table."""
    owner: NDArray[np.int16]
    """(H, W) index of the object that is seen; -1 = none."""


def tabletop_scene(
    models: Sequence[ObjectModel],
    rng: np.random.Generator,
    noise: KinectNoise | None = None,
    standing: float = 0.6,
    gaps: tuple[float, float] | None = None,
    distances: tuple[float, float] = (0.65, 1.05),
) -> TabletopScene:
    """Return a scene in which the models stand and lie close together on a table.

    The camera looks from 0.65 to 1.05 m away, 20 to 50 degrees down (issue 3).

    Args:
        models: what is on the table; the same model may come twice.
        rng: draws poses, camera, colours and noise.
        noise: of the camera; None = its defaults.
        standing: probability that an object is in its first (natural) resting pose.
        gaps: least and largest distance between neighbours [m]; None = most of them touch.
        distances: of the camera, least and largest [m].
    """
    poses = placed_together(models, rng, standing, gaps)
    distance, down = rng.uniform(*distances), np.radians(rng.uniform(20.0, 50.0))
    turn = rng.uniform(0.0, 2.0 * np.pi)
    ground = np.array([np.cos(turn), np.sin(turn)]) * np.cos(down)
    eye = distance * np.array([*ground, np.sin(down)])
    target = np.array([*rng.uniform(-0.03, 0.03, 2), 0.04])
    T_table_camera = look_at(eye, target, np.array([0.0, 0.0, 1.0]))
    T_camera_table = inverse(T_table_camera)
    table = _box(np.array(_TABLE_SIZE), np.array([0.0, 0.0, -_TABLE_SIZE[2] / 2.0]))
    meshes = [table, *(m.mesh for m in models)]
    placed = np.stack([T_camera_table, *(T_camera_table @ T for T in poses)])
    lamp = 1.0 + rng.normal(0.0, _LAMP_SPREAD, 3)
    base = np.array([rng.uniform(0.25, 0.8, 3), *(m.color for m in models)])
    paint = 1.0 + rng.normal(0.0, _COLOR_SPREAD, base.shape)
    colors = np.clip(base * paint * lamp, 0.02, 1.0)
    full = render(KINECT, meshes, placed, colors)
    objects = []
    for k, model in enumerate(models):
        alone = render(KINECT, [model.mesh], placed[k + 1][None], colors[k + 1][None])
        pixels, whole = int(np.sum(full.label == k + 1)), int(np.sum(alone.label == 0))
        objects.append(PlacedObject(model, placed[k + 1], pixels, pixels / max(whole, 1)))
    assert full.color is not None
    depth, color = observe(full.depth, full.color, rng, noise or KinectNoise())
    owner = np.maximum(full.label - 1, -1).astype(np.int16)
    return TabletopScene(RgbdFrame(0, color, depth, KINECT), tuple(objects), T_table_camera, owner)


def placed_together(
    models: Sequence[ObjectModel],
    rng: np.random.Generator,
    standing: float,
    gaps: tuple[float, float] | None = None,
) -> list[Array]:
    """Return T_table_object of each model; each but the first is pushed towards the middle."""
    poses: list[Array] = []
    outlines: list[Array] = []
    for model in models:
        stable = model.stable_poses
        first = len(stable) == 1 or rng.random() < standing
        rest = stable[0 if first else rng.integers(1, len(stable))]
        turn = make_pose(
            rotation_from_vector(np.array([0.0, 0.0, rng.uniform(0.0, 2.0 * np.pi)])), np.zeros(3)
        )
        T_table_object = turn @ rest
        flat = (model.mesh.vertices @ T_table_object[:2, :3].T) + T_table_object[:2, 3]
        outline = _convex_outline(flat)
        middle = outline.mean(axis=0)
        outline = outline - middle
        T_table_object = make_pose(T_table_object[:3, :3], T_table_object[:3, 3] - [*middle, 0.0])
        angle = rng.uniform(0.0, 2.0 * np.pi)
        direction = np.array([np.cos(angle), np.sin(angle)])
        reach = 0.0
        if poses:
            if gaps is None:
                gap = _GAP if rng.random() < 0.6 else rng.uniform(0.005, 0.06)
            else:
                gap = rng.uniform(*gaps)
            # pushed in from far away until it touches
            reach = 0.6
            while reach > 0.0 and not any(
                _overlap(outline + (reach - 0.004) * direction, other, gap) for other in outlines
            ):
                reach -= 0.004
        offset = reach * direction
        outlines.append(outline + offset)
        poses.append(make_pose(T_table_object[:3, :3], T_table_object[:3, 3] + [*offset, 0.0]))
    middle = np.mean([o.mean(axis=0) for o in outlines], axis=0)
    return [
        make_pose(T_table_object[:3, :3], T_table_object[:3, 3] - [*middle, 0.0])
        for T_table_object in poses
    ]


def _convex_outline(points: NDArray[np.float64]) -> Array:
    return np.asarray(points[ConvexHull(points).vertices])


def _overlap(a: Array, b: Array, gap: float) -> bool:
    """Return whether two convex outlines (N, 2) are nearer than gap, by separating axes."""
    for corners in (a, b):
        edges = np.roll(corners, -1, axis=0) - corners
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        of_a, of_b = a @ normals.T, b @ normals.T
        apart = np.maximum(of_b.min(axis=0) - of_a.max(axis=0), of_a.min(axis=0) - of_b.max(axis=0))
        if apart.max() > gap:
            return False
    return True


def _box(size: Array, center: Array) -> Mesh:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return convex_hull(corners * size + center)
