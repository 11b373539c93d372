"""Command: where the camera is, from an image of a chessboard or from a depth image of the table.

    python -m intent_perception.calibrate --rgb P --camera K.json --columns 8 --rows 6 --square .025
    python -m intent_perception.calibrate --depth P --depth-scale 0.001 --camera K.json

Prints JSON: T_table_camera (4x4, row-major, m), source, error_pixel.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.geometry.camera import RgbdFrame, clean_depth, read_camera
from intent_perception.geometry.coded_images import read_picture
from intent_perception.scene.camera_calibration import CameraCalibration, Chessboard, calibrate


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
        "source": found.source,
        "error_pixel": found.error if found.source == "chessboard" else None,
    }
    write_json(arguments.json, report, indent=2)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rgb", type=Path, help="colour image with the board")
    parser.add_argument("--depth", type=Path, help="16-bit depth image")
    parser.add_argument("--depth-scale", type=float, default=0.001, help="metres per step")
    parser.add_argument("--camera", type=Path, required=True, help="intrinsics, JSON")
    parser.add_argument("--columns", type=int, default=8, help="inner corners along one side")
    parser.add_argument("--rows", type=int, default=6, help="inner corners along the other")
    parser.add_argument("--square", type=float, default=0.025, help="edge of a square [m]")
    parser.add_argument("--json", type=output_file, default="-", help="file to write, - = print")
    arguments = parser.parse_args()
    if arguments.rgb is None and arguments.depth is None:
        parser.error("expected --rgb, --depth or both")
    return arguments


def _calibrated(arguments: argparse.Namespace) -> CameraCalibration | None:
    camera = read_camera(arguments.camera)
    size = (camera.height, camera.width)
    color = np.zeros((*size, 3), np.uint8)
    depth = np.zeros(size, np.float32)
    board = None
    if arguments.rgb is not None:
        board = Chessboard(arguments.columns, arguments.rows, arguments.square)
        color = np.ascontiguousarray(read_picture(arguments.rgb, cv2.IMREAD_COLOR)[..., ::-1])
    if arguments.depth is not None:
        raw = read_picture(arguments.depth, cv2.IMREAD_UNCHANGED)
        if raw.shape != size:
            raise ValueError(f"expected depth {size} as in {arguments.camera}, got {raw.shape}")
        depth = clean_depth(raw.astype(np.float32) * np.float32(arguments.depth_scale))
    return calibrate(RgbdFrame(0, color, depth, camera), board)
