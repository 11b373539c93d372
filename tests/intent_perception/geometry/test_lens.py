"""CameraInfo as drivers fill it: distortion, regions of interest, binning, other units."""

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from intent_perception.bags.frame_assembly import FrameMessages, Straight, depth_from
from intent_perception.geometry.camera import Camera, depth_advice
from intent_perception.geometry.lens import camera_from, lens_from

K = [500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0]
DISTORTIONS = {
    "plumb_bob": [-0.25, 0.08, 0.001, -0.002, 0.01],
    "rational_polynomial": [0.4, -2.4, 0.0005, -0.0003, 1.4, 0.3, -2.2, 1.3],
    "equidistant": [-0.03, 0.01, -0.004, 0.0005],
}


def info(**changes: Any) -> SimpleNamespace:
    roi = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0, do_rectify=False)
    fields: dict[str, Any] = {
        "width": 640, "height": 480, "k": K, "p": [0.0] * 12, "r": np.eye(3).ravel().tolist(),
        "d": [0.0] * 5, "distortion_model": "plumb_bob", "binning_x": 0, "binning_y": 0, "roi": roi,
    }  # fmt: skip
    return SimpleNamespace(**(fields | changes))


@pytest.mark.parametrize("model", DISTORTIONS)
def test_a_pixel_of_the_distorted_image_moves_to_where_a_pinhole_sees_it(model: str) -> None:
    d, point = np.array(DISTORTIONS[model]), np.array([0.35, -0.22, 1.0])
    project = cv2.fisheye.projectPoints if model == "equidistant" else cv2.projectPoints
    matrix, nothing = np.array(K).reshape(3, 3), np.zeros(3)
    if model == "equidistant":
        seen = project(point.reshape(1, 1, 3), nothing, nothing, matrix, d)[0].ravel()
    else:
        seen = project(point.reshape(1, 3), nothing, nothing, matrix, d)[0].ravel()
    image = np.zeros((480, 640), np.float32)
    cv2.circle(image, (round(seen[0] * 16), round(seen[1] * 16)), 5 * 16, 1.0, -1, shift=4)
    lens = lens_from(info(distortion_model=model, d=d.tolist()))
    rows, columns = np.nonzero(lens.rectified(image, nearest=False) > 0.5)
    expected = lens.camera.project(point)
    assert np.linalg.norm(expected - seen) > 2.0  # the case tells something
    assert np.allclose([columns.mean(), rows.mean()], expected, atol=0.6)


def test_images_without_distortion_stay_as_they_are() -> None:
    image = np.ones((480, 640), np.float32)
    assert lens_from(info()).rectified(image, nearest=True) is image


def test_an_unknown_distortion_is_refused_with_the_remedy() -> None:
    with pytest.raises(ValueError, match=r"'thin_lens' with 3 coefficients.*image_rect"):
        lens_from(info(distortion_model="thin_lens", d=[0.1, 0.2, 0.3]))


def test_a_region_of_interest_moves_the_optical_axis() -> None:
    roi = SimpleNamespace(x_offset=100, y_offset=60, width=400, height=300)
    assert camera_from(info(roi=roi)) == Camera(400, 300, 500.0, 510.0, 220.0, 180.0)


def test_binning_shrinks_the_camera() -> None:
    assert camera_from(info(binning_x=2, binning_y=2)) == Camera(320, 240, 250.0, 255.0, 160.0, 120)


def test_intrinsics_of_another_image_size_are_refused() -> None:
    larger = [1000.0, 0.0, 640.0, 0.0, 1000.0, 360.0, 0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match=r"640 x 480, got cx 640.*about 1280 x 720"):
        camera_from(info(k=larger))


def depth_message(values: np.ndarray[Any, Any], encoding: str) -> SimpleNamespace:
    height, width = values.shape
    fields = {"encoding": encoding, "height": height, "width": width, "is_bigendian": 0}
    return SimpleNamespace(**fields, step=values.itemsize * width, data=values.tobytes())


@pytest.mark.parametrize(
    ("stored", "encoding", "scale"),
    [
        (800, "16UC1", 0.0),
        (3200, "16UC1", 0.00025),
        (8000, "16UC1", 0.0001),
        (0.8, "32FC1", 0.0),
        (800.0, "32FC1", 0.001),
    ],
)
def test_depth_of_any_unit_becomes_metres(stored: float, encoding: str, scale: float) -> None:
    kind = np.uint16 if encoding == "16UC1" else np.float32
    message = depth_message(np.full((4, 4), stored, kind), encoding)
    assert depth_from(message, scale) == pytest.approx(0.8)


def test_depth_in_another_unit_is_refused_with_the_option() -> None:
    far = depth_message(np.full((480, 640), 800.0, np.float32), "32FC1")
    color = SimpleNamespace(
        encoding="rgb8", height=480, width=640, is_bigendian=0, step=1920, data=bytes(480 * 1920)
    )
    messages = FrameMessages(0, color, far, info())
    with pytest.raises(
        ValueError, match=r"median is 800 m: wrong unit\? Give --depth-scale.*0\.001"
    ):
        messages.decoded()


def test_quarter_millimetres_read_as_whole_ones_are_suspected() -> None:
    assert "--depth-scale" in depth_advice(np.full((64, 64), 3.4, np.float32))
    assert depth_advice(np.full((64, 64), 0.8, np.float32)) == ""


def test_colour_and_depth_are_undistorted_together() -> None:
    values = np.full((480, 640), 800, np.uint16)
    color = SimpleNamespace(
        encoding="rgb8", height=480, width=640, is_bigendian=0, step=1920, data=bytes(480 * 1920)
    )
    bent = info(d=DISTORTIONS["plumb_bob"])
    bent.p = [450.0, 0.0, 322.0, 0.0, 0.0, 460.0, 241.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    frame = FrameMessages(
        0, color, depth_message(values, "16UC1"), bent, straight=Straight(False, False)
    ).decoded()
    assert (frame.camera.fx, frame.camera.cx) == (450.0, 322.0)
    assert set(np.unique(frame.depth)) <= {np.float32(0.0), np.float32(0.8)}


def test_depth_in_a_plain_png_is_read() -> None:
    png = cv2.imencode(".png", np.full((4, 4), 1234, np.uint16))[1].tobytes()
    coded = SimpleNamespace(format="16UC1; png compressed ", data=png)
    assert depth_from(coded) == pytest.approx(1.234)


def test_rvl_is_named_with_the_remedy() -> None:
    coded = SimpleNamespace(format="16UC1; compressedDepth rvl", data=bytes(100))
    with pytest.raises(ValueError, match=r"RVL cannot be read: .*format:=png"):
        depth_from(coded)
