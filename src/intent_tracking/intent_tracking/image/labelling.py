"""Which body every pixel of a tile belongs to: geometry of the prediction plus learned colours."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_tracking.image.appearance import (
    BACKGROUND,
    FIRST_OBJECT,
    HAND,
    AppearanceModel,
    color_bins,
)
from intent_tracking.image.frame_evidence import FrameEvidence, Labelled
from intent_tracking.image.pixel_kernels import OF_ARM, OF_HAND, OF_OBJECT, share_out
from intent_tracking.image.tile import Tile
from intent_tracking.scene.hand_kernel import HandArrays, HandBuffers
from intent_tracking.scene.object_kernel import ObjectArrays

_EVERYTHING: Array = np.array([0.0, 0.0, 0.0, 1e3])
"""The plane of no table: everything is far above it."""


@dataclass(frozen=True, eq=False)
class LabellingConfig(Checked):
    """How pixels are shared out."""

    reach: float = 0.09
    """Hand and object pixels lie within this distance of the predicted body [m], 0.01..0.5."""
    clearance: float = 0.006
    """Pixels lower than this above the table belong to it [m], 0..0.1."""
    rest_tolerance: float = 0.009
    """Depth agreement that makes a pixel part of an object at rest [m], 0.001..0.1."""
    hand_points: int = 512
    """Points of the hand that poses are fitted to, evenly spread, 16..8192."""
    object_points: int = 256
    """Points of all objects that poses are fitted to, evenly spread, 16..8192."""


class Bodies(NamedTuple):
    """The predicted scene that pixels are compared with."""

    hand: HandArrays
    buffers: HandBuffers
    objects: ObjectArrays
    state: Floats
    rotations: Floats
    color_rows: tuple[int, ...]
    """Row of each active object in the appearance model."""


class Pixels(NamedTuple):
    """A labelled tile."""

    label: NDArray[np.int8]
    """(S, S)."""
    bins: NDArray[np.int32]
    """(S, S) colour bins."""
    points: Floats
    """(3, S, S) [m]."""
    hand_gap: Floats
    """(S, S) distance to the predicted hand [m], large where it was not computed."""


def label_pixels(
    tile: Tile,
    bodies: Bodies,
    appearance: AppearanceModel,
    rest_depth: Floats,
    table: Array | None,
    config: LabellingConfig,
) -> Pixels:
    """Return the body of every pixel.

    Args:
        tile: the cut-out.
        bodies: prediction of hand and active objects.
        appearance: colours of hand, background and objects.
        rest_depth: (S, S) rendered depth of objects at rest, large where there is none [m].
        table: (4,) plane (n, d) in the camera's frame with height n . p + d, None without a table.
        config: thresholds.
    """
    points, bins = tile.points, color_bins(tile.color)
    label = np.empty(tile.depth.shape, np.int8)
    distance = np.ones(tile.depth.shape, np.float32)
    plane = _EVERYTHING if table is None else table
    limits = config.reach, config.clearance, config.rest_tolerance
    share_out(
        bodies.hand, bodies.buffers, bodies.objects, bodies.state, bodies.rotations,
        np.array([BACKGROUND, HAND, *(FIRST_OBJECT + row for row in bodies.color_rows)]),
        appearance.log_table, bins.ravel(), tile.depth.ravel(), rest_depth.ravel(),
        points.reshape(3, -1), plane.astype(np.float32),
        tuple(np.float32(limit) for limit in limits), label.ravel(), distance.ravel(),
    )  # fmt: skip
    return Pixels(label, bins, points, distance)


def evidence_of(
    tile: Tile, pixels: Pixels, config: LabellingConfig
) -> tuple[FrameEvidence, Labelled]:
    """Return what the refinement and the rendered costs need of a labelled tile."""
    hand = _cleaned(pixels.label == OF_HAND)
    thing = _cleaned(pixels.label >= OF_OBJECT)
    body = cv2.morphologyEx((hand | thing).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3)))
    # single dropouts on the background must not look like a place where a finger can hide
    unknown = _cleaned(tile.depth <= 0.0) | (pixels.label == OF_ARM)
    inside = (body > 0) | unknown
    outside = cv2.distanceTransform(1 - inside.astype(np.uint8), cv2.DIST_L2, 3)
    points = pixels.points.reshape(3, -1)
    hand_pixels = _spread(np.flatnonzero(hand & (tile.depth > 0)), config.hand_points)
    thing_pixels = _spread(np.flatnonzero(thing & (tile.depth > 0)), config.object_points)
    owners = np.maximum(pixels.label.ravel()[thing_pixels], 0).astype(np.int64)
    evidence = FrameEvidence(
        np.ascontiguousarray(points[:, hand_pixels]),
        np.ascontiguousarray(points[:, thing_pixels]),
        owners,
        tile.depth,
        outside.astype(np.float32),
        tile.u0,
        tile.v0,
        tile.step,
    )
    valid = (~unknown & (tile.depth > 0.0)).astype(np.float32)
    seen = Labelled(
        tile.depth,
        hand.astype(np.float32),
        thing.astype(np.float32),
        valid,
        inner_pixels(hand) * inner_pixels(thing),
        tile.u0,
        tile.v0,
        tile.step,
    )
    return evidence, seen


def inner_pixels(mask: NDArray[np.bool_]) -> Floats:
    """Return 1 where the 3 x 3 pixels around are all in the mask (S, S) or all out of it."""
    image, square = mask.astype(np.uint8), np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(image, square) == cv2.erode(image, square), dtype=np.float32)


def _cleaned(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    smooth: NDArray[np.bool_] = cv2.medianBlur(mask.astype(np.uint8), 3) > 0
    return smooth


def _spread(indices: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return at most `count` of the indices, evenly spread in the order of rows."""
    if len(indices) <= count:
        return indices
    return indices[((np.arange(count) + 0.5) * (len(indices) / count)).astype(np.int64)]
