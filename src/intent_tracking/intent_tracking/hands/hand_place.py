"""Where a seen hand is in the image: at an expected place, beside what moves, before a surface."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.hands.hand_square import HandSquare
from intent_tracking.hands.seen_hand import PALM, SeenHand
from intent_tracking.image.moving_depth import MovingThing

_NEAR = 0.6
"""A seen hand whose middle lies this near to the expected one is it [sides of its square]."""
_OWN_ARM = 0.6
"""What moves this near to the middle of a hand may be its own arm [sides of its square]."""
_LEAST_MEASURED = 3
"""Key points with depth without which a hand is only a picture of one."""


def has_depth(hand: SeenHand, frame: RgbdFrame) -> bool:
    """Return whether there is a measurement at some key points: else nothing tells where it is."""
    height, width = frame.depth.shape
    columns, rows = np.rint(hand.pixels).astype(np.int64).T
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    return int((frame.depth[rows[inside], columns[inside]] > 0.0).sum()) >= _LEAST_MEASURED


def beside(thing: MovingThing, square: HandSquare) -> bool:
    """Return whether a thing lies outside a square: an arm that moves is its own hand's."""
    offset = np.abs(thing.pixels - square.center).max(axis=1)
    return bool(np.all(offset > _OWN_ARM * square.side))


def at_place(hand: SeenHand, pixel: Array) -> bool:
    """Return whether a hand is seen where a palm (2,) is expected [pixels]."""
    return _apart(hand, pixel) < _NEAR


def middle_of(hand: SeenHand) -> Array:
    """Return the middle (2,) of a hand's palm [pixels]."""
    return np.asarray(hand.pixels[PALM].mean(axis=0))


def _apart(hand: SeenHand, pixel: Array) -> float:
    return float(np.linalg.norm(middle_of(hand) - pixel)) / hand.square.side


def distance_of(hand: SeenHand, objects: Array | None) -> float:
    """Return how far a hand lies from the nearest object in the image [sides of its square]."""
    if objects is None or not len(objects):
        return 0.0
    return min(_apart(hand, pixel) for pixel in objects)
