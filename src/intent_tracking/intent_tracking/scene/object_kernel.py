"""Objects for compiled code: signed distance grids, surface samples and meshes of K objects."""

import math
from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.model import ObjectModel

SURFACE_SAMPLES = 96
GRID_SPACING, GRID_MARGIN = 0.003, 0.02
"""Step and border of the distance grids [m]."""
DRAWN_DETAIL = 0.006
"""Details below this are not drawn: about two pixels of the tile [m]."""


class ObjectGeometry(NamedTuple):
    """What the tracker needs of one object's shape, in its own frame [m]."""

    distance: SignedDistance
    surface: Array
    """(SURFACE_SAMPLES, 3) spread over the surface."""
    vertices: Array
    """(V, 3)."""
    faces: NDArray[np.int32]
    """(F, 3)."""
    axis: Array | None
    """(3,) axis of continuous symmetry through the origin, if any."""
    mesh: Mesh
    """All of its surface."""


class ObjectArrays(NamedTuple):
    """K objects packed one after the other; the types do not depend on K."""

    grid: Floats
    """All grid values, flattened [m]."""
    grid_start: NDArray[np.int64]
    """(K,) first value of each grid."""
    grid_shape: NDArray[np.int64]
    """(K, 3)."""
    grid_origin: Floats
    """(K, 3) [m]."""
    grid_scale: Floats
    """(K,) cells per metre."""
    surface: Floats
    """(K, SURFACE_SAMPLES, 3) [m]."""
    vertices: Floats
    """(sum V, 3) [m]."""
    faces: NDArray[np.int32]
    """(sum F, 3) into each object's own vertices."""
    vertex_start: NDArray[np.int64]
    """(K + 1,)."""
    face_start: NDArray[np.int64]
    """(K + 1,)."""


_geometries: WeakKeyDictionary[ObjectModel, ObjectGeometry] = WeakKeyDictionary()


def geometry_of(model: ObjectModel) -> ObjectGeometry:
    """Return the shape of a model as the tracker uses it, computed once in the model's life."""
    if (known := _geometries.get(model)) is not None:
        return known
    surface, _, _ = model.mesh.sample_surface(SURFACE_SAMPLES, np.random.default_rng(0))
    distance = SignedDistance.from_mesh(model.mesh, GRID_SPACING, GRID_MARGIN)
    vertices, faces = simplified(model.mesh.vertices, model.mesh.faces, DRAWN_DETAIL)
    axis = model.symmetry.axis
    geometry = ObjectGeometry(distance, surface, vertices, faces, axis, model.mesh)
    _geometries[model] = geometry
    return geometry


def simplified(
    vertices: Array, faces: NDArray[np.int32], cell: float
) -> tuple[Array, NDArray[np.int32]]:
    """Return a mesh (V, 3), (F, 3) in which vertices within one grid cell are their mean."""
    keys = np.floor(vertices / cell).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    counts = np.bincount(group)
    merged = np.stack(
        [np.bincount(group, weights=vertices[:, axis]) / counts for axis in range(3)], axis=1
    )
    new = group[faces]
    full = (new[:, 0] != new[:, 1]) & (new[:, 1] != new[:, 2]) & (new[:, 2] != new[:, 0])
    return merged, np.unique(new[full], axis=0).astype(np.int32)


def object_arrays(objects: Sequence[ObjectGeometry]) -> ObjectArrays:
    """Pack the geometry of K >= 0 objects."""
    grids = [np.ascontiguousarray(o.distance.values, dtype=np.float32) for o in objects]
    sizes = np.array([g.size for g in grids], dtype=np.int64)
    vertices = [len(o.vertices) for o in objects]
    faces = [len(o.faces) for o in objects]
    return ObjectArrays(
        np.concatenate([np.zeros(0, np.float32), *(g.ravel() for g in grids)]),
        np.concatenate([[0], np.cumsum(sizes)])[:-1].astype(np.int64),
        np.array([g.shape for g in grids], dtype=np.int64).reshape(-1, 3),
        np.array([o.distance.origin for o in objects], dtype=np.float32).reshape(-1, 3),
        np.array([1.0 / o.distance.spacing for o in objects], dtype=np.float32),
        np.array([o.surface for o in objects], dtype=np.float32).reshape(-1, SURFACE_SAMPLES, 3),
        np.concatenate([np.zeros((0, 3)), *(o.vertices for o in objects)]).astype(np.float32),
        np.concatenate([np.zeros((0, 3)), *(o.faces for o in objects)]).astype(np.int32),
        np.concatenate([[0], np.cumsum(vertices)]).astype(np.int64),
        np.concatenate([[0], np.cumsum(faces)]).astype(np.int64),
    )


