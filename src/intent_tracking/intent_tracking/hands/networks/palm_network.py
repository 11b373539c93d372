"""Palms in a colour image: MediaPipe's palm detection.

The network answers for 2016 anchors, each with a box and seven key points relative to it: two
anchors in every cell of a 24 x 24 grid, then six in every cell of 12 x 12.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import ColorImage
from intent_tracking.hands.hand_square import HandSquare, square_of_palm
from intent_tracking.hands.networks.lite_network import LiteNetwork

_GRIDS = ((24, 2), (12, 6))
_VALUES = 18
_WRIST, _MIDDLE = 0, 2  # of the seven key points
_OVERLAP = 0.3
"""Boxes that share more of their union are the same palm."""


@dataclass(frozen=True, eq=False)
class SeenPalm:
    """A palm in the image."""

    square: HandSquare
    """Around the whole hand, the fingers up."""
    score: float
    """Probability that it is a palm."""


class PalmNetwork:
    """Finds palms in a square of the image."""

    def __init__(self, name: str) -> None:
        """Load `palm_detection_lite` or `palm_detection_full`; ValueError as `LiteNetwork`."""
        count = sum(cells * cells * each for cells, each in _GRIDS)
        self._network = LiteNetwork(name, ((count, _VALUES), (count, 1)))
        self._anchors = anchor_centers(self._network.size)

    def find(self, color: ColorImage, view: HandSquare, least: float) -> list[SeenPalm]:
        """Return the palms in a square of an image, best first, with a score of `least` or more."""
        size = self._network.size
        values, logits = self._network(view.cut(color, size))
        scores = 1.0 / (1.0 + np.exp(-np.clip(logits[:, 0].astype(np.float64), -80.0, 80.0)))
        palms = []
        for score, value in merged_palms(self._anchors, values, scores, least):
            # the box stands upright in the crop: make the square there, then take it to the image
            found = square_of_palm(value[0], value[1], value[2 + _WRIST], value[2 + _MIDDLE])
            palms.append(SeenPalm(_in_image(found, view, size), score))
        return palms


def _in_image(found: HandSquare, view: HandSquare, size: int) -> HandSquare:
    scale = view.side / size
    return HandSquare(view.to_image(found.center, size), found.side * scale, found.turn + view.turn)


def anchor_centers(size: int) -> Array:
    """Return the centres (2016, 2) of the anchors [pixels of an input of size x size]."""
    centers = []
    for cells, each in _GRIDS:
        rows, columns = np.mgrid[0:cells, 0:cells]
        cell = np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5
        centers.append(np.repeat(cell * (size / cells) - 0.5, each, axis=0))
    return np.concatenate(centers)


def merged_palms(
    anchors: Array, values: Floats, scores: Array, least: float
) -> list[tuple[float, Array]]:
    """Return score and points (9, 2) of each palm: box corners, then seven key points.

    Answers of neighbouring anchors for one palm are averaged, weighted by their scores (weighted
    non-maximum suppression, as in BlazeFace), which steadies the box.

    Args:
        anchors: (A, 2) centres [pixels].
        values: (A, 18) box centre and size, seven key points, relative to the anchor [pixels].
        scores: (A,) probabilities.
        least: score below which an answer counts for nothing.
    """
    chosen = np.flatnonzero(scores >= least)
    chosen = chosen[np.argsort(-scores[chosen], kind="stable")]
    values = values[chosen].astype(np.float64)
    middle, half = anchors[chosen] + values[:, :2], 0.5 * values[:, 2:4]
    keys = anchors[chosen][:, None] + values[:, 4:].reshape(-1, 7, 2)
    points = np.concatenate([(middle - half)[:, None], (middle + half)[:, None], keys], axis=1)
    palms = []
    left = np.ones(len(chosen), np.bool_)
    while left.any():
        best = int(np.argmax(left))
        same = left & (_overlap(points[best], points) > _OVERLAP)
        same[best] = True
        weights = scores[chosen[same]]
        palms.append((float(scores[chosen[best]]), np.average(points[same], 0, weights)))
        left &= ~same
    return palms


def _overlap(one: Array, others: Array) -> Array:
    """Return intersection over union (n,) of one box with others; corners stand first."""
    low = np.maximum(one[0], others[:, 0])
    high = np.minimum(one[1], others[:, 1])
    common = np.prod(np.maximum(high - low, 0.0), axis=1)
    areas = np.prod(others[:, 1] - others[:, 0], axis=1)
    union = float(np.prod(one[1] - one[0])) + areas - common
    return np.asarray(common / np.maximum(union, 1e-9))
