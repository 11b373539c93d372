"""Symmetries of a mesh, found by turning it and measuring how far its surface moves."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from intent_perception.geometry import Array, make_pose, rotation_from_vector
from intent_perception.mesh import Mesh
from intent_perception.model import Symmetry

_SPINS = np.deg2rad([37.0, 61.0, 90.0, 143.0])
_FOLDS = (6, 5, 4, 3, 2)


@dataclass(frozen=True)
class SymmetryConfig:
    """When a turned mesh counts as the same."""

    tolerance: float = 0.006
    """Distance between turned and true surface, in diameters, that cannot be seen …"""
    noise: float = 0.001
    """… plus this, the noise of scans and of the sensor [m]."""
    quantile: float = 0.96
    """Share of the surface that must be within the tolerance."""
    points: int = 800
    """Surface points that are turned."""
    reference_points: int = 12000
    """Surface points that they are compared with."""
    seed: int = 0
    """Seed of the surface points."""


def find_symmetry(mesh: Mesh, config: SymmetryConfig | None = None) -> Symmetry:
    """Return the rotational symmetries of a mesh about its principal axes.

    Axes are the principal axes of the surface and, where two of these are interchangeable (prisms,
    boxes of square section), directions between them. Mirror symmetries are no rigid motions.
    """
    config = config or SymmetryConfig()
    test = _Test(mesh, config)
    axes = test.principal_axes
    for axis in axes:
        if all(test.holds(axis, angle) for angle in _SPINS):
            flip = _flips(test, axis)[:1]
            return Symmetry(axis, tuple(test.pose(turn) for turn in flip), test.center)
    rotations: list[Array] = [np.eye(3)]
    for axis in axes:
        fold = next((n for n in _FOLDS if test.holds(axis, 2.0 * np.pi / n)), 1)
        turns = [rotation_from_vector(axis * 2.0 * np.pi * k / fold) for k in range(1, fold)]
        # A principal axis of fold 3 or more leaves the two others undetermined.
        across = _flips(test, axis)[:1] if fold > 2 else []
        rotations = _closed(rotations + turns + across)
    return Symmetry(None, tuple(test.pose(rotation) for rotation in rotations[1:]), None)


class _Test:
    """Surface points of a mesh and the question whether a rotation maps it onto itself."""

    def __init__(self, mesh: Mesh, config: SymmetryConfig) -> None:
        rng = np.random.default_rng(config.seed)
        reference, self._normals, _ = mesh.sample_surface(config.reference_points, rng)
        self._reference = reference
        self._config = config
        self.center, spread = _surface_moments(mesh)
        self._tree = cKDTree(reference)
        self._points = mesh.sample_surface(config.points, rng)[0] - self.center
        diameter = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
        self._limit = config.tolerance * diameter + config.noise
        # Two samplings of one surface lie this far apart even without any turn.
        self._spacing = 2.0 * float(
            np.quantile(self._tree.query(self._points + self.center)[0], 0.9)
        )
        self.principal_axes: Array = np.linalg.eigh(spread)[1].T[::-1]

    def holds(self, axis: Array, angle: float) -> bool:
        """Return whether a turn about an axis through the centre is a symmetry."""
        turned = self._points @ rotation_from_vector(axis * angle).T + self.center
        reach = self._limit + self._spacing
        distance, nearest = self._tree.query(turned, distance_upper_bound=reach)
        found = np.isfinite(distance)
        gap = turned[found] - self._reference[nearest[found]]
        # Along the surface the samples are too far apart to tell; across it the gap is exact.
        off = np.abs(np.einsum("ij,ij->i", gap, self._normals[nearest[found]]))
        return bool(np.sum(off <= self._limit) >= self._config.quantile * len(turned))

    def pose(self, rotation: Array) -> Array:
        """Return T_object_object (4, 4) of a rotation about the centre."""
        return make_pose(rotation, self.center - rotation @ self.center)


def _surface_moments(mesh: Mesh) -> tuple[Array, Array]:
    """Return the centre (3,) [m] and the second moments about it (3, 3) [m²] of the surface."""
    weights = mesh.areas / mesh.areas.sum()
    middle = mesh.triangles.mean(axis=1)
    center = weights @ middle
    corners = mesh.triangles - center
    inner = np.einsum("f,fki,fkj->ij", weights, corners, corners) / 12.0
    outer = np.einsum("f,fi,fj->ij", weights, middle - center, middle - center)
    return center, inner + 0.75 * outer


def _flips(test: _Test, axis: Array) -> list[Array]:
    """Return the half turns about directions across an axis that are symmetries."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    directions = [np.cos(a) * first + np.sin(a) * second for a in np.arange(36) * np.pi / 36]
    return [rotation_from_vector(d * np.pi) for d in directions if test.holds(d, np.pi)]


def _closed(rotations: list[Array]) -> list[Array]:
    """Return the group that rotations generate (at most 60 elements), identity first."""
    group: list[Array] = []
    for rotation in rotations:
        if not any(np.trace(r.T @ rotation) > 2.95 for r in group):
            group.append(rotation)
    grown = True
    while grown and len(group) < 60:
        grown = False
        for a in list(group):
            for b in list(group):
                product = a @ b
                if not any(np.trace(r.T @ product) > 2.95 for r in group):
                    group.append(product)
                    grown = True
    return group
