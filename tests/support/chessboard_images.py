"""Draw a chessboard on a table as a camera sees it, with the true pose of the camera.

`python -m tests.support.chessboard_images` rewrites the image set tests/data/chessboard.
"""

import json
from pathlib import Path

import cv2
import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, ColorImage, DepthImage
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at
from intent_perception.scene.camera_calibration import Chessboard

FOLDER = Path(__file__).parents[1] / "data" / "chessboard"
BOARD = Chessboard(8, 6, 0.030)
_OVERSAMPLING = 4


def square_mesh(cells: list[tuple[float, float]], size: float, z: float) -> Mesh:
    vertices, faces = [], []
    for x, y in cells:
        start = len(vertices)
        vertices += [(x, y, z), (x + size, y, z), (x + size, y + size, z), (x, y + size, z)]
        faces += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return Mesh.of(vertices, faces)


def board_scene(board: Chessboard) -> tuple[list[Mesh], Array]:
    """Return table, white paper and black squares, in the frame `table`, and their colours."""
    left = -0.5 * (board.columns + 1) * board.square
    front = -0.5 * (board.rows + 1) * board.square
    black = [
        (left + i * board.square, front + j * board.square)
        for i in range(board.columns + 1)
        for j in range(board.rows + 1)
        if (i + j) % 2 == 0
    ]
    table = square_mesh([(-0.6, -0.6)], 1.2, -0.0002)
    paper = square_mesh([(left - 0.02, left - 0.02)], -2 * left + 0.04, -0.0001)
    colors = np.array([[0.55, 0.42, 0.30], [0.95, 0.95, 0.95], [0.08, 0.08, 0.08]])
    return [table, paper, square_mesh(black, board.square, 0.0)], colors


def board_view(T_table_camera: Array, board: Chessboard) -> tuple[DepthImage, ColorImage]:
    """Return depth and anti-aliased colour of the scene."""
    meshes, colors = board_scene(board)
    poses = np.tile(inverse(T_table_camera), (3, 1, 1))
    fine = render(KINECT.scaled(_OVERSAMPLING), meshes, poses, colors).color
    assert fine is not None
    size = (KINECT.width, KINECT.height)
    return render(KINECT, meshes, poses).depth, cv2.resize(fine, size, interpolation=cv2.INTER_AREA)


def camera_poses() -> list[Array]:
    """Return T_table_camera of six views from 0.6 to 1 m away, 35 to 80 degrees down."""
    eyes = [(0.0, -0.55, 0.50), (0.30, -0.45, 0.55), (-0.35, -0.40, 0.60), (0.05, -0.25, 0.75),
            (0.10, -0.70, 0.60), (-0.20, -0.60, 0.45)]  # fmt: skip
    return [look_at(eye, (0.01 * k, -0.01 * k, 0.0)) for k, eye in enumerate(eyes)]


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    truth = {}
    for k, pose in enumerate(camera_poses()):
        color = board_view(pose, BOARD)[1].astype(np.float64) + rng.normal(0.0, 3.0, (480, 640, 3))
        image = np.clip(np.rint(color), 0, 255).astype(np.uint8)
        name = f"view_{k}.jpg"
        cv2.imwrite(str(FOLDER / name), image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 90])
        truth[name] = pose.tolist()
    board = {"columns": BOARD.columns, "rows": BOARD.rows, "square": BOARD.square}
    content = {"board": board, "T_table_camera": truth}
    (FOLDER / "truth.json").write_text(json.dumps(content, indent=1) + "\n")
    (FOLDER / "camera.json").write_text(json.dumps(vars(KINECT)) + "\n")


if __name__ == "__main__":
    main()
