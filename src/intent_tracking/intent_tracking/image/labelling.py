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
from intent_tracking.image.tile import Tile
from intent_tracking.scene.hand_kernel import HandArrays, HandBuffers, nearest_capsule
from intent_tracking.scene.object_kernel import ObjectArrays, object_distances
from intent_tracking.scene.state_layout import object_start

NOBODY, OF_HAND, OF_ARM, OF_REST, OF_OBJECT = -1, -2, -3, -4, 0
"""Labels of pixels; active object k has label k >= 0."""
_SPREAD = 0.012  # standard deviation of a body's surface around its prediction [m]
_WRIST = -0.022  # points with a smaller x in the wrist frame belong to the forearm [m]


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
    label = np.full(tile.depth.shape, NOBODY, np.int8)
    rest = np.abs(tile.depth - rest_depth) < config.rest_tolerance
    label[rest] = OF_REST
    candidate = tile.depth > 0.0
    if table is not None:
        height = np.tensordot(table[:3].astype(np.float32), points, 1) + np.float32(table[3])
        candidate &= height > config.clearance
    chosen = np.flatnonzero(candidate)
    near = np.ascontiguousarray(points.reshape(3, -1)[:, chosen])
    color = appearance.log_probability(bins.ravel()[chosen])
    scores, gap = _scores(near, bodies, color, rest.ravel()[chosen], config)
    local = bodies.rotations[0].T @ (near - bodies.state[:3, None])
    winner = np.argmax(scores, axis=0)
    kind = np.where(winner == 0, NOBODY, np.where(winner == 1, OF_HAND, winner - 2))
    arm = (local[0] < _WRIST) & (np.hypot(local[1], local[2] - 0.01) < 0.07)
    kind[arm & (local[0] > -0.30) & (kind < OF_OBJECT)] = OF_ARM
    keep_rest = rest.ravel()[chosen] & (kind == NOBODY)
    label.ravel()[chosen] = np.where(keep_rest, OF_REST, kind)
    distance = np.full(tile.depth.size, np.float32(1.0))
    distance[chosen] = gap
    return Pixels(label, bins, points, distance.reshape(tile.depth.shape))


def _scores(
    near: Floats, bodies: Bodies, color: Floats, rest: NDArray[np.bool_], config: LabellingConfig
) -> tuple[Floats, Floats]:
    """Return the log-scores (2 + K, n) of background, hand, objects, and the hand gap (n,)."""
    count, objects = near.shape[1], len(bodies.objects.surface)
    gap, nearest = np.empty(count, np.float32), np.empty(count, np.float32)
    nearest_capsule(near, bodies.buffers.ends, bodies.hand.radii, gap, nearest)
    factor = np.float32(0.5 / _SPREAD**2)
    scores = np.empty((2 + objects, count), np.float32)
    scores[0] = color[BACKGROUND] - np.float32(0.5 * 2.5**2)
    scores[0, rest] += 3.0
    scores[1] = color[HAND] - np.minimum(gap * gap * factor, 4.5)
    scores[1, gap > config.reach] = -1e3
    distance, reach = np.empty(count, np.float32), np.float32(config.reach)
    for k in range(objects):
        origin = bodies.state[object_start(k) : object_start(k) + 3]
        object_distances(bodies.objects, k, bodies.rotations[1 + k], *origin, near, reach, distance)
        row = bodies.color_rows[k]
        scores[2 + k] = color[FIRST_OBJECT + row] - np.minimum(distance * distance * factor, 4.5)
        scores[2 + k, np.abs(distance) > config.reach] = -1e3
    return scores, gap


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
