"""The square cut-out of a frame around hand and objects, on which all costs are computed."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_tracking.image.pixel_kernels import pick_columns

OUT_OF_RANGE = np.float32(10.0)
"""Depth of large areas without a measurement: there is nothing that the sensor could reach [m]."""
_HOLE = np.ones((15, 15), np.uint8)  # smaller holes are shadows and dropouts of the sensor


@dataclass(frozen=True, eq=False)
class Tile:
    """Depth and colour sampled on an S x S grid of rays (u0 + j step, v0 + i step, 1)."""

    depth: Floats
    """(S, S) [m], 0 = missing or outside the image."""
    color: NDArray[np.uint8]
    """(S, S, 3)."""
    u0: np.float32
    v0: np.float32
    step: np.float32

    @property
    def points(self) -> Floats:
        """(3, S, S) points in the camera's frame [m]; zero where the depth is missing."""
        size = len(self.depth)
        along = np.arange(size, dtype=np.float32) * self.step
        return np.stack(
            [(self.u0 + along) * self.depth, (self.v0 + along)[:, None] * self.depth, self.depth]
        )


def covering_square(
    camera: Camera, points: Array, margin: float, least: float
) -> tuple[float, float, float]:
    """Return (column, row, side) [pixels] of the square around points (N, 3) in the camera."""
    pixels = camera.project(points)
    low, high = pixels.min(axis=0) - margin, pixels.max(axis=0) + margin
    low = np.clip(low, -margin, [camera.width, camera.height])
    high = np.clip(high, 0.0, [camera.width + margin, camera.height + margin])
    side = max(float((high - low).max()), least)
    center = 0.5 * (low + high)
    return float(center[0]), float(center[1]), side


def cut_tile(frame: RgbdFrame, square: tuple[float, float, float], size: int) -> Tile:
    """Return the tile of a square (column, row, side) with size x size pixels."""
    column, row, side = square
    camera = frame.camera
    stride = side / size
    offsets = (np.arange(size) - 0.5 * (size - 1)) * stride
    columns = np.rint(column + offsets).astype(np.int64)
    rows = np.rint(row + offsets).astype(np.int64)
    inside = ((rows >= 0) & (rows < camera.height))[:, None]
    inside = inside & (columns >= 0) & (columns < camera.width)
    rows, columns = np.clip(rows, 0, camera.height - 1), np.clip(columns, 0, camera.width - 1)
    first, last = columns[0], columns[-1] + 1
    depth = np.empty((size, size), np.float32)
    color = np.empty((size, size, 3), np.uint8)
    pick_columns(
        frame.depth[:, first:last].take(rows, axis=0),
        frame.color[:, first:last].take(rows, axis=0),
        columns - first,
        depth,
        color,
    )
    depth[~inside] = 0.0
    depth[_nothing(depth) & inside] = OUT_OF_RANGE
    # the rays are those of the grid, not of the nearest pixels: half a pixel of noise at most
    u0 = (column + offsets[0] - camera.cx) / camera.fx
    v0 = (row + offsets[0] - camera.cy) / camera.fy
    return Tile(
        depth,
        color,
        np.float32(u0),
        np.float32(v0),
        np.float32(stride / camera.fx),
    )


def _nothing(depth: Floats) -> NDArray[np.bool_]:
    """Return the pixels (S, S) of large areas without a measurement."""
    missing = (depth <= 0.0).astype(np.uint8)
    return np.asarray(cv2.morphologyEx(missing, cv2.MORPH_OPEN, _HOLE) > 0)
