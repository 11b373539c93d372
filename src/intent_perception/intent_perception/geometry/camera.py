"""The pinhole camera, RGB-D frames, and image bytes decoded to arrays.

Pixel (u, v) = (column, row); the centre of the first pixel is (0, 0). Camera coordinates are those
of an optical frame: x right, y down, z forward [m]. Depth is z, not distance.
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_json
from intent_perception.geometry.coded_images import MOST_PIXELS, decode_depth_png, decode_image

DepthImage = NDArray[np.float32]
ColorImage = NDArray[np.uint8]

_MILLIMETRES = np.float32(1000.0)
# sensor encoding -> (channels, order in which its channels give R, G, B)
_COLOR_ENCODINGS: dict[str, tuple[int, tuple[int, int, int]]] = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
    "8UC1": (1, (0, 0, 0)),
    "8UC3": (3, (2, 1, 0)),
}
_CLOSEST, _FARTHEST = 0.1, 20.0  # between them lies the median of a camera's depth [m] …
_USUAL = (0.25, 2.5)  # … and of one that looks at a table
_WIDEST = 100.0
"""Focal lengths lie within this factor of the image's size."""
_COMPRESSED_DEPTH_HEADER = struct.Struct("<iff")


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion (images are rectified)."""

    width: int
    """Columns of the image."""
    height: int
    """Rows of the image."""
    fx: float
    """Focal length in pixels, horizontally."""
    fy: float
    """Focal length in pixels, vertically."""
    cx: float
    """Column of the optical axis."""
    cy: float
    """Row of the optical axis."""

    def __post_init__(self) -> None:
        """Refuse impossible intrinsics."""
        if self.width < 1 or self.height < 1 or self.width * self.height > MOST_PIXELS:
            raise ValueError(f"expected an image of a camera, got {self.width} x {self.height}")
        finite = all(np.isfinite([self.fx, self.fy, self.cx, self.cy]))
        if not finite or self.fx <= 0.0 or self.fy <= 0.0:
            raise ValueError(
                f"expected focal lengths above 0, got fx {self.fx}, fy {self.fy}: the camera "
                "is not calibrated (camera_info with K of zeros?)"
            )
        longest = _WIDEST * max(self.width, self.height)
        center = max(abs(self.cx - 0.5 * self.width), abs(self.cy - 0.5 * self.height))
        if max(self.fx, self.fy, center) > longest or min(self.fx, self.fy) * _WIDEST < self.width:
            raise ValueError(
                f"expected intrinsics in pixels of an image {self.width} x {self.height}, got "
                f"fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}"
            )

    @property
    def matrix(self) -> Array:
        """The intrinsic matrix K (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @classmethod
    def from_matrix(cls, matrix: ArrayLike, width: int, height: int) -> "Camera":
        """Return the camera with the intrinsic matrix K (3, 3) or its 9 values."""
        k = np.asarray(matrix, dtype=np.float64).reshape(3, 3)
        values = (float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2]))
        return cls(int(width), int(height), *values)

    def scaled(self, factor: float) -> "Camera":
        """Return the same camera with an image of factor times the rows and columns."""
        return Camera(
            round(self.width * factor),
            round(self.height * factor),
            self.fx * factor,
            self.fy * factor,
            (self.cx + 0.5) * factor - 0.5,
            (self.cy + 0.5) * factor - 0.5,
        )

    def project(self, points_camera: ArrayLike) -> Array:
        """Return the pixels (..., 2) of points (..., 3) in camera coordinates [m]."""
        points = np.asarray(points_camera, dtype=np.float64)
        depth = points[..., 2]
        column = self.fx * points[..., 0] / depth + self.cx
        row = self.fy * points[..., 1] / depth + self.cy
        return np.stack([column, row], axis=-1)

    def rays(self) -> Array:
        """Return for each pixel the point at depth 1 m, (H, W, 3) in camera coordinates."""
        columns = (np.arange(self.width) - self.cx) / self.fx
        rows = (np.arange(self.height) - self.cy) / self.fy
        x, y = np.meshgrid(columns, rows)
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def backproject(self, depth: NDArray[Any]) -> Array:
        """Return the points (H, W, 3) in camera coordinates [m]; invalid pixels give zeros.

        Raises:
            ValueError: if the depth image is not of the camera's size.
        """
        if depth.shape != (self.height, self.width):
            raise ValueError(f"expected depth {(self.height, self.width)}, got {depth.shape}")
        points: Array = self.rays() * np.asarray(depth, dtype=np.float64)[..., None]
        return points


KINECT = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
"""Intrinsics of the first Kinect as its driver states them; the bags use them too."""


