"""Where a hand is in a frame when nothing is known about it: depth, skin colour, and the arm.

The hand region is what is skin-coloured, stands out of the table (or of whatever is behind), does
not belong to a known object and hangs together; the arm is what continues it away from its tip.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.image.appearance import (
    BACKGROUND,
    HAND,
    AppearanceModel,
    color_bins,
    skin_prior,
)
from intent_tracking.image.tile import Tile, cut_tile

_SKIN_MARGIN = 0.3  # log-likelihood ratio skin : background from which a pixel is skin
_SKIN_WIDTH = 2.5  # colours less likely than exp(-this) of the likeliest skin are surely no skin
_STIR = 0.02  # what has moved less than this since the first frame is no hand [m]
_LEAST_SHARE = 0.003
"""Without a table, and with less skin in the image than this, the nearest thing is taken."""
_DEPTH_OF_HAND = 0.18  # how far that thing may reach away from the camera [m]
_STEP = 0.03  # largest jump in depth from the hand to its arm [m]


@dataclass(frozen=True, eq=False)
class DetectionConfig(Checked):
    """What counts as a hand."""

    size: int = 320
    """Side of the coarse image in which hands are searched [pixels], 64..1024, a multiple of 32."""
    farthest: float = 1.5
    """Nothing beyond is a hand [m], 0.3..10."""
    farthest_bare: float = 1.3
    """The same without a table, where a wall may be as near [m], 0.3..10."""
    clearance: float = 0.015
    """Height above the table from which pixels count [m], 0..0.2."""
    ceiling: float = 0.6
    """Height above the table up to which pixels count [m], 0.05..3."""
    rest_tolerance: float = 0.015
    """Depth agreement with an object at rest that excludes a pixel [m], 0.001..0.1."""
    largest_area: float = 0.045
    """Larger pieces are no hand, not even with a bare forearm [m^2], 0.005..1."""
    least_area: float = 0.0015
    """Smallest visible surface of a hand [m^2], 0.0001..0.1."""
    length: float = 0.20
    """Longest extent of a hand from its tip [m]; what is farther belongs to the arm; 0.05..1."""


@dataclass(frozen=True, eq=False)
class HandRegion:
    """A part of the frame that looks like a hand."""

    points: Floats
    """(3, n) points of the hand in the camera's frame [m]."""
    center: Array
    """(3,) their median [m]."""
    direction: Array
    """(3,) unit direction from the arm to the fingertips."""
    certain: bool
    """Whether an arm was seen at the other end; otherwise the direction is one of two guesses."""
    area: float
    """Visible surface [m^2]."""


def coarse_tile(frame: RgbdFrame, size: int) -> Tile:
    """Return the whole image as one tile of about size x size pixels."""
    camera = frame.camera
    side = float(max(camera.width, camera.height))
    return cut_tile(frame, (0.5 * (camera.width - 1), 0.5 * (camera.height - 1), side), size)


def body_pixels(
    tile: Tile, rest_depth: Floats, table: Array | None, config: DetectionConfig
) -> NDArray[np.bool_]:
    """Return the pixels (S, S) that belong to neither table nor known objects."""
    farthest = config.farthest if table is not None else config.farthest_bare
    body = (tile.depth > 0.15) & (tile.depth < farthest)
    body &= ~(np.abs(tile.depth - rest_depth) < config.rest_tolerance)
    if table is not None:
        height = np.tensordot(table[:3].astype(np.float32), tile.points, 1) + np.float32(table[3])
        body &= (height > config.clearance) & (height < config.ceiling)
    return body


def background_pixels(
    tile: Tile, rest_depth: Floats, table: Array | None, config: DetectionConfig
) -> NDArray[np.bool_]:
    """Return the pixels (S, S) that are no hand: not skin-like, or in too large a piece.

    Without a table they are those of the whole image.
    """
    body = body_pixels(tile, rest_depth, table, config)
    if table is None:
        body |= tile.depth > 0.0
    prior = skin_prior()
    like_skin = body & (prior > prior.max() * np.exp(-_SKIN_WIDTH))[color_bins(tile.color)]
    _, labels = cv2.connectedComponents(like_skin.astype(np.uint8), connectivity=4)
    areas = np.bincount(labels.ravel(), weights=((tile.depth * tile.step) ** 2).ravel())
    other: NDArray[np.bool_] = body & (~like_skin | (areas[labels] > config.largest_area))
    return other


