"""The networks' view of the hand that is followed: when they are asked, and which hand it is."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.hands.hand_reader import HandReader, HandReaderConfig
from intent_tracking.hands.seen_hand import SeenHand

_NEAR = 0.6
"""A seen hand whose middle lies this near to the expected one is it [sides of its square]."""


class HandWatch:
    """Reads the frames for the tracker; without the networks' files it sees nothing."""

    def __init__(self, config: HandReaderConfig | None, period: int) -> None:
        self._period = period
        self.trouble = ""
        """Why no network looks, and what to do about it; empty where they do."""
        self._reader: HandReader | None = None
        try:
            self._reader = HandReader(config) if config is not None else None
        except ValueError as error:
            self.trouble = str(error)
        self.reset()

    def reset(self) -> None:
        """Forget all hands."""
        if self._reader is not None:
            self._reader.reset()
        self.hand: SeenHand | None = None
        """The hand that acts, as seen in this frame; None: none is seen, or nobody looked."""
        self.elsewhere: SeenHand | None = None
        """A hand that is seen while none is where the followed one should be."""
        self.ever = False
        """Whether they have seen the hand that is followed."""
        self.missed = 0
        """Looks in a row that did not find it."""
        self._identity = -1
        self._since = 0

    def look(self, frame: RgbdFrame, expected: Array | None, settled: bool) -> None:
        """Look for the hand in the next frame.

        Args:
            frame: its colour is read.
            expected: (2,) middle of the followed hand in the image [pixels]; None: any hand.
            settled: whether fit and networks agree, so that not every frame must be read.
        """
        self.hand = self.elsewhere = None
        if self._reader is None:
            return
        self._since += 1
        if settled and self._since < self._period:
            return
        self._since = 0
        hands = self._reader.read(frame.color)
        self.hand = self._acting(hands, expected)
        if self.hand is None:
            self.missed += 1
            self.elsewhere = next(iter(hands), None)
            return
        self.missed, self.ever, self._identity = 0, True, self.hand.identity

    def _acting(self, hands: tuple[SeenHand, ...], expected: Array | None) -> SeenHand | None:
        """Return the hand that is followed, else the one that may be."""
        if expected is None:
            same = [hand for hand in hands if hand.identity == self._identity]
            return next(iter([*same, *hands]), None)
        near = [hand for hand in hands if _apart(hand, expected) < _NEAR]
        return min(near, key=lambda hand: _apart(hand, expected), default=None)


def _apart(hand: SeenHand, pixel: Array) -> float:
    middle = hand.pixels[[0, 5, 9, 13, 17]].mean(axis=0)
    return float(np.linalg.norm(middle - pixel)) / hand.square.side
