"""Signed distance to a mesh on a regular grid, sampled between the grid points."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import inlined_kernel, kernel
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.sdf_grid import fill_distance, inside_grid

_FAR = np.float32(1e12)


@dataclass(frozen=True, eq=False)
class SignedDistance:
    """Distance to a surface: negative inside, positive outside [m]."""

    origin: Array
    """(3,) position of the first grid point, object frame [m]."""
    spacing: float
    """Step of the grid [m]."""
    values: Floats
    """(X, Y, Z) signed distance at the grid points [m]."""

    @classmethod
    def from_mesh(
        cls, mesh: Mesh, spacing: float = 0.0025, margin: float = 0.03
    ) -> "SignedDistance":
        """Return the signed distance to a mesh on a grid that surrounds it.

        A grid point is inside where two of the three axis-parallel lines through it cross the
        surface an odd number of times before it; small holes of an open mesh are outvoted.

        Args:
            mesh: surface [m].
            spacing: step of the grid [m].
            margin: room around the bounding box [m].

        Raises:
            ValueError: if spacing is not above 0 or margin is negative.
        """
        if not spacing > 0.0 or margin < 0.0:
            raise ValueError(f"expected spacing > 0 and margin >= 0, got {spacing}, {margin}")
        low, high = mesh.bounds
        origin = low - margin
        shape = np.ceil((high - low + 2.0 * margin) / spacing).astype(np.int64) + 1
        # Computed in grid steps around the grid's corner.
        triangles = np.ascontiguousarray((mesh.triangles - origin) / spacing)
        squared = np.full(tuple(shape), _FAR, np.float32)
        nearest = np.full(tuple(shape), -1, np.int32)
        fill_distance(triangles, mesh.faces, squared, nearest)
        signed = np.sqrt(squared) * np.where(inside_grid(triangles, shape), -spacing, spacing)
        return cls(origin, float(spacing), np.ascontiguousarray(signed, dtype=np.float32))

    @cached_property
    def origin32(self) -> Floats:
        """The origin (3,) in float32, for kernels [m]."""
        return self.origin.astype(np.float32)

    def distance(self, points: ArrayLike) -> Array:
        """Return the signed distance (...) of points (..., 3) in the object frame [m].

        Outside the grid: the value at the nearest point of the grid plus the way there.
        """
        points = np.asarray(points, dtype=np.float64)
        flat = np.ascontiguousarray(points.reshape(-1, 3), dtype=np.float32)
        values = distances(self.values, self.origin32, np.float32(self.spacing), flat)
        result: Array = values.reshape(points.shape[:-1]).astype(np.float64)
        return result

    def gradient(self, points: ArrayLike) -> Array:
        """Return the gradient (..., 3), about of unit length, at points (..., 3)."""
        points = np.asarray(points, dtype=np.float64)
        flat = np.ascontiguousarray(points.reshape(-1, 3), dtype=np.float32)
        values = gradients(self.values, self.origin32, np.float32(self.spacing), flat)
        result: Array = values.reshape(points.shape).astype(np.float64)
        return result


@inlined_kernel
def sample(
    values: Floats, origin: Floats, spacing: np.float32, x: float, y: float, z: float
) -> float:
    """Return the signed distance at one point, trilinear; see `SignedDistance.distance`."""
    i, fx, ox = locate(x, origin[0], spacing, values.shape[0])
    j, fy, oy = locate(y, origin[1], spacing, values.shape[1])
    k, fz, oz = locate(z, origin[2], spacing, values.shape[2])
    c00 = values[i, j, k] + fx * (values[i + 1, j, k] - values[i, j, k])
    c10 = values[i, j + 1, k] + fx * (values[i + 1, j + 1, k] - values[i, j + 1, k])
    c01 = values[i, j, k + 1] + fx * (values[i + 1, j, k + 1] - values[i, j, k + 1])
    c11 = values[i, j + 1, k + 1] + fx * (values[i + 1, j + 1, k + 1] - values[i, j + 1, k + 1])
    c0 = c00 + fy * (c10 - c00)
    c1 = c01 + fy * (c11 - c01)
    inside: float = c0 + fz * (c1 - c0)
    away = ox * ox + oy * oy + oz * oz
    if away > 0.0:
        inside += np.sqrt(away)
    return inside


@inlined_kernel
def locate(
    x: float, origin: np.float32, spacing: np.float32, count: int
) -> tuple[int, np.float32, np.float32]:
    """Return cell, share within the cell and way outside the grid of one coordinate [m]."""
    position = (x - origin) / spacing
    last = np.float32(count - 1)
    clamped = min(max(position, np.float32(0.0)), last)
    cell = min(int(clamped), count - 2)
    return cell, clamped - np.float32(cell), (position - clamped) * spacing


@kernel
def sample_gradient(
    values: Floats, origin: Floats, spacing: np.float32, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return the gradient at one point by central differences of one grid step."""
    step = np.float32(0.5) * spacing
    gx = sample(values, origin, spacing, x + step, y, z) - sample(
        values, origin, spacing, x - step, y, z
    )
    gy = sample(values, origin, spacing, x, y + step, z) - sample(
        values, origin, spacing, x, y - step, z
    )
    gz = sample(values, origin, spacing, x, y, z + step) - sample(
        values, origin, spacing, x, y, z - step
    )
    return gx / spacing, gy / spacing, gz / spacing


@kernel
def distances(values: Floats, origin: Floats, spacing: np.float32, points: Floats) -> Floats:
    """Return the signed distances (N,) of points (N, 3)."""
    result = np.empty(len(points), np.float32)
    for n in range(len(points)):
        result[n] = sample(values, origin, spacing, points[n, 0], points[n, 1], points[n, 2])
    return result


@kernel
def gradients(values: Floats, origin: Floats, spacing: np.float32, points: Floats) -> Floats:
    """Return the gradients (N, 3) at points (N, 3)."""
    result = np.empty((len(points), 3), np.float32)
    for n in range(len(points)):
        gx, gy, gz = sample_gradient(
            values, origin, spacing, points[n, 0], points[n, 1], points[n, 2]
        )
        result[n, 0], result[n, 1], result[n, 2] = gx, gy, gz
    return result
