"""Figures on recordings of real hands: rosbag2 folders with joints triangulated from all cameras.

The recordings are no part of the project; `INTENT_REAL_HANDS` names the folder that holds them.
Nothing of them may be committed, pictures of them included.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_perception.bags.bag_files import read_frames
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import ColorImage
from intent_perception.geometry.coded_images import write_picture
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.tracker.recording import Recording, track_bag
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.hand_drawing import (
    FOUND_COLOR,
    TRUE_COLOR,
    captioned,
    tiled,
    with_skeleton,
)

CAP = 0.2
"""A frame's error counts at most this, a lost one exactly this [m]."""
NEAR = 0.03
"""Error below which a frame is right [m]; the truth is good to 10 to 15 mm."""
_FIRST_JOINT = 2
"""Wrist and thumb base are left out: this truth places them elsewhere than hand models do."""
_SIDE = "right"
_MOMENTS = 6


def real_folder() -> Path:
    """Return where the recordings are, see `INTENT_REAL_HANDS`."""
    return Path(os.environ.get("INTENT_REAL_HANDS", "out/real/hands"))


def real_figures(
    folder: Path, config: TrackerConfig, picture: Path | None = None
) -> dict[str, dict[str, float]] | None:
    """Return the figures of each camera; None where there is no recording.

    Args:
        folder: with a bag and its truth.npz per camera.
        config: of the tracker.
        picture: PNG of six moments per camera; keep it under out/.
    """
    bags = sorted(path.parent for path in folder.glob("*/truth.npz"))
    if not bags:
        return None
    database, figures, rows = ObjectDatabase.load(), {}, []
    for bag in bags:
        with np.load(bag / "truth.npz") as file:
            truth = {name: file[name] for name in file.files}
        try:
            recording = track_bag(bag, database, config)
        except ValueError:  # nothing was found to start from
            recording = None
        figures[bag.name] = camera_figures(recording, truth)
        if picture is not None:
            rows.append(_pictured(bag, recording, truth))
    if picture is not None:
        write_picture(picture, tiled(rows))
    return figures


def camera_figures(recording: Recording | None, truth: dict[str, Array]) -> dict[str, Any]:
    """Return one camera's figures.

    Args:
        recording: None = the tracker refused the bag.
        truth: `joints_camera` (F, 21, 3) [m], NaN where unknown; `valid` (F,); `K` (3, 3).
    """
    if recording is None:
        nothing = {"tracked": 0.0, "under_30mm": 0.0, "mean_mm_capped_200": 1e3 * CAP}
        return {**nothing, "side_right": 0.0, "cpu_ms": None, "cpu_ms_p95": None}
    found = recording.joints_camera
    count = min(len(found), len(truth["joints_camera"]))
    found, joints = found[:count], truth["joints_camera"][:count]
    known = np.isfinite(joints[:, :, 0])
    use = frames_that_count(joints, truth["valid"][:count] > 0, truth["K"])
    tracked = np.isfinite(found[:, 0, 0])
    error = np.full(count, np.inf)
    for f in np.flatnonzero(tracked & known[:, _FIRST_JOINT:].any(axis=1)):
        offset = np.linalg.norm(found[f] - joints[f], axis=1)[_FIRST_JOINT:]
        error[f] = offset[known[f, _FIRST_JOINT:]].mean()
    sides = np.asarray(recording.arrays["hand_side"])  # as `track` writes it: one, or one per frame
    right = np.broadcast_to(sides, len(recording.joints_camera))[:count] == _SIDE
    return {
        "tracked": float(tracked[use].mean()),
        "under_30mm": float((error[use] < NEAR).mean()),
        "mean_mm_capped_200": 1e3 * float(np.minimum(error[use], CAP).mean()),
        "side_right": float(right[use & tracked].mean()) if tracked[use].any() else 0.0,
        "cpu_ms": 1e3 * float(recording.seconds.mean()),
        "cpu_ms_p95": 1e3 * float(np.percentile(recording.seconds, 95)),
        "frames": int(use.sum()),
    }


def frames_that_count(joints: Array, valid: NDArray[np.bool_], matrix: Array) -> NDArray[np.bool_]:
    """Return the frames (F,) with a valid truth of which everything known is in the image.

    Args:
        joints: (F, 21, 3) camera frame [m], NaN where unknown.
        valid: (F,) frames with a truth.
        matrix: (3, 3) intrinsic matrix K.
    """
    known = np.isfinite(joints[:, :, 0])
    focal, centre = [matrix[0, 0], matrix[1, 1]], matrix[:2, 2]
    pixels = joints[:, :, :2] / joints[:, :, 2:] * focal + centre
    inside = ((pixels > 0) & (pixels < [640, 480])).all(axis=2)
    counts: NDArray[np.bool_] = (
        valid & ((inside | ~known).mean(axis=1) > 0.99) & (known.mean(axis=1) > 0.6)
    )
    return counts


def _pictured(bag: Path, recording: Recording | None, truth: dict[str, Array]) -> list[ColorImage]:
    """Return six moments of one camera with the true and the found hand."""
    use = np.flatnonzero(frames_that_count(truth["joints_camera"], truth["valid"] > 0, truth["K"]))
    moments = {int(f) for f in use[np.linspace(0, len(use) - 1, _MOMENTS).astype(int)]}
    tiles = []
    for number, frame in enumerate(read_frames(bag)):
        if number not in moments:
            continue
        joints, text = truth["joints_camera"][number], f"{bag.name} {number}"
        image = with_skeleton(frame.color, joints, frame.camera, TRUE_COLOR)
        if recording is not None and number < len(recording.states):
            state = recording.states[number]
            image = with_skeleton(image, state.joints_camera, frame.camera, FOUND_COLOR)
            text += f" {state.hand_side}" if state.hand_tracked else " no hand"
        tiles.append(captioned(image, text))
    return tiles