def read_camera(path: Path, size: tuple[int, int] | None = None) -> Camera:
    """Return the camera in a JSON file: {fx, fy, cx, cy}, or {K: 9 numbers}, and {width, height}.

    Args:
        path: the file; the matrix may also be called `k` or `camera_matrix`, as in ROS.
        size: columns and rows of the images; None = the file must say it.

    Raises:
        ValueError: if the file is missing, is no JSON, lacks a value, or is of another image size.
    """
    try:
        stored = read_json(path)
        matrix = stored.get("K", stored.get("k", stored.get("camera_matrix")))
        if isinstance(matrix, dict):
            matrix = matrix.get("data")
        width, height = stored.get("width"), stored.get("height")
        if size is None or None not in (width, height):
            own = int(stored["width"]), int(stored["height"])
            if size not in (None, own):
                raise ValueError(f"a camera of {own[0]} x {own[1]}, the images are {size}")
            size = own
        if matrix is not None:
            return Camera.from_matrix(matrix, *size)
        return Camera(*size, *(float(stored[name]) for name in ("fx", "fy", "cx", "cy")))
    except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
        raise ValueError(
            f"cannot read the camera {path}: expected JSON with width, height and fx, fy, cx, cy "
            f"(or K), got {error!r}"
        ) from error


@dataclass(frozen=True, eq=False)
class RgbdFrame:
    """One colour image and the depth image aligned to it."""

    stamp: int
    """Time of the depth image [ns]."""
    color: ColorImage
    """(H, W, 3) RGB."""
    depth: DepthImage
    """(H, W) [m]; 0 = no measurement."""
    camera: Camera
    """Intrinsics of both images."""

    def __post_init__(self) -> None:
        """Refuse images that do not fit each other or the camera."""
        size = (self.camera.height, self.camera.width)
        if self.color.shape != (*size, 3) or self.color.dtype != np.uint8:
            raise ValueError(
                f"expected colour {(*size, 3)} uint8 as in camera_info, "
                f"got {self.color.shape} {self.color.dtype}"
            )
        if self.depth.shape != size or self.depth.dtype != np.float32:
            raise ValueError(
                f"expected depth {size} float32 as in camera_info, got {self.depth.shape} "
                f"{self.depth.dtype}: depth must be aligned to the colour image"
            )


def clean_depth(depth: NDArray[Any]) -> DepthImage:
    """Return depth (H, W) as float32 [m] in which NaN, infinite and negative values are 0."""
    clean = np.array(depth, dtype=np.float32)
    clean[~(np.isfinite(clean) & (clean > 0.0))] = 0.0
    return clean


def typical_depth(depth: DepthImage) -> float:
    """Return about the median of the measurements in an image (H, W) [m], 0 without any."""
    some = depth[::8, ::8]
    some = some[some > 0.0]
    return float(np.median(some)) if some.size else 0.0


def require_metres(depth: DepthImage) -> DepthImage:
    """Return depth (H, W) that is plausible as metres, or has no measurement.

    Raises:
        ValueError: for other depth, with the unit that it probably is in.
    """
    typical = typical_depth(depth)
    if typical == 0.0 or _CLOSEST < typical < _FARTHEST:
        return depth
    raise ValueError(
        f"the depth's median is {typical:.3g} m: wrong unit? Give --depth-scale (parameter "
        f"depth_scale), the length of one unit in metres{_likely_scale(typical)}"
    )


def _likely_scale(typical: float) -> str:
    return ": 0.001 for numbers in millimetres" if 100.0 < typical < 20000.0 else ""


def depth_advice(depth: DepthImage) -> str:
    """Return a sentence on the unit of depth (H, W) in which no table is seen; "" if it is fine."""
    typical = typical_depth(depth)
    if typical == 0.0 or _USUAL[0] < typical < _USUAL[1]:
        return ""
    return (
        f"; the depth's median is {typical:.2g} m: if its unit is wrong, give --depth-scale "
        "(parameter depth_scale), for instance 0.00025 or 0.0001 for quarters or tenths of a "
        "millimetre"
    )


def depth_from_millimetres(depth: NDArray[Any]) -> DepthImage:
    """Return depth [m] from integers [mm]; the one place where that division is made."""
    metres: DepthImage = depth.astype(np.float32) / _MILLIMETRES
    return metres


