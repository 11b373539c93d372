"""Convex parts of any mesh: plane cuts that shrink the sum of the convex hulls most."""

import heapq
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from intent_perception.geometry import Array
from intent_perception.mesh import Mesh, convex_hull
from intent_perception.model import Part


@dataclass(frozen=True)
class ConvexPartsConfig:
    """How finely a mesh is cut."""

    count: int = 24
    """Greatest number of parts."""
    gain: float = 0.03
    """Least share of the whole hull's volume that a cut must save."""
    offsets: int = 7
    """Planes tried across each axis of a piece."""
    thickness: float = 0.0005
    """Flat pieces (of an open mesh) are thickened by this [m]."""


def convex_parts(mesh: Mesh, config: ConvexPartsConfig | None = None) -> tuple[Part, ...]:
    """Return convex parts, all named "body", that cover a mesh.

    Greedy: the piece whose best axis-aligned cut saves most hull volume is cut next. Only the
    surface is cut, so open meshes are welcome; the hull of a cut closed surface is that of the
    cut solid.
    """
    config = config or ConvexPartsConfig()
    triangles = mesh.triangles
    whole = _hull_volume(triangles)
    if whole == 0.0:
        return (Part("body", _thick_hull(triangles, config.thickness)),)
    queue: list[tuple[float, int, Array, tuple[Array, Array] | None]] = []
    serial = 0

    def push(piece: Array) -> None:
        nonlocal serial
        saved, halves = _best_cut(piece, config.offsets)
        heapq.heappush(queue, (-saved, serial, piece, halves))
        serial += 1

    push(triangles)
    while len(queue) < config.count and -queue[0][0] > config.gain * whole:
        _, _, _, halves = heapq.heappop(queue)
        assert halves is not None
        for half in halves:
            push(half)
    pieces = sorted(queue, key=lambda item: item[1])
    return tuple(Part("body", _thick_hull(piece, config.thickness)) for _, _, piece, _ in pieces)


def _best_cut(piece: Array, offsets: int) -> tuple[float, tuple[Array, Array] | None]:
    """Return the volume [m³] that the best cut of triangles (N, 3, 3) saves, and the halves."""
    volume = _hull_volume(piece)
    low, high = piece.min(axis=(0, 1)), piece.max(axis=(0, 1))
    best, halves = 0.0, None
    for axis in range(3):
        for share in np.arange(1, offsets + 1) / (offsets + 1):
            at = float(low[axis] + share * (high[axis] - low[axis]))
            below, above = _clip(piece, axis, at), _clip(piece, axis, at, keep_above=True)
            if not len(below) or not len(above):
                continue
            saved = volume - _hull_volume(below) - _hull_volume(above)
            if saved > best:
                best, halves = saved, (below, above)
    return best, halves


def _clip(triangles: Array, axis: int, at: float, keep_above: bool = False) -> Array:
    """Return the parts of triangles (N, 3, 3) on one side of an axis-aligned plane."""
    sign = 1.0 if keep_above else -1.0
    signed = sign * (triangles[:, :, axis] - at)
    inside = signed >= 0.0
    count = inside.sum(axis=1)
    pieces = [triangles[count == 3]]
    for wanted in (1, 2):
        chosen = np.flatnonzero(count == wanted)
        if not len(chosen):
            continue
        lone = inside[chosen] if wanted == 1 else ~inside[chosen]
        order = (lone.argmax(axis=1)[:, None] + np.arange(3)) % 3
        corner = np.take_along_axis(triangles[chosen], order[:, :, None], axis=1)
        height = np.take_along_axis(signed[chosen], order, axis=1)
        a, b, c = np.moveaxis(corner, 1, 0)
        ab = a + (b - a) * (height[:, 0] / (height[:, 0] - height[:, 1]))[:, None]
        ac = a + (c - a) * (height[:, 0] / (height[:, 0] - height[:, 2]))[:, None]
        if wanted == 1:
            pieces.append(np.stack([a, ab, ac], axis=1))
        else:
            pieces.extend([np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)])
    return np.concatenate(pieces)


def _hull_volume(triangles: Array) -> float:
    try:
        return float(ConvexHull(triangles.reshape(-1, 3)).volume)
    except QhullError:  # a flat piece
        return 0.0


def _thick_hull(triangles: Array, thickness: float) -> Mesh:
    points = triangles.reshape(-1, 3)
    try:
        return convex_hull(points)
    except ValueError:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
        return convex_hull((points[:, None] + corners * (0.5 * thickness)).reshape(-1, 3))
