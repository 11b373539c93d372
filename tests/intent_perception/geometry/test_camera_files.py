"""ROS's camera yaml is read with its lens, and written."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from intent_perception.geometry.camera import Camera
from intent_perception.geometry.lens import read_lens, write_camera_yaml

P = [460.0, 0.0, 321.0, 0.0, 0.0, 470.0, 242.0, 0.0, 0.0, 0.0, 1.0, 0.0]
K = [500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0]


def camera_yaml(folder: Path, **changes: object) -> Path:
    content: dict[str, object] = {
        "image_width": 640,
        "image_height": 480,
        "camera_name": "rgb",
        "camera_matrix": {"rows": 3, "cols": 3, "data": K},
        "distortion_model": "plumb_bob",
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": [-0.2, 0.05, 0.0, 0.0, 0.0]},
        "rectification_matrix": {"rows": 3, "cols": 3, "data": np.eye(3).ravel().tolist()},
        "projection_matrix": {"rows": 3, "cols": 4, "data": P},
    }
    path = folder / "camera.yaml"
    path.write_text(yaml.safe_dump(content | changes))
    return path


def test_a_camera_yaml_gives_the_rectified_camera_and_its_lens(tmp_path: Path) -> None:
    lens = read_lens(camera_yaml(tmp_path), (640, 480))
    assert lens.camera == Camera(640, 480, 460.0, 470.0, 321.0, 242.0)
    assert lens.maps is not None


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    camera = Camera(640, 480, 525.5, 526.0, 319.25, 238.0)
    write_camera_yaml(tmp_path / "out.yaml", camera)
    lens = read_lens(tmp_path / "out.yaml")
    assert lens.camera == camera
    assert lens.maps is None


def test_a_camera_yaml_of_another_image_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"of images 640 x 480, these are \(1280, 720\)"):
        read_lens(camera_yaml(tmp_path), (1280, 720))


def test_a_camera_yaml_without_a_matrix_is_refused_with_what_is_missing(tmp_path: Path) -> None:
    path = camera_yaml(tmp_path)
    path.write_text("image_width: 640\nimage_height: 480\n")
    with pytest.raises(ValueError, match=r"camera\.yaml: expected image_width.*camera_matrix"):
        read_lens(path)
