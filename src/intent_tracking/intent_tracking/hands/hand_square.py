"""The turned square of an image that a network looks at, and the way into it and back.

Pixel (u, v) as everywhere: the centre of the first pixel of image and crop alike is (0, 0).
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import ColorImage

_SHRINK = 2.0
"""A crop that skips more pixels than this averages them first: far hands must not flicker."""
_PART, _STRIDE = 0.6, 0.75
"""Side of a part that is searched [longer sides of the image], step to the next [its sides]."""
END_MARGIN = 0.15
"""Above fingertips in a square around an arm's end [its sides]."""
_LEAST_PART = 120.0
"""Parts are not searched in images so small that they would be blown up [pixels]."""


@dataclass(frozen=True, eq=False)
class HandSquare:
    """A square in the image."""

    center: Array
    """(2,) its middle (u, v) [pixels]."""
    side: float
    """Its length [pixels]."""
    turn: float
    """Clockwise turn in the image that takes up to the square's own up [rad]."""

    @property
    def rotation(self) -> Array:
        """(2, 2) turns directions of the crop into directions of the image."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return np.array([[c, -s], [s, c]])

    def to_image(self, points: Array, size: int) -> Array:
        """Return the image pixels (..., 2) of pixels (..., 2) of a crop of size x size."""
        middle = 0.5 * (size - 1)
        turned = (np.asarray(points) - middle) * (self.side / size) @ self.rotation.T
        return np.asarray(turned + self.center)

    def to_crop(self, pixels: Array, size: int) -> Array:
        """Return the crop's pixels (..., 2) of image pixels (..., 2): undoes `to_image`."""
        turned = (np.asarray(pixels) - self.center) @ self.rotation * (size / self.side)
        return np.asarray(turned + 0.5 * (size - 1))

    def cut(self, color: ColorImage, size: int) -> NDArray[np.uint8]:
        """Return the crop (size, size, 3); black outside the image."""
        scale = self.side / size
        shrink = max(1, int(scale / _SHRINK))
        if shrink > 1:
            color = _shrunk(color, shrink)
        step = self.rotation * (scale / shrink)
        origin = (self.center + 0.5) / shrink - 0.5 - step @ np.full(2, 0.5 * (size - 1))
        matrix = np.column_stack([step, origin])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(cv2.warpAffine(color, matrix, (size, size), flags=flags))


def _shrunk(color: ColorImage, factor: int) -> ColorImage:
    """Return the means of factor x factor pixels; a rest at the right and lower border is lost."""
    rows, columns = (max(1, n // factor) for n in color.shape[:2])
    inner = color[: rows * factor, : columns * factor]
    return np.asarray(cv2.resize(inner, (columns, rows), interpolation=cv2.INTER_AREA))


def whole_image(width: int, height: int, turn: float = 0.0) -> HandSquare:
    """Return the smallest square of a turn by quarters that holds an image."""
    middle = np.array([0.5 * (width - 1), 0.5 * (height - 1)])
    return HandSquare(middle, float(max(width, height)), turn)


def search_views(width: int, height: int) -> list[HandSquare]:
    """Return squares in which to search one after the other: the whole image, then parts of it.

    A hand that is a tenth of the image's width is too small for the palm network; in a part, which
    is larger than any hand that is not, it is large enough. The whole image comes every other time.
    """
    whole = whole_image(width, height)
    side = _PART * whole.side
    if side < _LEAST_PART:
        return [whole]
    columns, rows = (
        [0.5 * (length - 1)]
        if length <= side
        else np.linspace(
            0.5 * side, length - 0.5 * side, 1 + math.ceil((length - side) / (_STRIDE * side))
        )
        for length in (width, height)
    )
    parts = [HandSquare(np.array([u, v]), side, 0.0) for v in rows for u in columns]
    return [view for part in parts for view in (whole, part)]


def square_of_palm(low: Array, high: Array, wrist: Array, knuckle: Array) -> HandSquare:
    """Return the square around a hand whose palm was detected, as MediaPipe makes it.

    Args:
        low: (2,) one corner of the palm's box [pixels of the crop it was found in].
        high: (2,) the opposite corner.
        wrist: (2,) key point at the wrist.
        knuckle: (2,) key point at the middle finger's base.
    """
    turn = upward_turn(knuckle - wrist)
    side = float(np.max(high - low))
    up = np.array([math.sin(turn), -math.cos(turn)])
    return HandSquare(0.5 * (low + high) + 0.5 * side * up, 2.6 * side, turn)


_INNER = [0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18]


def square_of_key_points(pixels: Array) -> HandSquare:
    """Return the square in which the next frame's key points are read, from these (21, 2).

    MediaPipe's rule: upright along wrist to knuckles, around wrist and inner joints.
    """
    turn = upward_turn((pixels[5] + 2.0 * pixels[9] + pixels[13]) / 4.0 - pixels[0])
    upright = HandSquare(np.zeros(2), 1.0, turn)
    inner = pixels[_INNER] @ upright.rotation
    low, high = inner.min(axis=0), inner.max(axis=0)
    side = max(float(np.max(high - low)), 1.0)
    center = upright.rotation @ (0.5 * (low + high) - np.array([0.0, 0.1 * side]))
    return HandSquare(center, 2.0 * side, turn)


def upward_turn(direction: Array) -> float:
    """Return the turn [rad] that takes up, (0, -1), to a direction (2,) of the image."""
    return math.atan2(float(direction[0]), -float(direction[1]))
