"""T_table_camera: from a chessboard that lies on the table, or from the table's plane in depth.

With a board, the frame `table` has its origin in the middle of the board's inner corners, z up (out
of the board) and x along the side of the board that points most to the right in the image, so the
answer does not depend on which way round the board lies. Without a board, the origin is where the
optical axis meets the table, z is the table's normal and x the image's right projected on the table
(`table.TablePlane`).
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_json
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import Camera, ColorImage, DepthImage, RgbdFrame
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    require_pose,
    rotation_from_vector,
)
from intent_perception.scene.oriented_image import orient
from intent_perception.scene.table_search import find_table


@dataclass(frozen=True)
class Chessboard(Checked):
    """A printed chessboard."""

    columns: int = 8
    """Inner corners along one side, 3..50."""
    rows: int = 6
    """Inner corners along the other side, 3..50."""
    square: float = 0.025
    """Edge of a square [m], measured on the print, 0.002..0.5."""

    @property
    def corners(self) -> Array:
        """The inner corners (columns * rows, 3) in the board's frame, centred, z = 0 [m]."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        grid = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(np.float64)
        return (grid - [0.5 * (self.columns - 1), 0.5 * (self.rows - 1), 0.0]) * self.square


@dataclass(frozen=True)
class CalibrationConfig(Checked):
    """How the table is found, and which answers are trusted."""

    max_error: float = 1.0
    """Greatest root-mean-square distance between seen and predicted corners [pixel],
    0.05..10."""
    focal_length: float = 525.0
    """Depth images of a longer focal length are reduced to about this one [pixel],
    100..2000."""
    normal_radius: float = 0.015
    """Half the window in which normals are estimated [m], 0.002..0.1."""
    max_depth: float = 2.5
    """Depth beyond is no table [m], 0.3..10."""
    tolerance: float = 0.008
    """Deviation of the table top from a plane [m], 0.001..0.05."""
    share: float = 0.15
    """Least share of the image that the table covers, 0..1."""
    seed: int = 0
    """Seed of the trial planes, 0..2147483647."""


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """Where the camera is."""

    T_table_camera: Array
    """(4, 4) camera -> table."""
    source: str
    """"chessboard" or "table" (the plane in the depth image)."""
    error: float
    """Root mean square of the residual: of the corners [pixel], or 0 for a table."""


def read_calibration(path: Path | str, key: str = "T_table_camera") -> Array:
    """Return T_table_camera (4, 4) of a JSON file that `calibrate` wrote, or another pose in it.

    Raises:
        ValueError: if the file holds no pose of a camera.
    """
    stored = read_json(path)
    try:
        pose = np.array(stored[key], dtype=np.float64)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ValueError(
            f"cannot read the calibration {path}: expected {key}, got {error!r}"
        ) from error
    return require_pose(pose, f"{key} in {path}")


def calibrate(
    frame: RgbdFrame, board: Chessboard | None = None, config: CalibrationConfig | None = None
) -> CameraCalibration | None:
    """Return where the camera is: from the board if it is seen, else from the table's plane.

    Args:
        frame: colour and depth of one moment; depth of zeros is fine where a board is seen.
        board: the board to look for; None = only the table.
        config: how the table is found.

    Returns:
        The calibration, or None if there is neither.
    """
    config = config or CalibrationConfig()
    found = find_board(frame.color, frame.camera, board, config) if board is not None else None
    if found is not None:
        return found
    T_table_camera = fit_table(frame.depth, frame.camera, config)
    return None if T_table_camera is None else CameraCalibration(T_table_camera, "table", 0.0)


def find_board(
    color: ColorImage,
    camera: Camera,
    board: Chessboard,
    config: CalibrationConfig | None = None,
) -> CameraCalibration | None:
    """Return where the camera is, from a chessboard of known size in its image (H, W, 3) RGB.

    Returns:
        None if no board with this number of inner corners is seen clearly.
    """
    config = config or CalibrationConfig()
    grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
    pattern = (board.columns, board.rows)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    seen, pixels = cv2.findChessboardCornersSB(grey, pattern, flags=flags)
    if not seen:
        return None
    pixels = _refined(grey, np.asarray(pixels, dtype=np.float32), board)
    corners = board.corners
    # The planar solver gives the two poses that look alike; refined, the better one is told.
    count, vectors, shifts, _ = cv2.solvePnPGeneric(
        corners, pixels, camera.matrix, None, flags=cv2.SOLVEPNP_IPPE
    )
    best: tuple[float, Array] | None = None
    for k in range(count):
        vector, shift = cv2.solvePnPRefineLM(
            corners, pixels, camera.matrix, None, vectors[k], shifts[k]
        )
        T_camera_board = make_pose(rotation_from_vector(vector.ravel()), shift.ravel())
        predicted = camera.project(corners @ T_camera_board[:3, :3].T + T_camera_board[:3, 3])
        error = float(np.sqrt(np.mean(np.sum((predicted - pixels) ** 2, axis=1))))
        if best is None or error < best[0]:
            best = error, T_camera_board
    if best is None or best[0] > config.max_error:
        return None
    T_camera_table = _upright(best[1])
    return CameraCalibration(inverse(T_camera_table), "chessboard", best[0])


def _refined(grey: NDArray[np.uint8], pixels: NDArray[np.float32], board: Chessboard) -> Array:
    """Return the corners (N, 2) moved to where the grey values' gradients agree.

    The detector's own positions are about 0.02 pixel off to one side, a millimetre at 0.9 m.
    """
    grid = pixels.reshape(board.rows, board.columns, 2)
    spacing = min(float(np.linalg.norm(np.diff(grid, axis=k), axis=2).min()) for k in (0, 1))
    half = int(np.clip(0.35 * spacing, 2, 6))  # the window must hold one corner only
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 60, 1e-4)
    refined = cv2.cornerSubPix(grey, pixels.reshape(-1, 1, 2).copy(), (half, half), (-1, -1), stop)
    return np.asarray(refined, dtype=np.float64).reshape(-1, 2)


def _upright(T_camera_board: Array) -> Array:
    """Return T_camera_table: z towards the camera, x the side that points right in the image."""
    rotation, position = T_camera_board[:3, :3], T_camera_board[:3, 3]
    z = rotation[:, 2] if rotation[:, 2] @ position < 0.0 else -rotation[:, 2]
    sides = np.stack([rotation[:, 0], rotation[:, 1], -rotation[:, 0], -rotation[:, 1]])
    right = np.array([1.0, 0.0, 0.0])
    x = sides[int(np.argmax(sides @ (right - (right @ z) * z)))]
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), position)


def fit_table(
    depth: DepthImage, camera: Camera, config: CalibrationConfig | None = None
) -> Array | None:
    """Return T_table_camera (4, 4) from the table's plane in a depth image, or None without one.

    Args:
        depth: (H, W) [m], 0 = no measurement.
        camera: intrinsics of the depth image.
        config: what a table is.
    """
    config = config or CalibrationConfig()
    color = np.zeros((*depth.shape, 3), np.uint8)
    frame = RgbdFrame(0, color, depth, camera)
    image = orient(frame, config.focal_length, config.normal_radius, config.max_depth)
    rng = np.random.default_rng(config.seed)
    plane = find_table(image, rng, config.tolerance, config.share)
    return None if plane is None else plane.T_table_camera()
