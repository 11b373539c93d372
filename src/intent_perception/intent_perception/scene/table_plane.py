"""The table plane in a depth image: where "height" and the frame `table` come from."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.transforms import inverse, make_pose
from intent_perception.scene.oriented_image import OrientedImage

_CELL = 0.02  # edge of the grid cells that decide which inliers hang together [m]
_SKIP = 7  # of the valid pixels, one in this many is used
_LEAST_IN_CELL = 2
_LEAST_AREA = 0.03  # smaller planes are sides of objects [m^2]
_SAMPLES = 4000
_TRIALS = 200
_OBLIQUE = 0.3  # sine of the least angle between a rolled camera and the table's normal


@dataclass(frozen=True, eq=False)
class TablePlane:
    """A table top in camera coordinates; height of p is normal . p + offset."""

    normal: Array
    """(3,) unit vector away from the table, towards the camera's side."""
    offset: float
    """Height of the camera above the plane [m]."""
    outline: NDArray[np.float32]
    """(N, 2) convex outline of the visible table top in x, y of the frame `table` [m]."""

    def T_table_camera(self) -> Array:
        """Return camera -> table (4, 4): origin on the optical axis, z up, x to the image's right.

        Where the optical axis misses the table, the origin is the point below the camera.
        """
        z = self.normal
        x = np.array([1.0, 0.0, 0.0]) - z[0] * z
        x /= np.linalg.norm(x)
        R_camera_table = np.stack([x, np.cross(z, x), z], axis=1)
        meets = z[2] < -0.05
        origin = np.array([0.0, 0.0, -self.offset / z[2]]) if meets else -self.offset * z
        return inverse(make_pose(R_camera_table, origin))

    def height(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the height (...) of points (..., 3) in camera coordinates above the table [m]."""
        height: NDArray[np.float32] = points @ self.normal.astype(np.float32) + np.float32(
            self.offset
        )
        return height

    def over_table(self, points: NDArray[np.float32], margin: float) -> NDArray[np.bool_]:
        """Return whether points (..., 3) of the camera stand over the outline grown by margin."""
        return self.inset(points) >= -margin

    def inset(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how far inside the outline points (..., 3) of the camera frame stand [m].

        Negative outside, where it is the largest distance from any edge's line.
        """
        T_flat = self.T_table_camera()[:2].astype(np.float32)
        flat = points.reshape(-1, 3)
        inset: NDArray[np.float32] = _inset(flat, T_flat, self.outline)
        return inset.reshape(points.shape[:-1])


@kernel
def _inset(
    points: NDArray[np.float32], T_flat: NDArray[np.float32], outline: NDArray[np.float32]
) -> NDArray[np.float32]:
    corners = len(outline)
    edges = np.empty((corners, 3), np.float32)
    for k in range(corners):
        ex = outline[(k + 1) % corners, 0] - outline[k, 0]
        ey = outline[(k + 1) % corners, 1] - outline[k, 1]
        length = np.sqrt(ex * ex + ey * ey) + np.float32(1e-9)
        edges[k, 0] = -ey / length
        edges[k, 1] = ex / length
        edges[k, 2] = -(edges[k, 0] * outline[k, 0] + edges[k, 1] * outline[k, 1])
    depth = np.empty(len(points), np.float32)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        u = T_flat[0, 0] * x + T_flat[0, 1] * y + T_flat[0, 2] * z + T_flat[0, 3]
        v = T_flat[1, 0] * x + T_flat[1, 1] * y + T_flat[1, 2] * z + T_flat[1, 3]
        least = np.float32(1e9)
        for k in range(corners):
            least = min(least, edges[k, 0] * u + edges[k, 1] * v + edges[k, 2])
        depth[i] = least
    return depth


class _Trial(NamedTuple):
    """A plane through one point, and how many points lie on it."""

    inliers: int
    normal: Array = np.zeros(3)
    offset: float = 0.0


def find_table(
    image: OrientedImage, rng: np.random.Generator, tolerance: float, share: float
) -> TablePlane | None:
    """Return the largest plane that faces up towards the camera, or None if there is no table.

    Up is the image's up. Where no plane faces there the camera may be rolled: then the largest
    plane counts that it sees obliquely. One that it faces may as well be a wall.

    Args:
        image: the scene.
        rng: draws the trial planes.
        tolerance: largest distance of the table's points from the plane [m].
        share: least share of the valid pixels that a table covers.
    """
    valid = image.valid
    points = image.points()[valid][::_SKIP]
    normals = image.normals[valid][::_SKIP]
    if len(points) < 100:
        return None
    chosen = rng.integers(0, len(points), _SAMPLES)
    some, facing = points[chosen].astype(np.float64), normals[chosen].astype(np.float64)
    upright, rolled = _Trial(0), _Trial(0)
    for index in rng.integers(0, _SAMPLES, _TRIALS):
        normal, offset = facing[index], float(-facing[index] @ some[index])
        if offset < 0.15:
            continue
        count = int((np.abs(some @ normal + offset) < 2.0 * tolerance).sum())
        # A table is seen from above: its normal has a part along the image's up direction.
        if normal[1] <= -0.1:
            upright = max(upright, _Trial(count, normal, offset), key=lambda trial: trial.inliers)
        if np.hypot(normal[0], normal[1]) > _OBLIQUE:
            rolled = max(rolled, _Trial(count, normal, offset), key=lambda trial: trial.inliers)
    best = upright if upright.inliers >= share * _SAMPLES else rolled
    if best.inliers < share * _SAMPLES:
        return None
    normal, offset = _fitted(some, best.normal, best.offset, tolerance)
    outline = _outline(points[normals @ normal > 0.8], normal, offset, tolerance)
    return None if outline is None else TablePlane(normal, offset, outline)


def _fitted(points: Array, normal: Array, offset: float, tolerance: float) -> tuple[Array, float]:
    for width in (2.0 * tolerance, tolerance, tolerance, 0.7 * tolerance):
        close = points[np.abs(points @ normal + offset) < width]
        center = close.mean(axis=0)
        axis = np.linalg.svd((close - center).T @ (close - center))[0][:, 2]
        normal = axis if axis @ normal > 0 else -axis
        offset = float(-normal @ center)
    return normal, offset


def _outline(
    points: NDArray[np.float32], normal: Array, offset: float, tolerance: float
) -> NDArray[np.float32] | None:
    plane = TablePlane(normal, offset, np.zeros((0, 2), np.float32))
    T_table = plane.T_table_camera()
    inliers = points[np.abs(plane.height(points)) < tolerance]
    flat = inliers @ T_table[:2, :3].T.astype(np.float32) + T_table[:2, 3].astype(np.float32)
    low = flat.min(axis=0)
    cells = ((flat - low) / _CELL).astype(np.int64)
    count_in = np.zeros(tuple(cells.max(axis=0) + 1), np.int64)
    np.add.at(count_in, (cells[:, 0], cells[:, 1]), 1)
    grid = (count_in >= _LEAST_IN_CELL).astype(np.uint8)
    opened = cv2.morphologyEx(grid, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    closed = cv2.morphologyEx(opened, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed)
    if count < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    kept = flat[labels[cells[:, 0], cells[:, 1]] == largest]
    # counter-clockwise seen from above
    hull = cv2.approxPolyDP(cv2.convexHull(kept.astype(np.float32)), 0.002, True)
    if cv2.contourArea(hull) < _LEAST_AREA:
        return None
    return np.asarray(hull[:, 0, :], np.float32)