@borrowing_kernel
def off_grid(
    objects: ObjectArrays, k: int, x: np.float32, y: np.float32, z: np.float32
) -> np.float32:
    """Return at least how far a point in object k's frame is from its surface [m]; often 0.

    Outside the grid, whose margin holds no surface, it is the margin plus the largest excess.
    """
    margin, zero = np.float32(GRID_MARGIN), np.float32(0.0)
    scale, shape = objects.grid_scale[k], objects.grid_shape[k]
    gx, gy, gz = (
        x - objects.grid_origin[k, 0],
        y - objects.grid_origin[k, 1],
        z - objects.grid_origin[k, 2],
    )
    beyond = max(-gx, gx - np.float32(shape[0] - 1) / scale)
    beyond = max(beyond, -gy, gy - np.float32(shape[1] - 1) / scale)
    beyond = max(beyond, -gz, gz - np.float32(shape[2] - 1) / scale)
    return margin + beyond if beyond > zero else zero


@borrowing_kernel
def signed_distance(
    objects: ObjectArrays, k: int, x: np.float32, y: np.float32, z: np.float32, gradient: Floats
) -> np.float32:
    """Return the signed distance [m] of a point in object k's frame and write its gradient (3,).

    Trilinear inside the grid; outside, the distance to the grid is added.
    """
    nx, ny, nz = objects.grid_shape[k, 0], objects.grid_shape[k, 1], objects.grid_shape[k, 2]
    scale = objects.grid_scale[k]
    zero, one, edge = np.float32(0.0), np.float32(1.0), np.float32(1.001)
    gx = (x - objects.grid_origin[k, 0]) * scale
    gy = (y - objects.grid_origin[k, 1]) * scale
    gz = (z - objects.grid_origin[k, 2]) * scale
    cx = min(max(gx, zero), np.float32(nx) - edge)
    cy = min(max(gy, zero), np.float32(ny) - edge)
    cz = min(max(gz, zero), np.float32(nz) - edge)
    ex, ey, ez = gx - cx, gy - cy, gz - cz
    i, j, m = int(cx), int(cy), int(cz)
    a, b, c = cx - np.float32(i), cy - np.float32(j), cz - np.float32(m)
    grid = objects.grid
    low = objects.grid_start[k] + (i * ny + j) * nz + m
    high = low + ny * nz
    s000, s001, s010, s011 = grid[low], grid[low + 1], grid[low + nz], grid[low + nz + 1]
    s100, s101, s110, s111 = grid[high], grid[high + 1], grid[high + nz], grid[high + nz + 1]
    x00, x10 = s000 + (s100 - s000) * a, s010 + (s110 - s010) * a
    x01, x11 = s001 + (s101 - s001) * a, s011 + (s111 - s011) * a
    y0, y1 = x00 + (x10 - x00) * b, x01 + (x11 - x01) * b
    gradient[2] = (y1 - y0) * scale
    gradient[1] = ((x10 - x00) * (one - c) + (x11 - x01) * c) * scale
    gradient[0] = (
        ((s100 - s000) * (one - b) + (s110 - s010) * b) * (one - c)
        + ((s101 - s001) * (one - b) + (s111 - s011) * b) * c
    ) * scale
    value = y0 + (y1 - y0) * c
    outside = math.sqrt(ex * ex + ey * ey + ez * ez)
    if outside > zero:
        value += outside / scale
        gradient[0], gradient[1], gradient[2] = ex / outside, ey / outside, ez / outside
    return value


@borrowing_kernel
def distance_in_camera(
    objects: ObjectArrays,
    k: int,
    rotation: Floats,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    gradient: Floats,
) -> np.float32:
    """Return the signed distance [m] of a point given relative to object k's origin.

    (x, y, z) and the gradient (3,) that is written are along the camera's axes.
    """
    r = rotation
    lx = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
    ly = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
    lz = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
    value = signed_distance(objects, k, lx, ly, lz, gradient)
    g0, g1, g2 = gradient[0], gradient[1], gradient[2]
    gradient[0] = r[0, 0] * g0 + r[0, 1] * g1 + r[0, 2] * g2
    gradient[1] = r[1, 0] * g0 + r[1, 1] * g1 + r[1, 2] * g2
    gradient[2] = r[2, 0] * g0 + r[2, 1] * g1 + r[2, 2] * g2
    return value


@kernel
def object_distances(
    objects: ObjectArrays,
    k: int,
    rotation: Floats,
    x0: np.float32,
    y0: np.float32,
    z0: np.float32,
    points: Floats,
    reach: np.float32,
    distance: Floats,
) -> None:
    """Write the signed distance (N,) [m] of points (3, N) to object k at (rotation, x0..z0).

    Of points that are clearly farther than `reach`, only a distance that is too small is known.
    """
    gradient = np.empty(3, np.float32)
    r = rotation
    for n in range(points.shape[1]):
        x, y, z = points[0, n] - x0, points[1, n] - y0, points[2, n] - z0
        lx = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
        ly = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
        lz = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
        least = off_grid(objects, k, lx, ly, lz)
        if least > reach + np.float32(GRID_SPACING):
            distance[n] = least
        else:
            distance[n] = signed_distance(objects, k, lx, ly, lz, gradient)
