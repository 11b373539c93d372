"""Which plane of a depth image is the table, from whatever side the camera sees it.

A camera sees a table from above, so a table's normal that faces the camera is "up"; what has to be
told is which of the planes in view it is. Walls, floors, boxes and chests are planes too. The
table is the one that things stand on and hands reach over; where nothing does, it is the one that
faces the image's top, as in a camera that is mounted upright.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats, Mask
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.table_plane import TablePlane, fitted_plane, outlined_plane

_SKIP = 7  # of the valid pixels, one in this many is used
_FEWEST = 100  # valid pixels, fewer show nothing
_SAMPLES = 4000
_TRIALS = 120  # planes tried in one search …
_SEARCHES = 6  # … and searches, each in what the ones before left
_ALIKE = 0.8  # cosine between the plane's normal and that of a point on it
_NEAREST = 0.15  # planes nearer to the camera are no tables [m]
_TILT = np.cos(np.radians(25.0))
"""A table's normal is this near to a known vertical, which an IMU in motion tells roughly."""
_LEAST_OBLIQUE = 0.3  # sine of the angle at which a plane is not straight ahead
_UPRIGHT = 0.1  # part of the normal along the image's top of a camera that is not rolled
_ROLLED = 0.7  # how much less other directions are believed …
_AHEAD = 0.5  # … and planes straight ahead, which with nothing on them may as well be walls
_NEAR = 0.3  # planes are believed by 1 / (this + their distance) [m]
_SOME = 0.1  # of the things that are enough, what is not noise
_PARALLEL = np.cos(np.radians(10.0))
_LEGS = 0.25  # a table is this much higher than the floor [m], which …
_FLOOR = 0.3  # … is believed so much less to be the table

_STRIDE = 4  # of the image's pixels, one in so many each way tells what stands on a plane
_WALL = 0.08  # planes this large are no things [m^2]
_LOWEST, _HIGHEST = 0.008, 0.40  # between these heights are things [m]
_CONTACT = 0.025  # what stands on a plane is seen as low as this [m] …
_ISLAND = 0.85  # … or, from above, has the plane on this share of its border
_THING = 0.12  # what is larger is furniture, a person or a wall [m^2]
_SPECK = 0.0004  # what is smaller is noise [m^2]
_THINGS = 0.004  # so much of things is as good as more [m^2]
_ARM = 0.3  # what reaches in from the image's border counts by this much
_BARE = 0.3  # what a plane without things is worth, of one with things
_LARGE = 0.3  # planes larger than this are as good as this [m^2]
_SMALL = 0.3  # of the least share in the image, what is enough with things on it


class _Candidate(NamedTuple):
    """A plane, and on which share of the points it is seen."""

    plane: TablePlane
    share: float
    area: float
    """Of what is seen of it [m²]."""


def find_table(
    image: OrientedImage,
    rng: np.random.Generator,
    tolerance: float,
    share: float,
    up: Array | None = None,
) -> TablePlane | None:
    """Return the plane that things stand on, or None if there is no table.

    Args:
        image: the scene.
        rng: draws the trial planes.
        tolerance: largest distance of the table's points from the plane [m].
        share: least share of the valid pixels that a bare table covers; 1 = no table is sought.
        up: (3,) unit vector, the vertical in the camera's frame as a calibration or an IMU tells
            it; None = the scene tells it.
    """
    if share >= 1.0:
        return None
    candidates = _planes(image, rng, tolerance, share, up)
    if not candidates:
        return None
    sketch = _Sketch(image)
    walls = [one.plane for one in candidates if one.area > _WALL]
    best, chosen = 0.0, None
    for one in candidates:
        things = min(1.0, sketch.things_on(one.plane, walls, tolerance) / _THINGS)
        if one.share < share * (1.0 - (1.0 - _SMALL) * things):
            continue
        belief = 1.0 if up is not None else _belief(one.plane.normal, things > _SOME)
        if _lies_below(one.plane, walls):
            belief *= _FLOOR
        belief /= _NEAR + _distance(one.plane)
        worth = belief * min(one.area, _LARGE) * (_BARE + (1.0 - _BARE) * things)
        if worth > best:
            best, chosen = worth, one.plane
    return chosen


def _belief(normal: Array, carries: bool) -> float:
    """Return how far a plane's direction (3,) is that of a table, 0..1.

    Args:
        normal: in the camera's frame.
        carries: whether things stand on the plane.
    """
    oblique = bool(np.hypot(normal[0], normal[1]) > _LEAST_OBLIQUE)
    if oblique and normal[1] <= -_UPRIGHT:
        return 1.0
    if oblique:
        return _ROLLED
    return _AHEAD if carries or normal[1] <= -_UPRIGHT else 0.0


def _distance(plane: TablePlane) -> float:
    """Return how far the middle of a plane is from the camera [m]: a table is near, a wall far."""
    center = plane.outline.mean(axis=0)
    return float(np.linalg.norm(plane.T_table_camera()[:3, 3] - [*center, 0.0]))


def _lies_below(plane: TablePlane, others: list[TablePlane]) -> bool:
    """Return whether another plane is like the table above this floor."""
    return any(
        other.normal @ plane.normal > _PARALLEL and other.offset < plane.offset - _LEGS
        for other in others
    )