def hand_pixels(
    tile: Tile,
    rest_depth: Floats,
    table: Array | None,
    appearance: AppearanceModel,
    config: DetectionConfig,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the pixels of things that may move, and those of them that look like skin, (S, S).

    Args:
        tile: a part of the frame.
        rest_depth: (S, S) rendered depth of the known objects [m].
        table: (4,) plane in the camera's frame, None without a table.
        appearance: colour models.
        config: thresholds.
    """
    body = body_pixels(tile, rest_depth, table, config)
    color = appearance.log_probability(color_bins(tile.color))
    skin = body & (color[HAND] - color[BACKGROUND] > _SKIN_MARGIN)
    skin = cv2.medianBlur(skin.astype(np.uint8), 3) > 0
    if table is None and skin.mean() < _LEAST_SHARE and body.any():
        skin = body & (tile.depth < np.percentile(tile.depth[body], 1) + _DEPTH_OF_HAND)
    return body, skin


def find_hand(
    tile: Tile,
    rest_depth: Floats,
    table: Array | None,
    appearance: AppearanceModel,
    still: Floats | None,
    config: DetectionConfig,
) -> tuple[HandRegion, ...]:
    """Return the most hand-like region of a coarse tile, once per possible direction of the arm.

    Args and thresholds as in `hand_pixels`; empty where nothing looks like a hand. What has the
    same depth as in an earlier tile `still` (S, S) is furniture.
    """
    body, skin = hand_pixels(tile, rest_depth, table, appearance, config)
    if still is not None:
        skin &= np.abs(tile.depth - still) > _STIR
    pixel = (tile.depth * tile.step) ** 2
    count, labels = cv2.connectedComponents(skin.astype(np.uint8), connectivity=8)
    areas = np.bincount(labels.ravel(), weights=pixel.ravel(), minlength=count)
    best, best_score = None, 0.0
    for i in range(1, count):
        if areas[i] > config.least_area:
            piece = labels == i
            depth = float(np.median(tile.depth[piece]))
            piece &= np.abs(tile.depth - depth) < 0.2
            area = float(pixel[piece].sum())
            score = min(area, 0.02) / depth**2
            if config.least_area < area < config.largest_area and score > best_score:
                best, best_score = piece, score
    return () if best is None else _regions(best, body, tile.points, pixel, config)


def _regions(
    piece: NDArray[np.bool_],
    body: NDArray[np.bool_],
    points: Floats,
    pixel: Floats,
    config: DetectionConfig,
) -> tuple[HandRegion, ...]:
    """Return the hand part of a connected skin region: what is near its tip."""
    hand = points[:, piece]
    square = np.ones((9, 9), np.uint8)
    wide = cv2.dilate(piece.astype(np.uint8), square) > 0
    deepest = cv2.dilate(np.where(piece, points[2], np.float32(0.0)), square)
    ring = wide & ~piece & body & (points[2] < deepest + _STEP)  # no torso behind the hand
    centred = hand - hand.mean(axis=1, keepdims=True)
    axis: Array = np.linalg.svd(centred @ centred.T)[0][:, 0].astype(np.float64)
    if ring.sum() > 0.1 * (wide & ~piece).sum():
        away = hand.mean(axis=1) - points[:, ring].mean(axis=1)
        away /= np.linalg.norm(away)
        axis = np.asarray(axis * np.sign(axis @ away) if abs(axis @ away) > 0.6 else away)
        return (_tip(hand, axis, True, pixel[piece], config),)
    return tuple(_tip(hand, sign * axis, False, pixel[piece], config) for sign in (1.0, -1.0))


def _tip(
    hand: Floats, axis: Array, certain: bool, pixel: Floats, config: DetectionConfig
) -> HandRegion:
    """Return the points within a hand's length of the end of a region along an axis."""
    along = axis @ hand
    kept = along > np.percentile(along, 99) - config.length
    points = hand[:, kept]
    center = np.median(points, axis=1).astype(np.float64)
    return HandRegion(points, center, axis, certain, float(pixel[kept].sum()))
