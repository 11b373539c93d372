"""The hands of every frame: searched with one network, followed with the other.

Palms are searched only while a hand is missing; afterwards the key points of one frame tell where
those of the next are read. Nothing here knows time or chance: the same images give the same hands.

Measured on one core (nine rendered films, three real recordings): a look at the palms takes 11 ms
(lite) or 13 ms (full), a reading of key points 6 or 11 ms; a frame 7 ms in the mean, 15-20 in the
one of twenty that searches. Both palm networks find what there is, however the camera is rolled:
in .96-1 of the frames with a whole hand, so lite it is. Starts from the key points of `full` are no
better on the real recordings (21, 12, 13 mm against 19, 11, 14 of lite, with the same weights) and
2 mm better in the mean of the films: not worth twice the time, but where lite errs. While a hand
comes into view lite puts it more than 20 mm off in .36 of its readings and full in .27, and what
starts wrongly stays so for long: full reads the start, and hands in doubt. A hand is found in 1-5
frames after it is wholly in view, those that reach fast and blurred being the latest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import ColorImage
from intent_tracking.hands.hand_square import (
    END_MARGIN,
    HandSquare,
    search_views,
    square_of_key_points,
)
from intent_tracking.hands.networks.landmark_network import KeyPoints, LandmarkNetwork
from intent_tracking.hands.networks.palm_network import PalmNetwork
from intent_tracking.hands.seen_hand import SeenHand

_SETTLED = 2
"""Age from which the loss of a hand calls for a search: what is gone at once was none."""
_CHALLENGED = 0.4
"""A square this near to a hand may be read for it [sides of the square]."""
_PLAIN = 0.9
"""Presence of a hand from which no more squares are looked at for a better view of it."""
_CLEARLY = 0.02
"""Merit by which another reading of a hand must be better."""
_REACH_WORTH = 0.5
"""Presence that one side of the square between an arm's end and the nearest key point is worth."""


@dataclass(frozen=True, eq=False)
class HandReaderConfig(Checked):
    """When is searched, and what counts as a hand."""

    palm_network: Literal["lite", "full"] = "lite"
    """Which network finds palms; full takes a fifth longer and finds no more."""
    landmark_network: Literal["lite", "full"] = "lite"
    """Which network reads key points; full takes twice as long."""
    careful_looks: int = 1
    """First looks at a hand after the one that found it for which full reads all the same; the
    better the start, the less there is to mend; 0..1000."""
    hands: int = 3
    """Most hands that are followed, 1..4."""
    least_palm: float = 0.5
    """Score from which a palm is looked at, 0.05..0.99."""
    least_presence: float = 0.5
    """Presence below which there is no hand, 0.05..0.99."""
    search_period: int = 4
    """Frames between searches while no hand is seen, 1..100; where something moves, is looked at
    once."""
    second_period: int = 15
    """Frames between searches while one is, 1..1000."""
    same_palm: float = 0.25
    """A palm this near to a known hand is its [sides of the square], 0.01..1."""
    same_hand: float = 0.12
    """Hands whose key points lie nearer in the mean are one [sides of the square], 0.01..1."""
    again: float = 0.75
    """A hand found within this share of its side of where one was lost is that one, 0.01..5."""
    memory: int = 30
    """Frames for which a lost hand keeps its number, 0..1000."""
    least_side: float = 16.0
    """Smallest square that is read [pixels], 4..500."""


@dataclass(frozen=True, eq=False)
class Hints:
    """Where hands may be, from other sources."""

    regions: tuple[HandSquare, ...] = ()
    """Squares in which key points are read at once."""
    view: HandSquare | None = None
    """Square in which palms are searched every other time."""
    squares: dict[int, HandSquare] = field(default_factory=dict)
    """By a hand's number where to read it, instead of where its last key points were."""
    careful: frozenset[int] = frozenset()
    """Numbers of hands that are in doubt: full reads them."""
    lost: bool = False
    """Whether hands are looked for where they were seen last, too: what hid them goes away."""


NO_HINTS = Hints()


