"""The camera's pose from images of a chessboard and from the table's plane."""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame, read_camera
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import (
    inverse,
    look_at,
    make_pose,
    rotation_angle,
    rotation_from_vector,
)
from intent_perception.scene import calibrate_command as command
from intent_perception.scene.camera_calibration import Chessboard, calibrate, find_board, fit_table
from intent_perception.workshop.scenes.sensor_noise import observe

FOLDER = Path(__file__).parents[2] / "data" / "chessboard"
TRUTH = json.loads((FOLDER / "truth.json").read_text())
BOARD = Chessboard(**TRUTH["board"])
TABLE = Mesh.of(
    [[-0.6, -0.6, 0], [0.6, -0.6, 0], [0.6, 0.6, 0], [-0.6, 0.6, 0]], [[0, 1, 2], [0, 2, 3]]
)


def image(name: str) -> np.ndarray:
    return np.ascontiguousarray(cv2.imread(str(FOLDER / name))[..., ::-1])


def difference(pose: Array, truth: Array) -> tuple[float, float]:
    """Return the distance [m] and the angle [deg] between two poses."""
    apart = inverse(truth) @ pose
    return float(np.linalg.norm(apart[:3, 3])), float(np.rad2deg(rotation_angle(apart[:3, :3])))


@pytest.mark.parametrize("name", sorted(TRUTH["T_table_camera"]))
def test_chessboard_gives_the_pose_to_a_millimetre_and_a_tenth_of_a_degree(name: str) -> None:
    found = find_board(image(name), read_camera(FOLDER / "camera.json"), BOARD)
    assert found is not None
    distance, angle = difference(found.T_table_camera, np.array(TRUTH["T_table_camera"][name]))
    assert distance < 0.001
    assert angle < 0.1
    assert found.error < 0.2


def test_board_upside_down_gives_the_same_frame() -> None:
    first = find_board(image("view_0.jpg"), KINECT, BOARD)
    turned = np.ascontiguousarray(image("view_0.jpg")[::-1, ::-1])
    camera = KINECT
    second = find_board(turned, camera, BOARD)
    assert first is not None
    assert second is not None
    # The image turned by 180 degrees is that of the camera turned about its axis.
    roll = make_pose(rotation_from_vector([0, 0, np.pi]), np.zeros(3))
    half_turn = make_pose(rotation_from_vector([0, 0, np.pi]), np.zeros(3))
    distance, angle = difference(second.T_table_camera, half_turn @ first.T_table_camera @ roll)
    assert distance < 0.002
    assert angle < 0.2


def test_board_of_another_size_is_not_found() -> None:
    assert find_board(image("view_0.jpg"), KINECT, Chessboard(9, 7, 0.03)) is None


def test_wrong_boards_are_refused() -> None:
    with pytest.raises(ValueError, match=r"in 0.002..0.5 \[m\], got 25"):
        Chessboard(8, 6, 25.0)
    with pytest.raises(ValueError, match="expected columns in"):
        Chessboard(2, 6, 0.03)


def table_frame(eye: list[float], target: list[float]) -> tuple[RgbdFrame, Array]:
    T_table_camera = look_at(eye, target)
    drawn = render(KINECT, [TABLE], inverse(T_table_camera)[None], [[0.5, 0.4, 0.3]])
    assert drawn.color is not None
    depth, color = observe(drawn.depth, drawn.color, np.random.default_rng(0))
    return RgbdFrame(0, color, depth, KINECT), T_table_camera


@pytest.mark.parametrize("eye", [[0.0, -0.7, 0.5], [0.3, -0.5, 0.7], [-0.2, -0.9, 0.4]])
def test_table_plane_gives_the_documented_frame(eye: list[float]) -> None:
    frame, T_table_camera = table_frame(eye, [0.0, 0.05, 0.0])
    found = fit_table(frame.depth, frame.camera)
    assert found is not None
    # Height and tilt are those of the truth, the axis meets the origin, x is the image's right.
    assert found[2, 3] == pytest.approx(T_table_camera[2, 3], abs=0.002)
    np.testing.assert_allclose(found[2, :3], T_table_camera[2, :3], atol=0.004)
    center = found[:3, 3] - found[:3, 2] * found[2, 3] / found[2, 2]
    np.testing.assert_allclose(center, 0.0, atol=1e-9)
    assert found[0, 0] > 0.5
    assert abs(found[1, 0]) < 1e-9


def test_without_board_the_table_is_used() -> None:
    frame, _ = table_frame([0.0, -0.7, 0.5], [0.0, 0.05, 0.0])
    found = calibrate(frame, BOARD)
    assert found is not None
    assert found.source == "table"


def test_nothing_is_found_in_an_empty_frame() -> None:
    empty = RgbdFrame(
        0, np.zeros((480, 640, 3), np.uint8), np.zeros((480, 640), np.float32), KINECT
    )
    assert calibrate(empty, BOARD) is None


def run_command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["calibrate", *arguments])
    command.main()


def test_command_prints_the_pose(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run_command(
        monkeypatch, "--rgb", str(FOLDER / "view_1.jpg"), "--camera", str(FOLDER / "camera.json"),
        "--square", "0.03",
    )  # fmt: skip
    report = json.loads(capsys.readouterr().out)
    truth = np.array(TRUTH["T_table_camera"]["view_1.jpg"])
    assert difference(np.array(report["T_table_camera"]), truth)[0] < 0.001
    assert report["source"] == "chessboard"


def test_command_names_what_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    camera = str(FOLDER / "camera.json")
    with pytest.raises(SystemExit, match="cannot read"):
        run_command(monkeypatch, "--rgb", str(tmp_path / "none.png"), "--camera", camera)
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(SystemExit, match="width"):
        run_command(monkeypatch, "--rgb", camera, "--camera", str(tmp_path / "bad.json"))
