"""Projection, frames, and images decoded from bytes."""

import struct

import cv2
import numpy as np
import pytest

from intent_perception.geometry import camera as c
from intent_perception.geometry.camera import KINECT, Camera, RgbdFrame


def millimetres() -> np.ndarray:
    image = np.random.default_rng(0).integers(0, 4000, (12, 17)).astype(np.uint16)
    image[0, :5] = 0
    return image


def test_projection_inverts_backprojection() -> None:
    depth = np.random.default_rng(0).uniform(0.4, 2.0, (480, 640))
    points = KINECT.backproject(depth)
    rows, columns = np.mgrid[:480, :640]
    np.testing.assert_allclose(KINECT.project(points), np.stack([columns, rows], -1), atol=1e-9)


def test_scaled_camera_sees_the_same_field() -> None:
    half = KINECT.scaled(0.5)
    assert (half.width, half.height) == (320, 240)
    corner = np.array([-0.5, -0.5]) - [KINECT.cx, KINECT.cy]
    corner_half = np.array([-0.5, -0.5]) - [half.cx, half.cy]
    np.testing.assert_allclose(corner / KINECT.fx, corner_half / half.fx)


def test_depth_of_every_encoding_is_the_same_bits() -> None:
    image = millimetres()
    metres = image.astype(np.float32) / np.float32(1000)
    raw = c.decode_depth("16UC1", 12, 17, 34, False, image.tobytes())
    big = c.decode_depth("16UC1", 12, 17, 34, True, image.astype(">u2").tobytes())
    floats = c.decode_depth("32FC1", 12, 17, 68, False, metres.tobytes())
    png = c.decode_compressed_depth(c.encode_compressed_depth(image))
    for decoded in (raw, big, floats, png):
        assert decoded.dtype == np.float32
        np.testing.assert_array_equal(decoded, metres)


def test_padding_at_the_end_of_rows_is_skipped() -> None:
    image = millimetres()
    padded = np.full((12, 20), 777, np.uint16)
    padded[:, :17] = image
    decoded = c.decode_depth("16UC1", 12, 17, 40, False, padded.tobytes())
    np.testing.assert_array_equal(decoded, c.depth_from_millimetres(image))


def test_invalid_depth_becomes_zero() -> None:
    image = np.array([[np.nan, np.inf, -np.inf, -1.0, 0.7]], np.float32)
    decoded = c.decode_depth("32FC1", 1, 5, 20, False, image.tobytes())
    np.testing.assert_array_equal(decoded, np.array([[0, 0, 0, 0, 0.7]], np.float32))


def test_quantised_inverse_depth_is_decoded() -> None:
    depth = np.linspace(0.5, 3.0, 12, dtype=np.float32).reshape(3, 4)
    a, b = 50.0, 1.0
    png = cv2.imencode(".png", np.round(a / depth + b).astype(np.uint16))[1].tobytes()
    decoded = c.decode_compressed_depth(struct.pack("<iff", 0, a, b) + png)
    np.testing.assert_allclose(decoded, depth, rtol=0.05)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8"])
def test_color_channels_come_out_as_rgb(encoding: str) -> None:
    color = np.random.default_rng(0).integers(0, 255, (5, 6, 3)).astype(np.uint8)
    stored = color if encoding.startswith("rgb") else color[..., ::-1]
    if encoding.endswith("a8"):
        stored = np.concatenate([stored, np.full((5, 6, 1), 255, np.uint8)], axis=2)
    data = np.ascontiguousarray(stored).tobytes()
    decoded = c.decode_color(encoding, 5, 6, stored.shape[2] * 6, False, data)
    np.testing.assert_array_equal(decoded, color)


def test_compressed_color_is_rgb() -> None:
    color = np.zeros((8, 8, 3), np.uint8)
    color[..., 0] = 200
    png = cv2.imencode(".png", color[..., ::-1])[1].tobytes()
    np.testing.assert_array_equal(c.decode_compressed_color(png), color)


@pytest.mark.parametrize("data", [b"", b"nonsense that is no image", b"\x89PNG\r\n\x1a\n"])
def test_damaged_compressed_images_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="expected"):
        c.decode_compressed_color(data)
    with pytest.raises(ValueError, match="expected"):
        c.decode_compressed_depth(bytes(12) + data)


def test_truncated_and_unknown_images_are_refused() -> None:
    with pytest.raises(ValueError, match="truncated"):
        c.decode_depth("16UC1", 12, 17, 34, False, bytes(100))
    with pytest.raises(ValueError, match="at least 34"):
        c.decode_depth("16UC1", 12, 17, 20, False, bytes(1000))
    with pytest.raises(ValueError, match="64FC1"):
        c.decode_depth("64FC1", 1, 1, 8, False, bytes(8))
    with pytest.raises(ValueError, match="yuv"):
        c.decode_color("yuv422", 1, 1, 8, False, bytes(8))


def test_frame_refuses_images_of_another_size() -> None:
    color, depth = np.zeros((480, 640, 3), np.uint8), np.zeros((480, 640), np.float32)
    RgbdFrame(1, color, depth, KINECT)
    with pytest.raises(ValueError, match="aligned"):
        RgbdFrame(1, color, depth[:240, :320], KINECT)
    with pytest.raises(ValueError, match="camera_info"):
        RgbdFrame(1, color[:-1], depth, KINECT)


def test_camera_of_zeros_is_refused() -> None:
    with pytest.raises(ValueError, match="not calibrated"):
        Camera.from_matrix(np.zeros(9), 640, 480)
