"""Meshes of fewer triangles by edge collapse with quadric errors (Garland and Heckbert 1997).

Every vertex carries the sum Q of the squared distances to the planes of the faces that it stands
for, weighted with their areas. Collapsing an edge puts one vertex where the sum of both is least.
All collapses of a round have neighbourhoods apart from each other, so that a round is a few array
operations. Of the libraries at hand, fast-simplification 0.2 took three quarters of a hammer's
volume away at 200 triangles, and Open3D needs a system library that tracking does without.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from intent_perception.basics.arrays import Array

_SOFT = 1e-3
"""Pull towards the edge's middle where the planes leave a direction open; share of Q's scale."""
_SHORT = 1e-3
"""Weight of the squared length of an edge, which decides where the surface is flat."""
_OPEN = 10.0
"""Weight of the planes through open edges, across their face."""
_TURN = 0.3
"""Least cosine between a face's normals before and after a collapse."""
_CHEAPEST = 4
"""A round collapses edges of the cheapest 1 / _CHEAPEST only."""
_SAME = 1e-7
"""Vertices this near are one [m]."""


class _Collapses(NamedTuple):
    """Edges that may be collapsed, cheapest first."""

    all_edges: NDArray[np.int64]
    """(E, 2) of the mesh."""
    edges: NDArray[np.int64]
    """(C, 2)."""
    targets: Array
    """(C, 3) where the common vertex goes [m]."""


