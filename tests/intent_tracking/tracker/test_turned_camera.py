"""A camera that hangs on its side or upside down sees the same demonstration."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from intent_perception.bags.bag_files import BagWriter, read_frames
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.tracker.recording import track_bag
from intent_tracking.tracker.tracker_config import TrackerConfig

BAG = Path(__file__).resolve().parents[3] / "bags" / "pour_bottle"
FRAMES = 40
pytestmark = pytest.mark.slow


def turned(frame: RgbdFrame, quarters: int) -> RgbdFrame:
    """Return the frame of a camera turned by quarters about its axis: the image turns left."""
    camera = frame.camera
    for _ in range(quarters):
        camera = Camera(
            camera.height, camera.width, camera.fy, camera.fx, camera.cy,
            camera.width - 1 - camera.cx,
        )  # fmt: skip
    color, depth = np.rot90(frame.color, quarters), np.rot90(frame.depth, quarters)
    return RgbdFrame(frame.stamp, np.ascontiguousarray(color), np.ascontiguousarray(depth), camera)


@pytest.mark.parametrize("quarters", [1, 2])
def test_the_hand_is_followed_by_a_turned_camera(tmp_path: Path, quarters: int) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for frame in islice(read_frames(BAG), FRAMES):
            writer.write(turned(frame, quarters))
    database = ObjectDatabase.load().select(("bottle_0", "glass_0"))
    recording = track_bag(tmp_path / "bag", database, TrackerConfig())
    truth = np.load(BAG / "truth.npz")
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    R_turned_camera = np.linalg.matrix_power(quarter, quarters)
    expected = truth["joints_camera"][:FRAMES] @ R_turned_camera.T
    seen = truth["hand_in_view"][:FRAMES].astype(bool)
    error = np.linalg.norm(recording.joints_camera - expected, axis=2).mean(axis=1)
    assert np.mean(np.isfinite(error[seen])) > 0.8
    assert np.nanmedian(error[seen]) < 0.015
