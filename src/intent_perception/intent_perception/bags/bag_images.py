"""RGB-D frames as the sensor messages that a bag stores (no ROS needed)."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from intent_perception.bags.bag_topics import COLOR_TOPIC, COMPRESSED, DEPTH_TOPIC, IMAGE, INFO
from intent_perception.bags.frame_assembly import NANOSECONDS
from intent_perception.geometry.camera import Camera, ColorImage, encode_compressed_depth

STORE = get_typestore(Stores.ROS2_JAZZY)
CAMERA_FRAME = "camera_color_optical_frame"
DEPTH_FORMATS = ("compressedDepth", "16UC1", "32FC1")


def _make(kind: str, *values: Any, **fields: Any) -> Any:
    return STORE.types[kind](*values, **fields)


def header_message(stamp: int) -> Any:
    """Return a header in the camera's frame at a time [ns]."""
    time = _make("builtin_interfaces/msg/Time", *divmod(stamp, NANOSECONDS))
    return _make("std_msgs/msg/Header", time, CAMERA_FRAME)


def info_message(header: Any, camera: Camera) -> Any:
    """Return the camera_info of rectified images."""
    roi = _make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, do_rectify=False)
    projection = np.zeros((3, 4))
    projection[:, :3] = camera.matrix
    return _make(
        INFO,
        header=header,
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=camera.matrix.ravel(),
        r=np.eye(3).ravel(),
        p=projection.ravel(),
        binning_x=0,
        binning_y=0,
        roi=roi,
    )


def color_message(header: Any, color: ColorImage, kind: str, quality: int) -> tuple[str, Any]:
    """Return topic and message of a colour image (H, W, 3) RGB, kind "raw" or "jpeg"."""
    if kind == "raw":
        return COLOR_TOPIC, _image(header, "rgb8", np.ascontiguousarray(color))
    bgr = np.ascontiguousarray(color[..., ::-1])
    done, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError(f"expected an image that JPEG can hold, got {color.shape}")
    message = _make(COMPRESSED, header, "rgb8; jpeg compressed bgr8", jpeg.ravel())
    return f"{COLOR_TOPIC}/compressed", message


def depth_message(header: Any, depth: NDArray[Any], kind: str) -> tuple[str, Any]:
    """Return topic and message of depth (H, W) [m] in one of `DEPTH_FORMATS`, whole millimetres."""
    millimetres = np.clip(np.rint(depth * 1000.0), 0, 65535).astype(np.uint16)
    if kind == "16UC1":
        return DEPTH_TOPIC, _image(header, "16UC1", millimetres)
    if kind == "32FC1":
        metres = millimetres.astype(np.float32) / np.float32(1000.0)
        metres[millimetres == 0] = np.nan  # REP 118: no measurement
        return DEPTH_TOPIC, _image(header, "32FC1", metres)
    data = np.frombuffer(encode_compressed_depth(millimetres), dtype=np.uint8)
    message = _make(COMPRESSED, header, "16UC1; compressedDepth png", data)
    return f"{DEPTH_TOPIC}/compressedDepth", message


def _image(header: Any, encoding: str, pixels: Any) -> Any:
    rows = pixels.reshape(pixels.shape[0], -1)
    return _make(
        IMAGE,
        header=header,
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=rows.shape[1] * rows.itemsize,
        data=np.frombuffer(rows.tobytes(), dtype=np.uint8),
    )
