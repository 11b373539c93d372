"""The hands of the person who is followed: their shape, and poses of them from key points."""

import math
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.fit.hand_shape import AVERAGE, HandShapeConfig, HandShapeEstimate, shaped_hand
from intent_tracking.hands.key_point_start import (
    KeyPointConfig,
    KeyPointStart,
    starts_from_key_points,
)
from intent_tracking.hands.seen_hand import SeenHand, certainty
from intent_tracking.scene.hand_model import SIDES, HandModel, Side
from intent_tracking.tracker.hypotheses.hypothesis import unusual_roll
from intent_tracking.tracker.problem import Problem
from intent_tracking.tracker.scene_track import SceneTrack

_KNOWN_SIZE = 0.01
"""Spread of the log of a calibrated hand's size."""
_COST_ODDS, _COST_SCALE = 8.0, 300.0
"""Log-odds of the side that explains key points better, and the difference of costs it takes."""
_ROLL_ODDS = 2.0
"""Log-odds of a hand turned as people turn it against one turned over."""
_READ_WELL, _READ_SPREAD = 120.0, 40.0
"""Cost up to which key points are read well, and by how much more they count a third.

On 60 films their mean error is .034 sides of the square below a cost of 80, .068 around 110, .10
around 140, .12 around 175 and .16 beyond 200: it tells more than the network's own presence."""
_DOUBT, _MOST_ODDS = 0.02, 2.0
"""A network is never surer of a side than this, and no look that counts once is worth more."""
_WELL_EXPLAINED, _EXPLAINED_SPREAD, _MOST_EXPLAINED = 100.0, 25.0, 6.0
"""Cost of a look that counts once, by how much more one counts a third, and the most it counts."""
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
        starts = self._starts(seen, frame, sides)
        if starts and _whole(seen, frame) and self.shape.note_size(starts[0].size):
            self._reshape()
        return starts

    def told(
        self,
        frame: RgbdFrame,
        R_table_camera: Array | None,
        seen: SeenHand,
        sides: tuple[Side, ...] = SIDES,
    ) -> tuple[float, float]:
        """Return the log-odds of a right hand that a look is worth, and how well it is explained.

        Three things speak: which hand explains key points, depth and usual posture better, which
        one the network reads, and on which one the palm is turned as people turn it. Networks read
        some hands as mirrored ones, for many frames and without doubt; but then neither hand
        explains the key points well, and such looks say little. Learned on 60 films of seeds 5, 8,
        11, 12 and 77 and on the bags: summed over the looks so far .93 of the frames name the right
        side, by the network alone .83.

        Args:
            frame: that it is seen in.
            R_table_camera: (3, 3) the camera's axes in the table's, z up; None: no table is known.
            seen: the hand.
            sides: that may explain it; of one alone the log-odds are 0.
        """
        starts = self._starts(replace(seen, right=0.5), frame, sides)
        cost = {start.side: start.cost for start in starts}
        left = min(cost.values())
        explained = min(math.exp((_READ_WELL - left) / _READ_SPREAD), 1.0)
        if len(cost) < len(SIDES):
            return 0.0, explained
        odds = _COST_ODDS * math.tanh((cost["left"] - cost["right"]) / _COST_SCALE)
        if R_table_camera is not None:
            roll = {
                s.side: unusual_roll(s.side, R_table_camera @ s.state.rotations[0]) for s in starts
            }
            odds += _ROLL_ODDS * (roll["left"] - roll["right"])
        looked = seen.right if seen.looked is None else seen.looked
        looked = min(max(looked, _DOUBT), 1.0 - _DOUBT)
        odds += math.log(looked / (1.0 - looked))
        telling = min(math.exp((_WELL_EXPLAINED - left) / _EXPLAINED_SPREAD), _MOST_EXPLAINED)
        bounded = _MOST_ODDS * math.tanh(odds / _MOST_ODDS)
        return bounded * telling * certainty(seen.presence), explained

    def _starts(
        self, seen: SeenHand, frame: RgbdFrame, sides: tuple[Side, ...]
    ) -> list[KeyPointStart]:
        known = self.shape.known
        shape = self.shape.shape if known else AVERAGE
        hands = {
            side: (HandModel.from_shape(side, shape), shaped_hand(side, shape)) for side in sides
        }
        config = self._key_points
        if known:
            config = replace(config, usual_size=1.0, size=_KNOWN_SIZE)
        return starts_from_key_points(seen, frame, hands, config)

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