def _planes(
    image: OrientedImage,
    rng: np.random.Generator,
    tolerance: float,
    share: float,
    up: Array | None,
) -> list[_Candidate]:
    """Return the planes of a scene that may be tables, the most visible first."""
    valid = image.valid
    points, normals = image.points()[valid][::_SKIP], image.normals[valid][::_SKIP]
    if len(points) < _FEWEST:
        return []
    chosen = rng.integers(0, len(points), _SAMPLES)
    some, facing = points[chosen].astype(np.float64), normals[chosen].astype(np.float64)
    pixel = valid.sum() / _SAMPLES / (image.camera.fx * image.camera.fy)
    left = np.ones(_SAMPLES, dtype=bool)
    found: list[_Candidate] = []
    for _ in range(_SEARCHES):
        trial = _largest(some, facing, left, rng, tolerance, up)
        if trial is None or trial[2] < _SMALL * share * _SAMPLES:
            break
        alike = facing @ trial[0] > _ALIKE
        normal, offset = fitted_plane(some[alike], trial[0], trial[1], tolerance)
        on_it = (np.abs(some @ normal + offset) < 2.0 * tolerance) & (facing @ normal > _ALIKE)
        own = on_it & left
        left &= ~on_it & (np.abs(some @ trial[0] + trial[1]) >= tolerance)
        plane = outlined_plane(points[normals @ normal > _ALIKE], normal, offset, tolerance)
        if plane is not None:
            # a pixel at p sees z^2 / f^2 of a surface across its ray, z^3 / (f^2 offset) of a plane
            area = float(np.sum(some[own, 2] ** 3)) / offset * pixel
            found.append(_Candidate(plane, float(own.sum()) / _SAMPLES, area))
    return found


def _largest(
    points: Array,
    normals: Array,
    left: Mask,
    rng: np.random.Generator,
    tolerance: float,
    up: Array | None,
) -> tuple[Array, float, int] | None:
    """Return normal, offset and inliers of the plane of the most points among those left."""
    rest, facing = points[left], normals[left]
    if len(rest) < _FEWEST:
        return None
    best: tuple[Array, float, int] | None = None
    for index in rng.integers(0, len(rest), _TRIALS):
        normal, offset = facing[index], float(-facing[index] @ rest[index])
        if offset < _NEAREST or (up is not None and normal @ up < _TILT):
            continue
        on_it = (np.abs(rest @ normal + offset) < 2.0 * tolerance) & (facing @ normal > _ALIKE)
        count = int(on_it.sum())
        if best is None or count > best[2]:
            best = normal, offset, count
    return best


class _Sketch:
    """A scene on few pixels, to see what stands on a plane."""

    def __init__(self, image: OrientedImage) -> None:
        part = slice(_STRIDE // 2, None, _STRIDE)
        self._points: Floats = image.points()[part, part]
        self._normals: Floats = image.normals[part, part]
        self._depth: Floats = np.ascontiguousarray(image.smooth[part, part])
        self._valid = self._depth > 0.0
        each = _STRIDE**2 / (image.camera.fx * image.camera.fy)
        self._areas: Floats = self._depth**2 * np.float32(each)

    def things_on(self, plane: TablePlane, walls: list[TablePlane], tolerance: float) -> float:
        """Return how much surface stands on a plane or reaches over it [m²]."""
        height = plane.height(self._points)
        flat = self._on(plane, tolerance)
        apart = self._valid & ~flat
        for wall in walls:
            if wall is not plane:
                apart &= ~self._on(wall, tolerance)
        over = apart & (height > _LOWEST) & (height < _HIGHEST) & plane.over_table(self._points, 0)
        # A cup seen from above is rings at different depths: what touches is one thing.
        count, labels = cv2.connectedComponents(over.astype(np.uint8))
        total = np.bincount(labels[over], self._areas[over], count)
        low = np.bincount(labels[over & (height < _CONTACT)], minlength=count) > 0
        beside, around = self._borders(labels, flat, count)
        border = np.zeros_like(over)
        border[:2], border[-2:], border[:, :2], border[:, -2:] = True, True, True, True
        enters = np.bincount(labels[over & border], minlength=count) > 0
        stands = low | (beside >= _ISLAND * np.maximum(around, 1))
        worth = np.where(enters, _ARM, 1.0) * np.where(stands, 1.0, enters)
        worth[(total > _THING) | (total < _SPECK)] = 0.0
        worth[0] = 0.0
        return float(worth @ total)

    def _on(self, plane: TablePlane, tolerance: float) -> Mask:
        near = np.abs(plane.height(self._points)) < 2.0 * tolerance
        alike = self._normals @ plane.normal.astype(np.float32) > _ALIKE
        return np.asarray(self._valid & near & alike)

    def _borders(
        self, labels: NDArray[np.int32], flat: Mask, count: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return how many pixels near each thing show the plane, and how many anything at all."""
        beside, around = np.zeros(count, np.int64), np.zeros(count, np.int64)
        reach = 3  # what is at an edge has no plane fitted
        for rows, columns in ((0, reach), (0, -reach), (reach, 0), (-reach, 0)):
            other = np.roll(labels, (rows, columns), (0, 1))
            outside = (labels == 0) & (other > 0) & self._valid
            around += np.bincount(other[outside], minlength=count)
            beside += np.bincount(other[outside & flat], minlength=count)
        return beside, around
