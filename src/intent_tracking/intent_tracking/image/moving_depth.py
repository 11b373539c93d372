"""What has come nearer than what stands still: an arm that reaches, whatever it wears.

Skin may be black in the dark, white in the light or in a glove; that something is now in front of
what was there before needs no colour. Every pixel of a coarse depth image keeps the depth of what
stands still: what is revealed behind it is believed at once, what comes nearer by and by.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame

_COLUMNS = 160
"""Least width of the coarse image [pixels]."""
_NEARER = 0.03
"""What is nearer by this and by the noise is something else [m]."""
_NOISE = 0.01
"""Three times that of depth cameras at 1 m; it grows with the square of the distance [m]."""
_ABSORBED = 0.002
"""What came nearer is taken for standing still by this in every frame [m]: a hand that is held
10 cm above a table counts for more than a second, what is put down for less."""
_REACH = 1.6
"""Farther things are not looked at [m]."""
_LEAST_AREA = 0.0004
"""Visible surface below which nothing moves [m^2]: a fingertip."""


@dataclass(frozen=True, eq=False)
class MovingThing:
    """A connected part of the image that shows something which has come nearer."""

    pixels: Array
    """(n, 2) its pixels, a grid of them [pixels of the image]."""
    depth: Floats
    """(n,) of each [m]."""
    area: float
    """Visible surface [m^2]."""


class MovingDepth:
    """The parts of each frame where something has come in front of what stood still."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget what stands still: another scene begins."""
        self._still: Floats | None = None
        self._stride, self._focal = 1, 1.0
        self._depth: Floats = np.zeros((1, 1), np.float32)
        self._moving: NDArray[np.bool_] = np.zeros((1, 1), np.bool_)

    def note(self, frame: RgbdFrame) -> None:
        """Take note of the next frame."""
        self._stride = max(1, frame.depth.shape[1] // _COLUMNS)
        depth = np.ascontiguousarray(frame.depth[:: self._stride, :: self._stride])
        if self._still is None or self._still.shape != depth.shape:
            self._still = depth
        self._depth, self._focal = depth, frame.camera.fx
        known, still = depth > 0.0, self._still
        margin = np.float32(_NEARER) + np.float32(_NOISE) * depth * depth
        # where nothing was measured nothing was near: far things, black cloth
        nearer = known & (depth < _REACH) & ((still <= 0.0) | (depth < still - margin))
        self._moving = cv2.medianBlur(nearer.astype(np.uint8), 5) > 0
        fresh = np.where(still > 0.0, np.maximum(depth, still - np.float32(_ABSORBED)), _REACH)
        self._still = np.where(known, fresh, still).astype(np.float32)

    def share(self, pixels: Array) -> float:
        """Return the share of image pixels (n, 2) at which something has come nearer."""
        columns, rows = np.rint(pixels / self._stride).astype(np.int64).T
        height, width = self._moving.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        moving = self._moving[rows[inside], columns[inside]]
        return float(moving.mean()) if len(moving) else 0.0

    def things(self) -> list[MovingThing]:
        """Return what has come nearer, the largest surface first."""
        _, labels = cv2.connectedComponents(self._moving.astype(np.uint8))
        surface = (self._depth * (self._stride / self._focal)) ** 2
        areas = np.bincount(labels.ravel(), weights=surface.ravel())
        areas[0] = 0.0
        chosen = [k for k in np.argsort(-areas, kind="stable") if areas[k] > _LEAST_AREA]
        return [self._thing(labels == k, float(areas[k])) for k in chosen]

    def _thing(self, piece: NDArray[np.bool_], area: float) -> MovingThing:
        rows, columns = np.nonzero(piece)
        pixels: Array = np.column_stack([columns, rows]).astype(np.float64) * self._stride
        return MovingThing(pixels, self._depth[piece], area)
