"""Where the hand of a moving arm should be looked at: at its ends.

The palm network misses most hands in gloves, in the dark and those cut off by the image's border;
the key points' network reads nearly all of them if it is told where they are. On ten difficult
films of people (gloves, over- and under-exposed) the ends of what moves showed it the hand in
.65-1 of the frames, where the palm network finds .02-.7, and next to nothing else.
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_tracking.hands.hand_square import END_MARGIN, HandSquare, upward_turn
from intent_tracking.image.moving_depth import MovingThing

_LENGTH = 0.20
"""From the fingertips what may be hand [m]."""
_SIDE, _BARE_SIDE = 0.26, 0.24
"""Of the square at an end and of that around a hand alone [m]."""
_END = 0.015
"""Of an arm, within which it is looked whether it goes on outside the image [m]."""
_BORDER = 10.0
"""An end this near to the image's border is none [pixels]."""
_LONG = 2.0
"""A part is longer than wide if its variance along is this many times that across."""
_VIEW = 1.2, 0.30
"""The square around a whole thing: times its extent, but at least this [m]."""


def ends_of(thing: MovingThing, camera: Camera) -> list[HandSquare]:
    """Return squares, fingers up, around both ends of a thing that are in the image."""
    middle = thing.pixels.mean(axis=0)
    axis = _axis(thing.pixels)[0]
    found = (_end(thing, sign * axis, middle, camera) for sign in (1.0, -1.0))
    return [square for square in found if square is not None]


def turns_of(thing: MovingThing, camera: Camera) -> list[HandSquare]:
    """Return squares around the middle of a thing in four turns.

    A hand that comes out from behind something shows no arm, so its extent does not tell where the
    fingers are. Over thirty films, in the second frame of a hand these show it in a half more of
    the cases than the ends alone, in the first in twice as many.
    """
    side = _BARE_SIDE * camera.fx / float(np.median(thing.depth))
    middle = np.median(thing.pixels, axis=0)
    return [HandSquare(middle, side, 0.5 * np.pi * quarter) for quarter in range(4)]


def view_of(thing: MovingThing, camera: Camera) -> HandSquare:
    """Return the square around a thing in which palms are searched."""
    low, high = thing.pixels.min(axis=0), thing.pixels.max(axis=0)
    least = _VIEW[1] * camera.fx / float(np.median(thing.depth))
    return HandSquare(0.5 * (low + high), max(_VIEW[0] * float((high - low).max()), least), 0.0)


def _end(thing: MovingThing, away: Array, middle: Array, camera: Camera) -> HandSquare | None:
    """Return the square at the end of a thing in a direction (2,); None: it leaves the image."""
    along = (thing.pixels - middle) @ away
    top = np.percentile(along, 99)
    pixel = camera.fx / float(np.median(thing.depth))
    last = thing.pixels[along > top - _END * pixel]
    size = [camera.width - 1, camera.height - 1]
    outside = np.any((last < _BORDER) | (last > np.array(size) - _BORDER), axis=1)
    if outside.mean() > 0.3:
        return None
    near = along > top - _LENGTH * pixel
    part, pixel = thing.pixels[near], camera.fx / float(np.median(thing.depth[near]))
    axis, longer = _axis(part)
    ahead = axis * np.sign(axis @ away) if longer > _LONG else away
    start = part.mean(axis=0)
    tip = np.percentile((part - start) @ ahead, 98)
    center = start + ahead * (tip - (0.5 - END_MARGIN) * _SIDE * pixel)
    return HandSquare(center, _SIDE * pixel, upward_turn(ahead))


def _axis(pixels: Array) -> tuple[Array, float]:
    """Return the direction (2,) in which pixels extend most, and how much more than across."""
    offset = pixels - pixels.mean(axis=0)
    variances, axes = np.linalg.eigh(offset.T @ offset)
    return axes[:, 1], float(variances[1] / max(variances[0], 1e-9))
