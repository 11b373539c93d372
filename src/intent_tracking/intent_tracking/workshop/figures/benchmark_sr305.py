"""Figures on real hand frames (SR305, depth only, no pose truth): does the tracker start on them?

Each frame is shown three times, as a hand that keeps still. The fit is judged by its depth: how far
the rendered hand is from the measured surface.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.coded_images import write_picture
from intent_perception.geometry.transforms import inverse
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand
from intent_tracking.scene.raster import FAR, draw_capsule
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

CAMERA = Camera(640, 480, 476.007, 476.007, 313.683, 242.755)
UNIT = 0.000125
"""Depth of one count [m]."""
SHOWN = 3


@dataclass(frozen=True, eq=False)
class RealFit:
    """How the tracker explains one frame."""

    frame: RgbdFrame
    state: SceneState
    residual: float
    """Median distance along the ray between hand and measured surface [m], NaN without a hand."""
    explained: float
    """Share of the rendered hand that lies within 10 mm of the measured surface."""


def data_folder() -> Path:
    """Return where the frames are, see `INTENT_DATA`."""
    return Path(os.environ.get("INTENT_DATA", "../shared/data")) / "hands" / "sr305_gestures"


def sr305_figures(seed: int, picture: Path | None) -> dict[str, Any] | None:
    """Return how many frames started and how well they fit; None where the data is absent.

    Args:
        seed: of the tracker.
        picture: PNG that shows the fits over the depth.
    """
    files = sorted(data_folder().rglob("*.png"))
    if not files:
        return None
    fits = [real_fit(path, seed) for path in files]
    if picture is not None:
        write_picture(picture, sheet(fits)[..., ::-1])
    started = [fit for fit in fits if fit.state.hand_tracked]
    return {
        "frames": len(fits),
        "started": len(started) / len(fits),
        "residual_mm_median": 1e3 * float(np.median([fit.residual for fit in started])),
        "residual_mm_worst": 1e3 * float(np.max([fit.residual for fit in started])),
        "explained_mean": float(np.mean([fit.explained for fit in started])),
    }


def real_fit(path: Path, seed: int = 0) -> RealFit:
    """Return the tracker's fit to one depth image."""
    counts = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if counts is None:
        raise ValueError(f"{path}: expected a 16 bit depth image")
    depth = counts.astype(np.float32) * np.float32(UNIT)
    grey = np.full((480, 640, 3), 120, np.uint8)  # these frames carry no colour
    tracker = Tracker({}, TrackerConfig(seed=seed, table=False))
    tracker.start(RecognizedObjects(0, (), np.eye(4)))
    for number in range(SHOWN):
        frame = RgbdFrame(round(number * 1e9 / 30), grey, depth, CAMERA)
        state = tracker.step(frame)
    if not state.hand_tracked:
        return RealFit(frame, state, float("nan"), 0.0)
    rendered = rendered_hand(state)
    both = (rendered < FAR) & (depth > 0)
    apart = np.abs(rendered - depth)[both]
    share = float((apart < 0.01).sum() / max((rendered < FAR).sum(), 1))
    return RealFit(frame, state, float(np.median(apart)) if both.any() else float("nan"), share)


def rendered_hand(state: SceneState) -> NDArray[np.float32]:
    """Return the depth (480, 640) of the tracked hand alone, `FAR` where there is none [m]."""
    T_camera_hand = inverse(state.T_table_camera) @ state.T_table_hand
    values = np.concatenate([T_camera_hand[:3, 3], np.zeros(3), state.joint_angles])
    arrays, buffers = hand_arrays(state.hand), hand_buffers()
    rotation = T_camera_hand[:3, :3].astype(np.float32)
    place_hand(arrays, values.astype(np.float32), rotation, buffers)
    depth = np.full((640, 640), FAR, np.float32)
    step = np.float32(1.0 / CAMERA.fx)
    for i, radius in enumerate(arrays.radii):
        u0, v0 = np.float32(-CAMERA.cx * step), np.float32(-CAMERA.cy * step)
        draw_capsule(buffers.ends, i, radius, depth, u0, v0, step)
    return depth[:480]


def sheet(fits: list[RealFit]) -> NDArray[np.uint8]:
    """Return a sheet (H, W, 3) of depth images with the fitted hands drawn in."""
    columns = 5
    tiles = [_drawn(fit) for fit in fits]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)]
    return np.vstack(rows)


def _drawn(fit: RealFit) -> NDArray[np.uint8]:
    depth = fit.frame.depth
    shade = np.where(depth > 0, 255.0 * np.clip(1.6 - 1.5 * depth, 0.05, 1.0), 0.0)
    image = cv2.cvtColor(shade.astype(np.uint8), cv2.COLOR_GRAY2BGR)
    if fit.state.hand_tracked:
        outline = (rendered_hand(fit.state) < FAR).astype(np.uint8)
        edges, _ = cv2.findContours(outline, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, edges, -1, (60, 200, 60), 2)
        pixels: Array = CAMERA.project(fit.state.joints_camera)
        for finger in range(5):
            chain = [0, *range(1 + 4 * finger, 5 + 4 * finger)]
            line = np.rint(pixels[chain]).astype(np.int32)
            cv2.polylines(image, [line], False, (40, 60, 250), 2, cv2.LINE_AA)
        text = f"{fit.state.hand_side} {1e3 * fit.residual:.1f} mm {100 * fit.explained:.0f} %"
    else:
        text = "no hand"
    cv2.putText(image, text, (12, 34), cv2.FONT_HERSHEY_SIMPLEX, 1.0, (255, 255, 255), 2)
    small: NDArray[np.uint8] = np.asarray(cv2.resize(image, (384, 288)), dtype=np.uint8)
    return small