def decimated(
    vertices: Array, faces: NDArray[np.int32], count: int
) -> tuple[Array, NDArray[np.int32]]:
    """Return a mesh (V', 3), (F', 3) of about `count` triangles that stays near the given one.

    It has more where no further edge can be collapsed without folding the surface over or joining
    parts of it that do not belong together. Topology and orientation are kept.

    Args:
        vertices: (V, 3) [m].
        faces: (F, 3); vertices at the same place count as one.
        count: number of triangles that is enough.
    """
    vertices, triangles = _joined(vertices, faces.astype(np.int64))
    quadrics = _quadrics(vertices, triangles)
    banned = np.zeros(0, np.int64)
    while len(triangles) > count:
        found = _candidates(vertices, triangles, quadrics, banned)
        chosen = np.flatnonzero(_apart(found, len(vertices)))
        chosen = chosen[: (len(triangles) - count + 1) // 2]
        edges, targets = found.edges[chosen], found.targets[chosen]
        folds = _folding(vertices, triangles, edges, targets)
        banned = np.concatenate([banned, edges[folds] @ [len(vertices), 1]])
        edges, targets = edges[~folds], targets[~folds]
        if len(chosen) == 0:
            break
        vertices[edges[:, 0]] = targets
        quadrics[edges[:, 0]] += quadrics[edges[:, 1]]
        triangles = _relabelled(triangles, edges, len(vertices))
    used, labels = np.unique(triangles, return_inverse=True)
    return vertices[used], labels.reshape(-1, 3).astype(np.int32)


def _joined(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return the mesh with one vertex at each place and without faces that have no area."""
    _, first, label = np.unique(
        np.round(vertices / _SAME).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    faces = label.ravel()[faces]
    return vertices[first].astype(np.float64), faces[_whole(faces)]


def _whole(faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which faces have three different vertices."""
    a, b, c = faces.T
    return np.asarray((a != b) & (b != c) & (c != a))


def _relabelled(
    faces: NDArray[np.int64], edges: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """Return the faces that are left when each edge's second vertex becomes its first."""
    label = np.arange(count)
    label[edges[:, 1]] = edges[:, 0]
    faces = label[faces]
    return faces[_whole(faces)]


def _normals(corners: Array) -> Array:
    """Return the normals (F, 3), of double the area, of faces (F, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _quadrics(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Return Q (V, 4, 4) of every vertex."""
    corners = vertices[faces]
    normals = _normals(corners)
    area = np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(area, 1e-30)[:, None]
    quadrics = np.zeros((len(vertices), 4, 4))
    for corner in range(3):
        _add_planes(quadrics, faces[:, corner], unit, corners[:, 0], area)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, index, uses = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    alone = np.flatnonzero(uses[index.ravel()] == 1)
    start, end = vertices[sides[alone, 0]], vertices[sides[alone, 1]]
    across = np.cross(end - start, unit[alone // 3])
    length = np.linalg.norm(across, axis=1)
    across /= np.maximum(length, 1e-30)[:, None]
    for side in range(2):
        _add_planes(quadrics, sides[alone, side], across, start, _OPEN * length**2)
    return quadrics


def _add_planes(
    quadrics: Array, rows: NDArray[np.int64], unit: Array, points: Array, weight: Array
) -> None:
    planes = np.column_stack([unit, -np.sum(unit * points, axis=1)])
    np.add.at(quadrics, rows, weight[:, None, None] * planes[:, :, None] * planes[:, None])


def _candidates(
    vertices: Array, faces: NDArray[np.int64], quadrics: Array, banned: NDArray[np.int64]
) -> _Collapses:
    """Return the cheapest edges whose collapse keeps the topology."""
    count = len(vertices)
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    codes, uses = np.unique(sides @ [count, 1], return_counts=True)
    edges = np.column_stack(np.divmod(codes, count))
    a, b = edges.T
    quadric = quadrics[a] + quadrics[b]
    matrix, scale = quadric[:, :3, :3], np.trace(quadric[:, :3, :3], axis1=1, axis2=2)
    middle = 0.5 * (vertices[a] + vertices[b])
    slope = quadric[:, :3, 3] + np.einsum("eij,ej->ei", matrix, middle)
    soft = matrix + (_SOFT * scale + 1e-30)[:, None, None] * np.eye(3)
    step = np.linalg.solve(soft, -slope[..., None])[..., 0]
    length = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    step *= np.minimum(1.0, length / np.maximum(np.linalg.norm(step, axis=1), 1e-30))[:, None]
    target = middle + step
    point = np.column_stack([target, np.ones(len(target))])
    cost = np.einsum("ei,eij,ej->e", point, quadric, point) + _SHORT * scale * length**2
    ones = np.ones(2 * len(edges))
    near = sparse.csr_matrix((ones, (np.r_[a, b], np.r_[b, a])), shape=(count, count))
    common = np.asarray(near[a].multiply(near[b]).sum(axis=1)).ravel()
    cost[(common != uses) | (uses > 2) | np.isin(codes, banned)] = np.inf
    order = np.argsort(cost, kind="stable")[: len(cost) // _CHEAPEST + 1]
    order = order[np.isfinite(cost[order])]
    return _Collapses(edges, edges[order], target[order])


def _apart(found: _Collapses, count: int) -> NDArray[np.bool_]:
    """Return which collapses (C,) are the cheapest among all at their vertices' neighbours."""
    rank = np.arange(len(found.edges))
    first = np.full(count, len(rank))
    for end in range(2):
        np.minimum.at(first, found.edges[:, end], rank)
    around = first.copy()
    for end in range(2):
        np.minimum.at(around, found.all_edges[:, end], first[found.all_edges[:, 1 - end]])
    return np.asarray((around[found.edges] == rank[:, None]).all(axis=1))


def _folding(
    vertices: Array, faces: NDArray[np.int64], edges: NDArray[np.int64], targets: Array
) -> NDArray[np.bool_]:
    """Return which collapses would turn a face over."""
    owner = np.full(len(vertices), -1)
    owner[edges] = np.arange(len(edges))[:, None]
    moved = vertices.copy()
    moved[edges[:, 0]] = moved[edges[:, 1]] = targets
    owners = owner[faces].max(axis=1)
    label = np.arange(len(vertices))
    label[edges[:, 1]] = edges[:, 0]
    kept = (owners >= 0) & _whole(label[faces])
    before, after = _normals(vertices[faces[kept]]), _normals(moved[faces[kept]])
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    turned = np.sum(before * after, axis=1) < _TURN * sizes + 1e-30
    folds = np.zeros(len(edges), np.bool_)
    folds[owners[kept][turned]] = True
    return folds
