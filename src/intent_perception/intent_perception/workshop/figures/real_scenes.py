"""Real data of the benchmark: YCB objects in Kinect frames, a laser scan with a toy dinosaur.

The frames come without true poses. What stands in them, and in which image box, was read off the
pictures by eye, once.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.rendering import render
from intent_perception.objects.model import ObjectModel

YCB_CAMERA = Camera(640, 480, 1066.778, 1067.487, 312.9869, 241.3109)
"""Of the five frames."""
_DEPTH_UNIT = 1e-4

Box = tuple[int, int, int, int]
"""Left, top, right, bottom [pixel]."""

COUNTED: dict[int, dict[str, Box]] = {
    1: {
        "003_cracker_box": (297, 122, 482, 345),
        "006_mustard_bottle": (322, 200, 407, 450),
        "005_tomato_soup_can": (392, 245, 466, 382),
        "035_power_drill": (47, 250, 278, 365),
    },
    2: {
        "021_bleach_cleanser": (212, 30, 308, 295),
        "002_master_chef_can": (302, 150, 412, 330),
        "004_sugar_box": (195, 288, 335, 450),
        "005_tomato_soup_can": (370, 255, 502, 360),
    },
    3: {
        "005_tomato_soup_can": (180, 298, 280, 455),
        "010_potted_meat_can": (155, 217, 287, 370),
    },
    4: {
        "019_pitcher_base": (242, 73, 452, 348),
        "006_mustard_bottle": (336, 242, 437, 447),
    },
    5: {
        "003_cracker_box": (97, 25, 280, 270),
        "021_bleach_cleanser": (118, 50, 238, 325),
        "035_power_drill": (257, 120, 435, 345),
        "004_sugar_box": (160, 312, 388, 445),
    },
}
"""Objects of each frame that count for recall."""
OTHERS: dict[int, dict[str, Box]] = {
    1: {"011_banana": (135, 345, 270, 472)},
    2: {"037_scissors": (63, 322, 210, 385), "025_mug": (498, 18, 588, 128)},
    3: {"024_bowl": (333, 258, 536, 410)},
    4: {"007_tuna_fish_can": (225, 328, 322, 425)},
    5: {"052_extra_large_clamp": (345, 262, 483, 400)},
}
"""Objects that are there but do not count: finding them is no mistake."""
_LEAST_OVERLAP = 0.5
_LARGEST_RESIDUAL = 0.005
_SAME_SURFACE = 0.03


@dataclass(frozen=True)
class BoxMatch:
    """How a placed model lies on an object of which only the image box is known."""

    overlap: float
    """Intersection over union of the box and the model's bounding box in the image."""
    residual: float
    """Median |difference| of depth where both are on one surface [m]."""

    @property
    def right(self) -> bool:
        """Whether it counts as found."""
        return self.overlap >= _LEAST_OVERLAP and self.residual <= _LARGEST_RESIDUAL


def ycb_frame(folder: Path, number: int) -> RgbdFrame:
    """Return one of the five real frames of the folder `recognizer/ycbv_posecnn_demo`."""
    color = cv2.imread(str(folder / f"{number:06d}-color.png"), cv2.IMREAD_COLOR)
    depth = cv2.imread(str(folder / f"{number:06d}-depth.png"), cv2.IMREAD_UNCHANGED)
    if color is None or depth is None:
        raise ValueError(f"expected frame {number} in {folder}")
    metres = (depth.astype(np.float64) * _DEPTH_UNIT).astype(np.float32)
    return RgbdFrame(0, np.ascontiguousarray(color[..., ::-1]), metres, YCB_CAMERA)


def match_box(frame: RgbdFrame, model: ObjectModel, T_camera_object: Array, box: Box) -> BoxMatch:
    """Return how a model placed in a frame lies on the object in a box."""
    drawn = render(frame.camera, [model.mesh], T_camera_object[None]).depth
    rows, columns = np.nonzero(drawn > 0.0)
    if len(rows) == 0:
        return BoxMatch(0.0, np.inf)
    corners = (columns.min(), rows.min(), columns.max(), rows.max())
    mine = tuple(int(value) for value in corners)
    width = min(mine[2], box[2]) - max(mine[0], box[0])
    height = min(mine[3], box[3]) - max(mine[1], box[1])
    shared = max(0, width) * max(0, height)
    areas = [(b[2] - b[0]) * (b[3] - b[1]) for b in (mine, box)]
    gap = np.abs(frame.depth - drawn)[(drawn > 0.0) & (frame.depth > 0.0)]
    gap = gap[gap < _SAME_SURFACE]
    residual = float(np.median(gap)) if len(gap) > 50 else np.inf
    return BoxMatch(float(shared / (sum(areas) - shared)), residual)


def uwa_reference(folder: Path) -> Array:
    """Return T_scene_model (4, 4) [m] of the parasaurolophus in the scan rs1."""
    entries: list[dict[str, Any]] = json.loads((folder / "uwa_reference_poses.json").read_text())
    entry = next(e for e in entries if str(e["scene"]).startswith("rs1"))
    T_scene_model = np.array(entry["T_scene_from_model_mm"], dtype=np.float64)
    T_scene_model[:3, 3] /= 1000.0
    return T_scene_model
