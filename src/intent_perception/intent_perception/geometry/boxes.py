"""Box decomposition: an object as a few boxes (BADGr, reference [10] of the paper).

A box of least volume around the surface points is cut across one of its axes where the boxes of
the two halves save most volume, and so on, as long as a cut shrinks the volume to less than `gain`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from intent_perception.basics.arrays import Array, Mask
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import rotation_from_vector

_SAMPLES = 2000
_DIRECTIONS = 48  # candidate directions for the first axis of a box
_TURNS = np.deg2rad(np.arange(0.0, 90.0, 3.0))
_REFINEMENTS = np.deg2rad([2.0, 1.0, 0.5, 0.25])
_CUTS = np.arange(0.06, 0.95, 0.04)
_THINNEST = 0.0005  # flat boxes are given this half thickness [m]


@dataclass(frozen=True, eq=False)
class Box:
    """A box in the object frame."""

    center: Array
    """(3,) [m]."""
    rotation: Array
    """(3, 3) R_object_box: its columns are the directions of the edges."""
    half_size: Array
    """(3,) half edges along those [m]."""

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return float(8.0 * np.prod(self.half_size))

    def contains(self, points: Array, slack: float = 0.0) -> Mask:
        """Return whether points (N, 3) lie in the box grown by a slack [m]."""
        local = np.abs((points - self.center) @ self.rotation)
        inside: Mask = np.all(local <= self.half_size + slack, axis=1)
        return inside


def decompose(
    shape: Array | Mesh, gain: float = 0.9, levels: int = 3, least_share: float = 0.04
) -> tuple[Box, ...]:
    """Return boxes that together hold an object, the one with most of the surface first.

    Args:
        shape: mesh, or points (N, 3) spread evenly over the surface, object frame [m].
        gain: a cut is made if it leaves less than this share of the volume, 0..1.
        levels: greatest number of cuts one inside the other; at most 2^levels boxes.
        least_share: no box holds less than this share of the points.

    Raises:
        ValueError: if there are fewer than four points.
    """
    if isinstance(shape, Mesh):
        points = shape.sample_surface(_SAMPLES, np.random.default_rng(0))[0]
    else:
        points = np.asarray(shape, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise ValueError(f"expected at least four points (N, 3), got {points.shape}")
    fewest = max(4, int(least_share * len(points)))
    pieces = _split(points, minimum_volume_box(points), gain, levels, fewest)
    pieces.sort(key=lambda piece: -piece[0])
    return tuple(box for _, box in pieces)


def minimum_volume_box(points: Array) -> Box:
    """Return a box of about least volume around points (N, 3) [m].

    One axis is tried along the normals of the convex hull's largest facets and along the principal
    axes, the others in steps of 3° around it; the best is refined to 0.25°.
    """
    corners, directions = _hull(points)
    frames = _frames(directions)
    best = frames[int(np.argmin(_volumes(corners, frames)))]
    for step in _REFINEMENTS:
        turns = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
        for _ in range(4):
            nearby = best @ rotation_from_vector(turns)
            choice = int(np.argmin(_volumes(corners, nearby)))
            if choice == 0:
                break
            best = nearby[choice]
    local = corners @ best
    low, high = local.min(axis=0), local.max(axis=0)
    half = np.maximum(0.5 * (high - low), _THINNEST)
    return Box(best @ (0.5 * (low + high)), best, half)


def _split(points: Array, box: Box, gain: float, levels: int, fewest: int) -> list[tuple[int, Box]]:
    whole = [(len(points), box)]
    if levels == 0 or len(points) < 2 * fewest:
        return whole
    local = (points - box.center) @ box.rotation
    best: tuple[float, Mask, Box, Box] | None = None
    for axis in range(3):
        below = _best_cut(local, axis, box.half_size[axis], fewest)
        if below is None:
            continue
        first, second = minimum_volume_box(points[below]), minimum_volume_box(points[~below])
        volume = first.volume + second.volume
        if best is None or volume < best[0]:
            best = volume, below, first, second
    if best is None or best[0] >= gain * box.volume:
        return whole
    _, below, first, second = best
    pieces = _split(points[below], first, gain, levels - 1, fewest)
    return pieces + _split(points[~below], second, gain, levels - 1, fewest)


def _best_cut(local: Array, axis: int, half: float, fewest: int) -> Mask | None:
    """Return which points (N,) lie below the cut with the smallest parallel boxes."""
    best = np.inf
    chosen: Mask | None = None
    for share in _CUTS:
        below = local[:, axis] < (2.0 * share - 1.0) * half
        count = int(below.sum())
        if count < fewest or len(local) - count < fewest:
            continue
        volume = float(
            np.prod(np.ptp(local[below], axis=0)) + np.prod(np.ptp(local[~below], axis=0))
        )
        if volume < best:
            best, chosen = volume, below
    return chosen


def _hull(points: Array) -> tuple[Array, Array]:
    """Return the hull's corners (V, 3) and the directions (D, 3) to try as an axis."""
    center = points.mean(axis=0)
    principal = np.linalg.svd(points - center, full_matrices=False)[2]
    try:
        hull = ConvexHull(points)
    except QhullError:  # flat or straight
        return points, principal
    triangles = points[hull.simplices]
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    normals = hull.equations[:, :3]
    normals = normals * np.where(normals @ [0.31, 0.53, 0.79] < 0.0, -1.0, 1.0)[:, None]
    # Facets of nearly one direction count together.
    keys, index = np.unique(np.round(normals * 12.0), axis=0, return_inverse=True)
    weights = np.bincount(index.ravel(), weights=area, minlength=len(keys))
    sums = np.stack(
        [np.bincount(index.ravel(), weights=area * normals[:, k]) for k in range(3)], axis=1
    )
    largest = np.argsort(-weights, kind="stable")[:_DIRECTIONS]
    chosen = sums[largest]
    chosen /= np.maximum(np.linalg.norm(chosen, axis=1, keepdims=True), 1e-12)
    return points[hull.vertices], np.concatenate([principal, chosen])


def _frames(directions: Array) -> Array:
    """Return rotations (K, 3, 3) whose last column is a direction, turned about it in steps."""
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    first = np.cross(directions, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(directions, first)
    cosine, sine = np.cos(_TURNS)[:, None, None], np.sin(_TURNS)[:, None, None]
    x = cosine * first + sine * second
    y = cosine * second - sine * first
    z = np.broadcast_to(directions, x.shape)
    return np.stack([x, y, z], axis=3).reshape(-1, 3, 3)


def _volumes(corners: Array, frames: Array) -> Array:
    """Return the volumes (K,) of the boxes around corners (V, 3) in frames (K, 3, 3)."""
    local = corners @ frames.transpose(1, 0, 2).reshape(3, -1)
    extent = np.maximum(np.ptp(local, axis=0).reshape(-1, 3), 2.0 * _THINNEST)
    volumes: Array = np.prod(extent, axis=1)
    return volumes