class HandReader:
    """Follows up to a few hands through a film."""

    def __init__(self, config: HandReaderConfig | None = None) -> None:
        """Load both networks.

        Raises:
            ValueError: if their files or LiteRT are absent; it says what to run.
        """
        self._config = config or HandReaderConfig()
        self._palms = PalmNetwork(f"palm_detection_{self._config.palm_network}")
        self._landmarks = LandmarkNetwork(f"hand_landmark_{self._config.landmark_network}")
        both = self._config.landmark_network == "full"
        self._careful = self._landmarks if both else LandmarkNetwork("hand_landmark_full")
        self.reset()

    def reset(self) -> None:
        """Forget all hands: another film begins."""
        self._hands: tuple[SeenHand, ...] = ()
        self._lost: list[tuple[SeenHand, int]] = []
        self._frame = 0
        self._searched = -self._config.second_period
        self._searches = 0
        self._next = 0

    def forget(self, identity: int) -> None:
        """Take a hand for none from now on."""
        self._hands = tuple(hand for hand in self._hands if hand.identity != identity)

    def read(
        self,
        color: ColorImage,
        search: bool = False,
        only: int | None = None,
        hints: Hints = NO_HINTS,
    ) -> tuple[SeenHand, ...]:
        """Return the hands of the next frame, those known longest first.

        Args:
            color: (H, W, 3) RGB of any size.
            search: whether to search palms now, whatever is due.
            only: number of the only hand to read; the others wait where they were seen last.
            hints: where else to look.

        Raises:
            ValueError: if the image is no RGB image.
        """
        if color.ndim != 3 or color.shape[2] != 3 or color.dtype != np.uint8 or not color.size:
            raise ValueError(f"expected colour (H, W, 3) uint8, got {color.shape} {color.dtype}")
        self._frame += 1
        settled = {hand.identity for hand in self._hands if hand.age >= _SETTLED}
        self._follow(color, only, hints)
        unknown = [region for region in hints.regions if not self._challenge(color, region)]
        if hints.lost:
            unknown += [hand.square for hand, _ in self._recent() if hand.age >= _SETTLED]
        search = not self._take(color, unknown) and search
        period = self._config.second_period if self._hands else self._config.search_period
        lost = not settled <= {hand.identity for hand in self._hands}
        due = self._frame - self._searched >= period or lost
        if search or (due and len(self._hands) < self._config.hands):
            if lost:
                self._searches = 0  # what was just lost is looked for in the whole image
            self._searched = self._frame
            self._search(color, hints.view)
        return tuple(hand for hand in self._hands if only in (None, hand.identity))

    def _follow(self, color: ColorImage, only: int | None, hints: Hints) -> None:
        """Read the known hands again; forget what is no hand or another one's."""
        kept: list[SeenHand] = []
        for hand in self._hands:
            if only not in (None, hand.identity):
                kept.append(hand)
                continue
            careful = hand.age < self._config.careful_looks or hand.identity in hints.careful
            square = hints.squares.get(hand.identity, hand.square)
            seen = self._read(color, square, careful)
            if seen is None and square is not hand.square:
                seen = self._read(color, hand.square, careful)
            if seen is None or any(self._same(seen[1], other) for other in kept):
                self._lost.append((hand, self._frame))
                continue
            kept.append(_seen(hand.identity, *seen, hand.age + 1))
        self._hands = tuple(kept)

    def _search(self, color: ColorImage, part: HandSquare | None) -> None:
        """Look for palms in the whole image or a part of it, and at the hands around them."""
        whole, *parts = search_views(color.shape[1], color.shape[0])
        views = [whole, *parts] if part is None else [whole, part]
        view = views[self._searches % len(views)]
        self._searches += 1
        for palm in self._palms.find(color, view, self._config.least_palm):
            self._take(color, [palm.square])

    def _take(self, color: ColorImage, squares: Sequence[HandSquare]) -> bool:
        """Add the hand that one of some squares shows best unless it is known; say whether."""
        if len(self._hands) >= self._config.hands:
            return False
        seen = []
        for square in squares:
            if any(_distance(square, hand.square) < self._config.same_palm for hand in self._hands):
                continue
            glimpse = self._read(color, square)
            if glimpse is not None:
                seen.append(glimpse)
                if glimpse[1].presence > _PLAIN:
                    break
        for square, _ in sorted(seen, key=lambda glimpse: -glimpse[1].presence):
            found = self._read(color, square, self._config.careful_looks > 0)
            if found is not None and not any(self._same(found[1], hand) for hand in self._hands):
                self._hands = (*self._hands, self._named(*found))
                return True
        return False

    def _read_twice(
        self, color: ColorImage, square: HandSquare
    ) -> tuple[HandSquare, KeyPoints] | None:
        """Return what is read in a square, once more from where the key points themselves are."""
        seen = self._read(color, square)
        careful = self._config.careful_looks > 0
        return None if seen is None else self._read(color, seen[0], careful)

    def _challenge(self, color: ColorImage, square: HandSquare) -> bool:
        """Read a hand anew in another square near it; return whether there is one.

        Key points that once slipped to the wrist, or shrank where the image cut the hand off, stay
        so; of two readings the one with more presence that reaches farther is the better one.
        """
        for row, hand in enumerate(self._hands):
            if _distance(square, hand.square) > _CHALLENGED:
                continue
            seen = None if _alike(square, hand.square) else self._read_twice(color, square)
            if seen is None or self._same(seen[1], hand):
                return True
            if _merit(seen[1], square) > _merit(hand, square) + _CLEARLY:
                hands = list(self._hands)
                hands[row] = _seen(hand.identity, *seen, hand.age)
                self._hands = tuple(hands)
            return True
        return False

    def _recent(self) -> list[tuple[SeenHand, int]]:
        """Return the hands that keep their numbers although they are lost, and since when."""
        return [one for one in self._lost if self._frame - one[1] <= self._config.memory]

    def _named(self, square: HandSquare, points: KeyPoints) -> SeenHand:
        """Return a found hand with the number of the one lost there, else with a new one."""
        recent = self._recent()
        for one in sorted(recent, key=lambda one: _distance(one[0].square, square)):
            if _distance(one[0].square, square) < self._config.again:
                self._lost = [other for other in recent if other is not one]
                return _seen(one[0].identity, square, points, 0)
        self._lost = recent
        self._next += 1
        return _seen(self._next - 1, square, points, 0)

    def presence(self, color: ColorImage, square: HandSquare) -> float:
        """Return the probability that there is a hand in a square."""
        return self._landmarks.read(color, square).presence

    def _read(
        self, color: ColorImage, square: HandSquare, careful: bool = False
    ) -> tuple[HandSquare, KeyPoints] | None:
        """Return the square of the key points read in a square, and them; None without a hand.

        Gloves and the dark hide a hand from full rather than from lite: what full does not see
        lite is asked for.
        """
        height, width = color.shape[:2]
        inside = np.all((square.center > 0.0) & (square.center < [width, height]))
        largest = 2.0 * max(width, height)
        if not inside or not self._config.least_side <= square.side <= largest:
            return None
        for network in [self._careful, self._landmarks] if careful else [self._landmarks]:
            points = network.read(color, square)
            if points.presence >= self._config.least_presence:
                return square_of_key_points(points.pixels), points
        return None

    def _same(self, points: KeyPoints, hand: SeenHand) -> bool:
        """Return whether key points are those of a known hand."""
        apart = np.linalg.norm(points.pixels - hand.pixels, axis=1).mean()
        return bool(apart < self._config.same_hand * hand.square.side)


def _distance(one: HandSquare, other: HandSquare) -> float:
    """Return how far two squares' middles lie apart, in units of the larger side."""
    return float(np.linalg.norm(one.center - other.center)) / max(one.side, other.side)


def _alike(one: HandSquare, other: HandSquare) -> bool:
    """Return whether the same would be read in two squares."""
    turned = abs(math.remainder(one.turn - other.turn, 2.0 * math.pi))
    scaled = abs(math.log(one.side / other.side))
    return _distance(one, other) < 0.1 and turned < 0.5 and scaled < 0.2


def _merit(points: KeyPoints | SeenHand, square: HandSquare) -> float:
    """Return the presence of key points less how far they end from the upper end of a square."""
    tip = square.center + (0.5 - END_MARGIN) * square.side * square.rotation @ [0.0, -1.0]
    apart = float(np.linalg.norm(points.pixels - tip, axis=1).min()) / square.side
    return points.presence - _REACH_WORTH * apart


def _seen(identity: int, square: HandSquare, points: KeyPoints, age: int) -> SeenHand:
    return SeenHand(
        identity, points.pixels, points.shape, points.presence, points.right, square, age
    )
