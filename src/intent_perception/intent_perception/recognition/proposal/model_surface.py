"""What the recogniser keeps of one model: oriented surface points, and from where each is seen."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats, set_bits
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.rasterizer import rasterize
from intent_perception.geometry.transforms import look_at
from intent_perception.objects.database import ObjectModel

_DENSE = 6000  # samples from which the surface points are chosen
_VIEW_PIXELS = 128
_NORMAL_WEIGHT = 0.02  # [diameters]: how far apart two normals at one place count in the choice


@dataclass(frozen=True, eq=False)
class ModelSurface:
    """Surface points that can be seen from outside, the first of them spread most widely."""

    points: Floats
    """(P, 3) in the object frame [m]; each prefix covers the whole surface evenly."""
    normals: Floats
    """(P, 3) unit normals out of the surface."""
    seen: NDArray[np.uint64]
    """(P,) bit v is set when the point is seen from direction v of `view_directions`."""


@cache
def view_directions() -> Array:
    """Return unit vectors (42, 3) spread evenly over the sphere (an icosahedron halved once)."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            corners += [(0.0, a, b), (a, b, 0.0), (b, 0.0, a)]
    vertices = np.array(corners)
    gaps = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    first, second = np.nonzero(np.triu(gaps < 2.1, 1))
    sphere = np.concatenate([vertices, vertices[first] + vertices[second]])
    directions: Array = sphere / np.linalg.norm(sphere, axis=1, keepdims=True)
    return directions


def surface_of(model: ObjectModel, count: int, rng: np.random.Generator) -> ModelSurface:
    """Return up to count oriented points of the model's surface that are seen from outside.

    Normals of badly wound meshes are turned to the side from which the point is seen.

    Args:
        model: the object; its mesh may be open.
        count: number of points.
        rng: draws the candidates.

    Raises:
        ValueError: if hardly anything of the mesh can be seen.
    """
    points, normals, _ = model.mesh.sample_surface(_DENSE, rng)
    front, back = _visibility(model, points, normals)
    flipped = set_bits(back) > set_bits(front)
    normals = np.where(flipped[:, None], -normals, normals)
    seen = np.where(flipped, back, front)
    kept = set_bits(seen) >= 2
    if kept.sum() < 50:
        raise ValueError(f"expected a surface seen from outside, {model.name} shows none")
    points, normals, seen = points[kept], normals[kept], seen[kept]
    features = np.concatenate([points, normals * (_NORMAL_WEIGHT * model.diameter)], axis=1)
    order = farthest_points(features.astype(np.float32), min(count, len(points)))
    return ModelSurface(
        points[order].astype(np.float32), normals[order].astype(np.float32), seen[order]
    )


def _visibility(
    model: ObjectModel, points: Array, normals: Array
) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    distance = 6.0 * model.diameter
    focal = np.float32(0.9 * _VIEW_PIXELS * distance / model.diameter)
    center = np.float32((_VIEW_PIXELS - 1) / 2.0)
    intrinsics = np.array([focal, focal, center, center], np.float32)
    front = np.zeros(len(points), np.uint64)
    back = np.zeros(len(points), np.uint64)
    scale = 1.0 / min(1.0, model.diameter)  # the rasteriser refuses what is nearer than 5 cm
    vertices = model.mesh.vertices * scale
    away = np.array([0.0, 0.0, distance * scale])
    for bit, (direction, turn) in enumerate(zip(view_directions(), _view_turns(), strict=True)):
        depth = np.empty((_VIEW_PIXELS, _VIEW_PIXELS), np.float32)
        rasterize((vertices @ turn + away).astype(np.float32), model.mesh.faces, intrinsics, depth)
        camera_points = (points * scale) @ turn + away
        pixel = np.rint(camera_points[:, :2] / camera_points[:, 2:] * focal + center).astype(int)
        pixel = np.clip(pixel, 0, _VIEW_PIXELS - 1)
        facing = normals @ direction
        # on a slope the depth changes within the pixel
        slack = scale * model.diameter * 0.02 / np.maximum(np.abs(facing), 0.2)
        visible = camera_points[:, 2] < depth[pixel[:, 1], pixel[:, 0]] + slack
        mark = np.uint64(1) << np.uint64(bit)
        front[visible & (facing > 0.2)] |= mark
        back[visible & (facing < -0.2)] |= mark
    return front, back


@cache
def _view_turns() -> Array:
    """Return R_object_camera (42, 3, 3) of cameras in the view directions that look at it."""
    turns = []
    for direction in view_directions():
        up = np.array([1.0, 0.0, 0.0]) if abs(direction[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
        turns.append(look_at(direction, np.zeros(3), up)[:3, :3])
    return np.array(turns)


@kernel
def farthest_points(features: Floats, count: int) -> NDArray[np.int64]:
    """Return indices of count rows (N, D), each the farthest from all chosen before it."""
    size, dimension = features.shape
    order = np.zeros(count, np.int64)
    gap = np.full(size, np.float32(1e9), np.float32)
    for k in range(1, count):
        last = order[k - 1]
        farthest = 0
        for i in range(size):
            distance = np.float32(0.0)
            for d in range(dimension):
                step = features[i, d] - features[last, d]
                distance += step * step
            if distance < gap[i]:
                gap[i] = distance
            if gap[i] > gap[farthest]:
                farthest = i
        order[k] = farthest
    return order
