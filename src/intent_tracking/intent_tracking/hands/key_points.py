"""Key points of a seen hand as evidence for the fit."""

import numpy as np

from intent_perception.geometry.camera import Camera
from intent_tracking.hands.key_point_start import (
    KeyPointConfig,
    key_point_offsets,
    key_point_trust,
    lines_of_sight,
)
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.image.frame_evidence import KeyEvidence
from intent_tracking.scene.hand_model import Side


def key_evidence(seen: SeenHand, camera: Camera, side: Side, config: KeyPointConfig) -> KeyEvidence:
    """Return what a seen hand says about a hand of a side.

    A key point's weight is the hand's presence times its own trust.
    """
    rays = lines_of_sight(camera, seen.pixels)[:, :2]
    weights = seen.presence * key_point_trust(seen.pixels, config)
    return KeyEvidence(
        rays.astype(np.float32),
        weights.astype(np.float32),
        key_point_offsets(side).astype(np.float32),
    )
