"""Convex pieces of any mesh: plane cuts until no piece is much hollower than its hull.

Only the surface is cut, and points inside a closed one are shared out, so open meshes are welcome
too. Cavities stay open: a cup falls into wedges of its wall.
"""

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.sdf_grid import inside_grid

_COUNT = 40  # greatest number of pieces
_DEPTH = 0.004  # way from the surface out of the hull that needs no more cuts [m]
_RELATIVE_DEPTH = 0.03  # the same as a share of the mesh's longest edge; the greater of both counts
_CELL = 0.018  # vertices nearer than this share of the longest edge are joined before cutting
_FILLING = 24  # points inside along the longest edge, so that the pieces of a solid are solid
_THICKNESS = 0.0005  # flat pieces (of an open mesh) are thickened by this [m]


def convex_pieces(mesh: Mesh) -> tuple[Mesh, ...]:
    """Return convex meshes that cover a mesh.

    The piece with the deepest hollow is cut next, across the axis and at the place where the hulls
    of both halves are smallest.
    """
    longest = float(np.ptp(mesh.bounds, axis=0).max())
    limit = max(_DEPTH, _RELATIVE_DEPTH * longest)
    inside = _inside_points(mesh, longest / _FILLING)
    whole = _Piece(_coarser(mesh, _CELL * longest), inside)
    queue = [(-whole.hollow(), 0, whole)]
    serial = 0
    while len(queue) < _COUNT and -queue[0][0] > limit:
        _, _, piece = heapq.heappop(queue)
        for half in _best_cut(piece):
            serial += 1
            heapq.heappush(queue, (-half.hollow(), serial, half))
    ordered = sorted(queue, key=lambda item: item[1])
    return tuple(_thick_hull(piece.points) for _, _, piece in ordered)


@dataclass(frozen=True, eq=False)
class _Piece:
    """Some of the surface and of the inside."""

    triangles: Array
    """(N, 3, 3) [m]."""
    inside: Array
    """(M, 3) [m]."""

    @property
    def points(self) -> Array:
        """All points (K, 3) that the piece's hull must hold [m]."""
        return np.concatenate([self.triangles.reshape(-1, 3), self.inside])

    def volume(self) -> float:
        """Return the volume of the hull [m³]."""
        try:
            return float(ConvexHull(self.points).volume)
        except (QhullError, ValueError):  # a flat or empty piece
            return 0.0

    def hollow(self) -> float:
        """Return the way from the surface, along its normal, out of the hull [m]."""
        if len(self.triangles) < 2:
            return 0.0
        try:
            planes = ConvexHull(self.points).equations
        except QhullError:  # a flat piece
            return 0.0
        planes = np.unique(np.round(planes, 4), axis=0)
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        kept = length > 1e-9
        normal, center = normal[kept] / length[kept, None], self.triangles[kept].mean(axis=1)
        speed = normal @ planes[:, :3].T
        depth = np.maximum(-(center @ planes[:, :3].T + planes[:, 3]), 0.0)
        way = np.where(speed > 0.05, depth / np.maximum(speed, 0.05), 1.0).min(axis=1)
        # Dents of a few triangles do not count: the way that all but 3 % of the area keep to.
        order = np.argsort(way, kind="stable")
        covered = np.cumsum(length[kept][order])
        if not len(order):
            return 0.0
        return float(way[order[np.searchsorted(covered, 0.97 * covered[-1])]])

    def halves(self, axis: int, at: float) -> tuple["_Piece", "_Piece"]:
        """Return what lies below and above a plane across an axis."""
        below = self.inside[:, axis] <= at
        return (
            _Piece(_clip(self.triangles, axis, at), self.inside[below]),
            _Piece(_clip(self.triangles, axis, at, keep_above=True), self.inside[~below]),
        )


def _inside_points(mesh: Mesh, step: float) -> Array:
    """Return the points (M, 3) of a grid that lie inside a closed mesh [m]."""
    if not mesh.is_watertight:
        return np.zeros((0, 3))
    origin = mesh.bounds[0] + 0.31 * step
    shape = np.maximum(np.ceil(np.ptp(mesh.bounds, axis=0) / step).astype(np.int64), 1)
    inside = inside_grid(np.ascontiguousarray((mesh.triangles - origin) / step), shape)
    points: Array = np.argwhere(inside) * step + origin
    return points


def _coarser(mesh: Mesh, cell: float) -> Array:
    """Return the triangles (N, 3, 3) of a mesh whose vertices are joined in cells [m]."""
    keys = np.floor((mesh.vertices - mesh.bounds[0]) / cell).astype(np.int64)
    _, index, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    index = index.ravel()
    # The vertex farthest out stands for its cell: hulls must not shrink.
    away = np.linalg.norm(mesh.vertices - mesh.bounds.mean(axis=0), axis=1)
    order = np.lexsort((-away, index))
    first = order[np.concatenate([[0], np.cumsum(count)[:-1]])]
    faces = index[mesh.faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
    faces = faces[distinct & (faces[:, 2] != faces[:, 0])]
    faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
    triangles: Array = mesh.vertices[first][faces]
    return triangles if len(faces) >= 4 else mesh.triangles


def _best_cut(piece: _Piece) -> tuple[_Piece, _Piece]:
    """Return the halves of a piece whose hulls are smallest together."""
    points = piece.points
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    best = np.inf
    halves: tuple[_Piece, _Piece] | None = None
    for axis in range(3):
        if extent[axis] < 0.15 * extent.max():
            continue
        for share in (0.5, 0.2, 0.35, 0.65, 0.8, 0.1, 0.9):
            tried = piece.halves(axis, float(low[axis] + share * extent[axis]))
            if not all(len(half.triangles) for half in tried):
                continue
            # Among equals the cut through the middle of the longest axis halves the work.
            preference = 0.02 * extent[axis] / extent.max() * (share == 0.5)
            volume = (tried[0].volume() + tried[1].volume()) * (1.0 - preference)
            if volume < best:
                best, halves = volume, tried
    if halves is None:
        axis = int(np.argmax(extent))
        return piece.halves(axis, float(np.median(piece.triangles[:, :, axis])))
    return halves


def _clip(triangles: Array, axis: int, at: float, keep_above: bool = False) -> Array:
    """Return the parts of triangles (N, 3, 3) on one side of an axis-aligned plane."""
    signed = (triangles[:, :, axis] - at) * (1.0 if keep_above else -1.0)
    inside = signed >= 0.0
    count = inside.sum(axis=1)
    pieces = [triangles[count == 3]]
    for wanted in (1, 2):
        chosen = np.flatnonzero(count == wanted)
        lone: NDArray[np.bool_] = inside[chosen] if wanted == 1 else ~inside[chosen]
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


def _thick_hull(points: Array) -> Mesh:
    try:
        return convex_hull(points)
    except ValueError:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
        return convex_hull((points[:, None] + corners * (0.5 * _THICKNESS)).reshape(-1, 3))
