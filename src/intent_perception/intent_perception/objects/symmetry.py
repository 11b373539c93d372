"""Symmetries of a mesh, found by turning it and measuring how far its surface moves."""

import numpy as np
from scipy.spatial import cKDTree

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import (
    across,
    make_pose,
    rotation_from_vector,
    transform_points,
    vector_from_rotation,
)
from intent_perception.objects.model import Symmetry

_SPINS = np.deg2rad([37.0, 61.0, 90.0, 143.0])
_FOLDS = (6, 5, 4, 3, 2)
_NEAR = np.cos(np.deg2rad(6.0))
_STEPS = 8

_TOLERANCE = 0.006  # distance between turned and true surface, in diameters, that cannot be seen …
_NOISE = 0.001  # … plus this, the noise of scans and of the sensor [m]
_QUANTILE = 0.96  # share of the surface that must be within the tolerance
_POINTS = 800  # surface points that are turned
_REFERENCE_POINTS = 12000  # surface points that they are compared with


def find_symmetry(mesh: Mesh) -> Symmetry:
    """Return the rotational symmetries of a mesh about its principal axes, fitted to the surface.

    Axes are the principal axes of the surface and, where two of these are interchangeable (prisms,
    boxes of square section), directions between them. Mirror symmetries are no rigid motions.
    """
    test = _Test(mesh)
    axes = test.settle()
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

    def __init__(self, mesh: Mesh) -> None:
        rng = np.random.default_rng(0)
        reference, self._normals, _ = mesh.sample_surface(_REFERENCE_POINTS, rng)
        self._reference = reference
        self.center, spread = _surface_moments(mesh)
        self._tree = cKDTree(reference)
        self._points = mesh.sample_surface(_POINTS, rng)[0] - self.center
        diameter = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
        self._limit = _TOLERANCE * diameter + _NOISE
        # Two samplings of one surface lie this far apart even without any turn.
        self._spacing = 2.0 * float(
            np.quantile(self._tree.query(self._points + self.center)[0], 0.9)
        )
        self.principal_axes: Array = np.linalg.eigh(spread)[1].T[::-1]

    def holds(self, axis: Array, angle: float) -> bool:
        """Return whether a turn about an axis through the centre is a symmetry."""
        turn = self.pose(rotation_from_vector(axis * angle))
        return self._share(turn) >= _QUANTILE

    def settle(self) -> Array:
        """Return the axes (3, 3) after half turns about them were fitted to the surface.

        The moments of a scan with dents or an uneven bottom are off by a degree and a millimetre,
        which a half turn doubles. The centre moves along.
        """
        axes = self.principal_axes.copy()
        rows = [1e-3 * np.eye(3)]
        values = [1e-3 * self.center]
        for k, axis in enumerate(self.principal_axes):
            turn = self._fitted(self.pose(rotation_from_vector(axis * np.pi)))
            found = vector_from_rotation(turn[:3, :3])
            found /= max(float(np.linalg.norm(found)), 1e-9)
            if abs(float(found @ axis)) < _NEAR or self._share(turn) < _QUANTILE:
                continue
            axes[k] = found * np.sign(found @ axis)
            rows.append(np.eye(3) - turn[:3, :3])
            values.append(turn[:3, 3])
        left, right = np.concatenate(rows), np.concatenate(values)
        self._move_center(np.linalg.lstsq(left, right, rcond=None)[0])
        return axes

    def _move_center(self, center: Array) -> None:
        self._points = self._points + self.center - center
        self.center = center

    def _fitted(self, turn: Array) -> Array:
        """Return a turn (4, 4) moved a little so that the turned surface lies on the true one."""
        points = self._points + self.center
        for _ in range(_STEPS):
            turned = transform_points(turn, points)
            distance, nearest = self._tree.query(turned)
            close = distance <= 4.0 * self._limit + self._spacing
            if np.count_nonzero(close) < 30:
                return turn
            normals = self._normals[nearest[close]]
            gap = np.einsum("ij,ij->i", self._reference[nearest[close]] - turned[close], normals)
            arms = turned[close] - self.center
            jacobian = np.concatenate([np.cross(arms, normals), normals], axis=1)
            # Damped: spinning a round object moves nothing.
            size = np.linalg.norm(arms, axis=1).mean()
            damping = np.diag([1e-3 * size**2] * 3 + [1e-3] * 3) * len(gap)
            step = np.linalg.solve(jacobian.T @ jacobian + damping, jacobian.T @ gap)
            rotation = rotation_from_vector(step[:3])
            shift = self.center + step[3:] - rotation @ self.center
            turn = make_pose(rotation, shift) @ turn
        return turn

    def _share(self, turn: Array) -> float:
        """Return the share of the surface that a turn (4, 4) takes onto the surface."""
        turned = transform_points(turn, self._points + self.center)
        reach = self._limit + self._spacing
        distance, nearest = self._tree.query(turned, distance_upper_bound=reach)
        found = np.isfinite(distance)
        gap = turned[found] - self._reference[nearest[found]]
        # Along the surface the samples are too far apart to tell; across it the gap is exact.
        off = np.abs(np.einsum("ij,ij->i", gap, self._normals[nearest[found]]))
        return float(np.sum(off <= self._limit)) / len(turned)

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
    first = across(axis)
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
