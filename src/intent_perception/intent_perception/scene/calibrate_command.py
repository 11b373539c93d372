"""Command: where the camera is, from an image of a chessboard or from a depth image of the table.

    python -m intent_perception.calibrate --rgb P --camera K.json --columns 8 --rows 6 --square .025
    python -m intent_perception.calibrate --depth P --depth-scale 0.001 --camera K.json

Prints JSON: T_table_camera (4x4, row-major, m), source, error_pixel, and the command that publishes
the table in the tree of the camera's driver, or (--base) of a robot whose camera is calibrated.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.geometry.camera import RgbdFrame, clean_depth, require_metres
from intent_perception.geometry.coded_images import read_picture
from intent_perception.geometry.lens import read_lens, write_camera_yaml
from intent_perception.geometry.transforms import inverse, quaternion_from_rotation
from intent_perception.scene.camera_calibration import (
    CameraCalibration,
    Chessboard,
    calibrate,
    read_calibration,
)


def main() -> None:
    """Read the images, calibrate, print or write JSON; exit 1 where nothing is found."""
    arguments = _arguments()
    try:
        found = _calibrated(arguments)
    except ValueError as error:
        raise SystemExit(f"calibrate: {error}") from error
    if found is None:
        wanted = "a chessboard" if arguments.rgb is not None else "a table"
        raise SystemExit(f"calibrate: {wanted} is not seen; check the board's size and the light")
    report = {
        "T_table_camera": np.round(found.T_table_camera, 9).tolist(),
        "static_transform": _transform(arguments, found.T_table_camera),
        "source": found.source,
        "error_pixel": found.error if found.source == "chessboard" else None,
    }
    write_json(arguments.json, report, indent=2)


def _transform(arguments: argparse.Namespace, T_table_camera: Array) -> str:
    """Return the command that ties the table to the camera's tree, or to the robot's.

    Raises:
        ValueError: if the file of the robot's calibration holds no pose.
    """
    parent, T_parent_camera = arguments.camera_frame, np.eye(4)
    if arguments.base is not None:
        parent = arguments.base_frame
        T_parent_camera = read_calibration(arguments.base, "T_base_camera")
    pose = T_parent_camera @ inverse(T_table_camera)
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    values = [*pose[:3, 3], *quaternion_from_rotation(pose[:3, :3])]
    words = " ".join(f"--{name} {value:.6f}" for name, value in zip(names, values, strict=True))
    frames = f"--frame-id {parent} --child-frame-id table"
    return f"ros2 run tf2_ros static_transform_publisher {words} {frames}"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rgb", type=Path, help="colour image with the board")
    parser.add_argument("--depth", type=Path, help="16-bit depth image")
    parser.add_argument("--depth-scale", type=float, default=0.001, help="metres per step")
    parser.add_argument(
        "--camera", type=Path, required=True, help="intrinsics: ROS's camera yaml or JSON"
    )
    parser.add_argument("--camera-yaml", type=output_file, help="write them as ROS's camera yaml")
    parser.add_argument("--camera-frame", default="camera_color_optical_frame")
    parser.add_argument("--base", type=Path, help="JSON with T_base_camera of a robot (4x4, m)")
    parser.add_argument("--base-frame", default="base_link")
    parser.add_argument("--columns", type=int, default=8, help="inner corners along one side")
    parser.add_argument("--rows", type=int, default=6, help="inner corners along the other")
    parser.add_argument("--square", type=float, default=0.025, help="edge of a square [m]")
    parser.add_argument("--json", type=output_file, default="-", help="file to write, - = print")
    arguments = parser.parse_args()
    if arguments.rgb is None and arguments.depth is None:
        parser.error("expected --rgb, --depth or both")
    return arguments


def _calibrated(arguments: argparse.Namespace) -> CameraCalibration | None:
    lens = read_lens(arguments.camera)
    camera = lens.camera
    size = (camera.height, camera.width)
    if arguments.camera_yaml is not None:
        write_camera_yaml(arguments.camera_yaml, camera)
    color = np.zeros((*size, 3), np.uint8)
    depth = np.zeros(size, np.float32)
    board = None
    if arguments.rgb is not None:
        board = Chessboard(arguments.columns, arguments.rows, arguments.square)
        seen = read_picture(arguments.rgb, cv2.IMREAD_COLOR)[..., ::-1]
        color = lens.rectified(np.ascontiguousarray(seen, dtype=np.uint8), nearest=False)
    if arguments.depth is not None:
        raw = read_picture(arguments.depth, cv2.IMREAD_UNCHANGED)
        if raw.shape != size:
            raise ValueError(f"expected depth {size} as in {arguments.camera}, got {raw.shape}")
        scaled = clean_depth(raw.astype(np.float32) * np.float32(arguments.depth_scale))
        depth = lens.rectified(require_metres(scaled), nearest=True)
    return calibrate(RgbdFrame(0, color, depth, camera), board)
