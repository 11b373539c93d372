"""What a sensor_msgs/CameraInfo says of images: their pinhole camera, and the lens to be undone.

K and P are of the full sensor; a region of interest and binning make the image smaller. Images
that are not rectified are undistorted once, with maps that are kept for all frames of a camera.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_yaml
from intent_perception.basics.safe_files import write_text
from intent_perception.geometry.camera import Camera, read_camera

_MODELS = {"plumb_bob": (4, 5), "rational_polynomial": (8, 12, 14), "equidistant": (4,)}
"""Distortion models that are undone, and how many coefficients they have."""
_STRAIGHT = 1e-6  # coefficients smaller than this bend nothing
_OFF_CENTER = 0.3
"""Farther from the middle than this share of the image no optical axis lies."""


@dataclass(frozen=True, eq=False)
class Lens:
    """The camera of rectified images and how images of its lens become such."""

    camera: Camera
    """Of the rectified images."""
    maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None
    """(H, W) columns and rows at which rectified pixels are seen; None: there is no distortion."""

    def rectified[Image: NDArray[Any]](self, image: Image, nearest: bool) -> Image:
        """Return an image without the lens's distortion; 0 where nothing was seen.

        Args:
            image: (H, W) or (H, W, 3).
            nearest: take the nearest pixel (depth must not be mixed across edges).
        """
        if self.maps is None:
            return image
        if image.shape[:2] != self.maps[0].shape:
            raise ValueError(
                f"expected images {self.maps[0].shape} as in camera_info, got {image.shape[:2]}"
            )
        flag = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
        undone: Image = cv2.remap(image, *self.maps, flag)
        return undone


def camera_from(info: Any) -> Camera:
    """Return the camera of rectified images from a sensor_msgs/CameraInfo.

    The projection matrix P describes rectified images; drivers that publish only rectified images
    sometimes leave it zero and fill K alone.

    Raises:
        ValueError: if neither holds focal lengths, or they are of another image size.
    """
    if not np.all(np.isfinite([*info.p, *info.k])):
        raise ValueError("expected camera_info of numbers, got NaN or infinity in K or P")
    return _reduced(_projection(info), info)


def lens_from(info: Any) -> Lens:
    """Return the lens of images that are not rectified, from a sensor_msgs/CameraInfo.

    Raises:
        ValueError: for a distortion model that is not known, with the remedy.
    """
    camera, model = camera_from(info), str(getattr(info, "distortion_model", ""))
    d = tuple(float(value) for value in getattr(info, "d", ()))
    if not np.all(np.isfinite(d)):
        raise ValueError("expected camera_info of numbers, got NaN or infinity in D")
    if not d or max(abs(value) for value in d) < _STRAIGHT:
        return Lens(camera, None)
    if model not in _MODELS or len(d) not in _MODELS[model]:
        known = ", ".join(f"{name} ({' or '.join(map(str, n))})" for name, n in _MODELS.items())
        raise ValueError(
            f"the lens's distortion {model!r} with {len(d)} coefficients cannot be undone, only "
            f"{known}: give the driver's rectified images (image_rect of image_proc)"
        )
    k = tuple(float(value) for value in info.k)
    r = tuple(float(value) for value in getattr(info, "r", ()))
    sensor = _reduced(Camera.from_matrix(np.array(k), int(info.width), int(info.height)), info)
    return Lens(camera, _maps(model, d, sensor, r, camera))


@lru_cache(maxsize=4)
def _maps(
    model: str, d: tuple[float, ...], sensor: Camera, r: tuple[float, ...], camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where the pixels of a rectified image are seen through the lens."""
    rotation: Array = np.array(r).reshape(3, 3) if len(r) == 9 and any(r) else np.eye(3)
    undo = (cv2.fisheye if model == "equidistant" else cv2).initUndistortRectifyMap
    size = (camera.width, camera.height)
    columns, rows = undo(sensor.matrix, np.array(d), rotation, camera.matrix, size, cv2.CV_32FC1)
    return np.asarray(columns), np.asarray(rows)


def _projection(info: Any) -> Camera:
    """Return the camera of the full sensor, rectified."""
    width, height = int(info.width), int(info.height)
    if info.p[0] > 0.0:
        return Camera(width, height, *(float(info.p[i]) for i in (0, 5, 2, 6)))
    return Camera.from_matrix(np.asarray(info.k, dtype=np.float64), width, height)


