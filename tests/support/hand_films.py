"""Films with hands in them, frame by frame, and whether the networks that read them are here."""

import os
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from intent_perception.bags.bag_files import read_frames
from intent_tracking.hands.networks.network_files import missing_networks
from intent_tracking.scene.hand_kernel import hand_arrays
from intent_tracking.scene.hand_model import HandModel

ROOT = Path(__file__).resolve().parents[2]
REAL = Path(os.environ.get("INTENT_REAL_HANDS", ROOT / "out" / "real" / "hands"))
HANDS = {side: (HandModel(side), hand_arrays(HandModel(side))) for side in ("right", "left")}

needs_networks = pytest.mark.skipif(
    bool(missing_networks()),
    reason="no hand networks: python -m intent_tracking.fetch_hand_networks",
)


@cache
def frames_of(name, count):
    """Return the first frames of a shipped bag."""
    return tuple(islice(read_frames(ROOT / "bags" / name), count))


def truth_of(folder):
    with np.load(folder / "truth.npz", allow_pickle=False) as data:
        return dict(data)


def turned_image(image, quarters):
    """Return an image turned clockwise by quarters of a turn."""
    return np.ascontiguousarray(np.rot90(image, -quarters))


def turned_pixels(pixels, shape, quarters):
    """Return where pixels (..., 2) of an image of a shape (H, W, ...) lie once it is turned."""
    height, width = shape[:2]
    for _ in range(quarters):
        pixels = np.stack([height - 1 - pixels[..., 1], pixels[..., 0]], axis=-1)
        height, width = width, height
    return pixels