def decode_depth(
    encoding: str, height: int, width: int, step: int, is_bigendian: bool, data: bytes
) -> DepthImage:
    """Return depth (H, W) [m] from the fields of a sensor_msgs/Image.

    Args:
        encoding: "16UC1" or "mono16" (millimetres), "32FC1" (metres).
        height: rows.
        width: columns.
        step: bytes of one row, padding included.
        is_bigendian: whether values are stored with the most significant byte first.
        data: step * height bytes.

    Raises:
        ValueError: for an unknown encoding or when the bytes are too few.
    """
    order = ">" if is_bigendian else "<"
    if encoding in ("16UC1", "mono16"):
        return depth_from_millimetres(_rows(data, height, width, step, np.dtype(f"{order}u2"), 1))
    if encoding == "32FC1":
        return clean_depth(_rows(data, height, width, step, np.dtype(f"{order}f4"), 1))
    raise ValueError(f"expected depth encoded as 16UC1 or 32FC1, got {encoding!r}")


def decode_color(
    encoding: str, height: int, width: int, step: int, is_bigendian: bool, data: bytes
) -> ColorImage:
    """Return RGB (H, W, 3) from the fields of a sensor_msgs/Image (see `decode_depth`).

    Raises:
        ValueError: for an unknown encoding or when the bytes are too few.
    """
    if encoding not in _COLOR_ENCODINGS:
        known = ", ".join(sorted(_COLOR_ENCODINGS))
        raise ValueError(f"expected colour encoded as one of {known}, got {encoding!r}")
    channels, order = _COLOR_ENCODINGS[encoding]
    pixels = _rows(data, height, width, step, np.dtype(np.uint8), channels)
    pixels = pixels.reshape(height, width, channels)
    planes = cv2.split(pixels) if channels > 1 else (pixels[..., 0],)
    return np.asarray(cv2.merge([planes[k] for k in order]))


def decode_compressed_depth(data: bytes, format_name: str = "compressedDepth") -> DepthImage:
    """Return depth (H, W) [m] from the data of a compressedDepth image or of a PNG of 16 bits.

    The format is that of compressed_depth_image_transport: a header of 12 bytes (an integer and the
    two quantisation parameters), then a PNG of 16 bits, either millimetres (parameters 0) or, for
    32FC1, the quantised inverse depth. A driver that compresses depth as if it were colour sends
    the PNG alone.

    Raises:
        ValueError: when the data cannot be decoded, with the remedy where it is RVL.
    """
    if "rvl" in format_name.lower():
        raise ValueError(
            "depth compressed as RVL cannot be read: record with the parameter "
            "…compressedDepth.format:=png of the driver's publisher, or record the raw depth"
        )
    if bytes(data[:8]) == b"\x89PNG\r\n\x1a\n":
        return depth_from_millimetres(decode_depth_png(bytes(data)))
    if len(data) <= _COMPRESSED_DEPTH_HEADER.size:
        raise ValueError(f"expected compressedDepth with header and PNG, got {len(data)} bytes")
    _, quant_a, quant_b = _COMPRESSED_DEPTH_HEADER.unpack_from(data)
    image = decode_depth_png(bytes(data[_COMPRESSED_DEPTH_HEADER.size :]))
    if quant_a == 0.0 and quant_b == 0.0:
        return depth_from_millimetres(image)
    with np.errstate(divide="ignore"):
        metres = quant_a / (image.astype(np.float32) - np.float32(quant_b))
    metres[image == 0] = 0.0
    return clean_depth(metres)


def decode_compressed_color(data: bytes) -> ColorImage:
    """Return RGB (H, W, 3) from the data of a compressed (JPEG or PNG) image.

    Raises:
        ValueError: when the data cannot be decoded.
    """
    image = decode_image(data, cv2.IMREAD_COLOR)
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))  # 10 times as fast as by strides


def encode_compressed_depth(millimetres: NDArray[np.uint16]) -> bytes:
    """Return the data of a compressedDepth image of 16UC1 depth (H, W) [mm], lossless."""
    done, png = cv2.imencode(".png", millimetres, [cv2.IMWRITE_PNG_COMPRESSION, 6])
    if not done:
        raise ValueError(f"expected depth (H, W) uint16, got {millimetres.shape}")
    return b"".join((_COMPRESSED_DEPTH_HEADER.pack(0, 0.0, 0.0), png.tobytes()))


def _rows(
    data: bytes, height: int, width: int, step: int, dtype: np.dtype[Any], channels: int
) -> NDArray[Any]:
    """Return (H, W * channels) values without the padding of the rows."""
    row = width * channels * dtype.itemsize
    if height < 1 or width < 1 or step < row:
        raise ValueError(f"expected rows of at least {row} bytes, got step {step}, height {height}")
    buffer = np.frombuffer(data, dtype=np.uint8)
    if buffer.size < step * height:
        raise ValueError(
            f"expected {step * height} bytes ({height} rows of {step}), got {buffer.size}: "
            "the image is truncated or its size is wrong"
        )
    rows = buffer[: step * height].reshape(height, step)[:, :row]
    return np.ascontiguousarray(rows).view(dtype)
