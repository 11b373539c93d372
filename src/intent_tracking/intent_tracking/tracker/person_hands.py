"""The hands of the person who is followed: their shape, and poses of them from key points."""

from dataclasses import replace

import numpy as np

from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.fit.hand_shape import AVERAGE, HandShapeConfig, HandShapeEstimate, shaped_hand
from intent_tracking.hands.key_point_start import (
    KeyPointConfig,
    KeyPointStart,
    starts_from_key_points,
)
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.scene.hand_model import SIDES, HandModel, Side
from intent_tracking.tracker.problem import Problem
from intent_tracking.tracker.scene_track import SceneTrack

_KNOWN_SIZE = 0.01
"""Spread of the log of a calibrated hand's size."""
_SURE = 0.9
"""Presence from which a hand tells its size."""


class PersonHands:
    """A right and a left hand of one shape, which is learned from what is seen of either."""

    def __init__(self, shape: HandShapeConfig, key_points: KeyPointConfig) -> None:
        self._key_points = key_points
        self.shape = HandShapeEstimate(shape)
        self._reshape()
        for side in SIDES:  # the first one of a side is slow; that must not fall into a frame
            shaped_hand(side, self.shape.shape)

    def _reshape(self) -> None:
        shape = self.shape.shape
        self.models: dict[Side, HandModel] = {
            side: HandModel.from_shape(side, shape) for side in SIDES
        }

    def starts(
        self, seen: SeenHand, frame: RgbdFrame, sides: tuple[Side, ...] = SIDES
    ) -> list[KeyPointStart]:
        """Return poses of a seen hand, best first, and take note of its size.

        Hands of average size are fitted until more is known of it.
        """
        known = self.shape.known
        shape = self.shape.shape if known else AVERAGE
        hands = {
            side: (HandModel.from_shape(side, shape), shaped_hand(side, shape)) for side in sides
        }
        config = self._key_points
        if known:
            config = replace(config, usual_size=1.0, size=_KNOWN_SIZE)
        starts = starts_from_key_points(seen, frame, hands, config)
        if starts and _whole(seen, frame) and self.shape.note_size(starts[0].size):
            self._reshape()
        return starts

    def size(self, track: SceneTrack, seen: SeenHand, frame: RgbdFrame) -> None:
        """Let the key points of a young track's hand speak for its size."""
        if not self.shape.known and self.starts(seen, frame, (track.hand.side,)):
            track.set_hand(self.models[track.hand.side])

    def calibrate(self, track: SceneTrack, problem: Problem) -> None:
        """Let a well-fitted frame speak for the shape."""
        weights, evidence = track.config.weights, problem.view.evidence
        if self.shape.learn(track.hand, track.arrays, evidence, weights, track.state):
            self._reshape()
            track.set_hand(self.models[track.hand.side])


def _whole(seen: SeenHand, frame: RgbdFrame) -> bool:
    """Return whether a hand is surely seen with all key points: one cut off tells no size."""
    height, width = frame.depth.shape
    return seen.presence > _SURE and bool(
        np.all((seen.pixels > 0.0) & (seen.pixels < [width, height]))
    )
