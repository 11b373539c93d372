"""The table plane in a depth image: where "height" and the frame `table` come from."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.transforms import inverse, make_pose

_CELL = 0.02  # edge of the grid cells that decide which inliers hang together [m]
_LEAST_IN_CELL = 2
_LEAST_AREA = 0.03  # smaller planes are sides of objects [m^2]
_PIECE = 0.15  # what is this large beside the largest piece of a plane belongs to it
_ALONG = 0.995  # cosine beyond which the image's right is no direction on the table


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

        Where the optical axis misses the table, the origin is the point below the camera. Of a
        camera on its side that looks along the table, x is its view instead.
        """
        z = self.normal
        right = np.array([1.0, 0.0, 0.0] if abs(z[0]) < _ALONG else [0.0, 0.0, 1.0])
        x = right - (right @ z) * z
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


def fitted_plane(
    points: Array, normal: Array, offset: float, tolerance: float
) -> tuple[Array, float]:
    """Return normal (3,) and offset [m] of the plane through those of points (N, 3) near a guess.

    Args:
        points: of the scene, camera frame [m].
        normal: of the guess.
        offset: of the guess [m].
        tolerance: deviation of the plane's points from it [m].
    """
    for width in (2.0 * tolerance, tolerance, tolerance, 0.7 * tolerance):
        close = points[np.abs(points @ normal + offset) < width]
        center = close.mean(axis=0)
        axis = np.linalg.svd((close - center).T @ (close - center))[0][:, 2]
        normal = axis if axis @ normal > 0 else -axis
        offset = float(-normal @ center)
    return normal, offset


def outlined_plane(
    points: NDArray[np.float32], normal: Array, offset: float, tolerance: float
) -> TablePlane | None:
    """Return a plane with the outline of what points (N, 3) show of it.

    None where that is not as large as a table.
    """
    plane = TablePlane(normal, offset, np.zeros((0, 2), np.float32))
    T_table = plane.T_table_camera()
    inliers = points[np.abs(plane.height(points)) < tolerance]
    if len(inliers) == 0:
        return None
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
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    pieces = areas >= _PIECE * areas.max()  # an arm across the table cuts it
    kept = flat[pieces[labels[cells[:, 0], cells[:, 1]]]]
    # counter-clockwise seen from above
    hull = cv2.approxPolyDP(cv2.convexHull(kept.astype(np.float32)), 0.002, True)
    if cv2.contourArea(hull) < _LEAST_AREA:
        return None
    return replace(plane, outline=np.asarray(hull[:, 0, :], np.float32))