def _reduced(camera: Camera, info: Any) -> Camera:
    """Return the camera of the image that binning and the region of interest leave."""
    require_centered(camera)
    roi = getattr(info, "roi", None)
    across = max(1, int(getattr(info, "binning_x", 0)))
    down = max(1, int(getattr(info, "binning_y", 0)))
    left, top = (int(roi.x_offset), int(roi.y_offset)) if roi is not None else (0, 0)
    width = (int(roi.width) if roi is not None else 0) or camera.width - left
    height = (int(roi.height) if roi is not None else 0) or camera.height - top
    if (across, down, left, top, width, height) == (1, 1, 0, 0, camera.width, camera.height):
        return camera
    return Camera(
        width // across,
        height // down,
        camera.fx / across,
        camera.fy / down,
        (camera.cx - left) / across,
        (camera.cy - top) / down,
    )


def require_centered(camera: Camera) -> Camera:
    """Return a camera whose optical axis meets the image near its middle.

    Raises:
        ValueError: for another, whose intrinsics are of another image size.
    """
    across = abs(camera.cx / camera.width - 0.5)
    down = abs(camera.cy / camera.height - 0.5)
    if max(across, down) > _OFF_CENTER:
        raise ValueError(
            f"expected intrinsics of images {camera.width} x {camera.height}, got cx "
            f"{camera.cx:g}, cy {camera.cy:g}, as of about {round(2 * camera.cx)} x "
            f"{round(2 * camera.cy)}: give the camera_info of these very images"
        )
    return camera


def read_lens(path: Path, size: tuple[int, int] | None = None) -> Lens:
    """Return the lens in a camera file: ROS's camera yaml, or JSON without distortion.

    Args:
        path: YAML as camera_calibration writes it (camera_matrix, distortion_coefficients, …), or
            JSON, see `read_camera`.
        size: columns and rows of the images; None = the file must say it.

    Raises:
        ValueError: if the file cannot be read, lacks a value or is of another image size.
    """
    if path.suffix.lower() not in (".yaml", ".yml"):
        return Lens(require_centered(read_camera(path, size)), None)
    stored = read_yaml(path)
    try:
        info = _Stored(
            int(stored["image_width"]),
            int(stored["image_height"]),
            _numbers(stored, "camera_matrix", 9),
            _numbers(stored, "projection_matrix", 12),
            _numbers(stored, "rectification_matrix", 9),
            _numbers(stored, "distortion_coefficients", 0),
            str(stored.get("distortion_model", "plumb_bob")),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(
            f"cannot read the camera {path}: expected image_width, image_height, camera_matrix and "
            f"distortion_coefficients as in ROS's camera_info files, got {error!r}"
        ) from error
    if size is not None and size != (info.width, info.height):
        raise ValueError(f"{path} is of images {info.width} x {info.height}, these are {size}")
    try:
        return lens_from(info)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


@dataclass(frozen=True)
class _Stored:
    """A camera file's content under the names of a CameraInfo."""

    width: int
    height: int
    k: tuple[float, ...]
    p: tuple[float, ...]
    r: tuple[float, ...]
    d: tuple[float, ...]
    distortion_model: str


def _numbers(stored: dict[str, Any], name: str, count: int) -> tuple[float, ...]:
    """Return the numbers of a matrix; zeros where it is not there and may be missing."""
    if name not in stored and count != 9:
        return (0.0,) * count
    if name == "rectification_matrix" and name not in stored:
        return ()
    values = tuple(float(value) for value in stored[name]["data"])
    if count and len(values) != count:
        raise ValueError(f"{name} of {len(values)} numbers")
    return values


def write_camera_yaml(path: Path | str, camera: Camera, name: str = "camera") -> None:
    """Write the camera of rectified images as ROS's camera yaml."""
    k = camera.matrix
    content = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": _matrix(k),
        "distortion_model": "plumb_bob",
        "distortion_coefficients": _matrix(np.zeros((1, 5))),
        "rectification_matrix": _matrix(np.eye(3)),
        "projection_matrix": _matrix(np.concatenate([k, np.zeros((3, 1))], axis=1)),
    }
    write_text(path, yaml.safe_dump(content, sort_keys=False))


def _matrix(values: Array) -> dict[str, Any]:
    rows, columns = values.shape
    return {"rows": rows, "cols": columns, "data": [float(value) for value in values.ravel()]}
