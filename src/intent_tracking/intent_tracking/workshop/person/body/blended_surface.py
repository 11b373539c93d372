"""Closed smooth meshes from blended primitives: how the demonstrator's body gets its skin.

A body is a field that is negative inside; its zero surface is meshed once by surface nets (one
vertex per grid cell that the surface crosses, one quad per crossed grid edge) and then pulled onto
the surface by Newton steps.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh

Field = Callable[[Array], Array]

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_BLOCK = 4


@dataclass(frozen=True, eq=False)
class RoundCones:
    """C cones with round ends, each with its own radii: bones in flesh."""

    starts: Array
    """(C, 3) [m]."""
    ends: Array
    """(C, 3) [m]."""
    radii: Array
    """(C, 2) radius at start and end [m]."""

    def distances(self, points: Array) -> Array:
        """Return (N, C) approximate signed distances of points (N, 3) to each cone [m]."""
        along = self.ends - self.starts
        length2 = np.maximum(np.sum(along**2, axis=1), 1e-12)
        offset = points[:, None] - self.starts
        t = np.clip(np.einsum("ncj,cj->nc", offset, along) / length2, 0.0, 1.0)
        radius = self.radii[:, 0] + t * (self.radii[:, 1] - self.radii[:, 0])
        distance: Array = np.linalg.norm(offset - t[..., None] * along, axis=2) - radius
        return distance


def smooth_union(distances: Array, width: float) -> Array:
    """Return the soft minimum over the last axis: joins surfaces with a fillet of `width` [m]."""
    lowest = distances.min(axis=-1, keepdims=True)
    soft = np.exp((lowest - distances) / width).sum(axis=-1)
    union: Array = lowest[..., 0] - width * np.log(soft)
    return union


def surface_mesh(field: Field, lower: Array, upper: Array, spacing: float) -> Mesh:
    """Return the closed zero surface of a field inside a box.

    Args:
        field: takes points (N, 3) to values (N,), negative inside.
        lower: (3,) corner of the box, outside the body [m].
        upper: (3,) the opposite corner [m].
        spacing: edge of the grid cells [m].

    Raises:
        ValueError: if the surface touches the box.
    """
    shape = _BLOCK * np.ceil((upper - lower) / (_BLOCK * spacing)).astype(int)
    values = _sampled(field, lower, spacing, shape)
    inside = values < 0.0
    border = np.ones(shape, dtype=bool)
    border[1:-1, 1:-1, 1:-1] = False
    if np.any(inside & border):
        raise ValueError("expected a body inside the box, but its surface leaves the box")
    vertices, index = _cell_vertices(values)
    faces = _edge_quads(inside, index)
    points = _onto_surface(field, lower + spacing * vertices, spacing)
    return Mesh(points, faces.astype(np.int32))


def _sampled(field: Field, lower: Array, spacing: float, shape: Array) -> Array:
    """Return the field on a grid; far from the surface one value serves a block of 4³ nodes."""
    blocks = shape // _BLOCK
    centre = np.stack(np.meshgrid(*[np.arange(n) for n in blocks], indexing="ij"), axis=-1)
    first = lower + spacing * (_BLOCK * centre + 0.5 * (_BLOCK - 1))
    coarse = field(first.reshape(-1, 3))
    values = coarse.reshape(blocks)
    for axis in range(3):
        values = values.repeat(_BLOCK, axis=axis)
    near = np.argwhere(np.abs(values) < 1.2 * _BLOCK * spacing)  # half a diagonal and a margin
    for chunk in np.array_split(near, max(1, len(near) // 50_000)):
        values[tuple(chunk.T)] = field(lower + spacing * chunk)
    return values


def _cell_vertices(values: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return one vertex per crossed cell (V, 3) in grid units, and its number per cell or -1."""
    cells = tuple(n - 1 for n in values.shape)
    corner = np.stack([values[i : i + cells[0], j : j + cells[1], k : k + cells[2]]
                       for i, j, k in _CORNERS], axis=-1)  # fmt: skip
    crossed = (corner.min(axis=-1) < 0.0) & (corner.max(axis=-1) >= 0.0)
    where = np.argwhere(crossed)
    at = corner[crossed]
    total, count = np.zeros((len(where), 3)), np.zeros(len(where))
    for a in range(8):
        for b in range(a + 1, 8):
            if np.abs(_CORNERS[a] - _CORNERS[b]).sum() != 1:
                continue
            cut = (at[:, a] < 0.0) != (at[:, b] < 0.0)
            t = at[cut, a] / (at[cut, a] - at[cut, b])
            total[cut] += _CORNERS[a] + t[:, None] * (_CORNERS[b] - _CORNERS[a])
            count[cut] += 1
    index = np.full(cells, -1)
    index[crossed] = np.arange(len(where))
    return where + total / count[:, None], index


def _edge_quads(inside: NDArray[np.bool_], index: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return two triangles per crossed inner grid edge, turned outwards: (F, 3)."""
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        ahead = np.roll(inside, -1, axis=axis)
        crossed = np.argwhere(inside != ahead)
        crossed = crossed[np.all(crossed < np.array(inside.shape) - 1, axis=1)]
        crossed = crossed[(crossed[:, u] > 0) & (crossed[:, v] > 0)]
        ring = []
        for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
            cell = crossed.copy()
            cell[:, u] -= du
            cell[:, v] -= dv
            ring.append(index[tuple(cell.T)])
        quad = np.stack(ring, axis=1)
        outwards = inside[tuple(crossed.T)]
        quad[~outwards] = quad[~outwards, ::-1]
        faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.concatenate(faces)


def _onto_surface(field: Field, points: Array, spacing: float, steps: int = 3) -> Array:
    """Return the points moved along the field's gradient to its zero, at most one cell."""
    moved = points.copy()
    h = 0.1 * spacing
    for _ in range(steps):
        value = field(moved)
        gradient = np.stack(
            [(field(moved + d) - field(moved - d)) / (2 * h) for d in np.eye(3) * h], axis=1
        )
        size = np.maximum(np.sum(gradient**2, axis=1), 0.05)
        moved -= (0.8 * value / size)[:, None] * gradient
    drift = moved - points
    far = np.linalg.norm(drift, axis=1, keepdims=True)
    kept: Array = points + drift * np.minimum(1.0, spacing / np.maximum(far, 1e-12))
    return kept
