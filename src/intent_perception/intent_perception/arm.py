"""An arm over the table: the pixels that reach in from outside, and the hand at their end.

What stands on the table lies wholly over it; an arm also continues beyond the table's edge or the
image's. That tells it from objects without any colour; skin colour, learned from the sequence, then
tells the hand from the sleeve.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.geometry import Array
from intent_perception.oriented_image import OrientedImage
from intent_perception.table import TablePlane

Mask = NDArray[np.bool_]

_LOWEST = 0.012  # what is lower may be the table [m]
_JUMP = 0.025  # neighbouring pixels further apart in depth do not hang together [m]
_OUTSIDE = 0.03  # beyond the table's edge by this is outside [m]


@dataclass(frozen=True)
class ArmConfig:
    """Parameters of the search for arms."""

    inside_pixels: int = 150
    """Pixels of an arm over the table, at least, 1..100000."""
    outside_pixels: int = 60
    """Pixels of an arm outside the table or at the image's border, at least, 1..100000."""
    reach: float = 0.04
    """How far an arm reaches over the table, at least [m], 0..1."""


def arm_pixels(image: OrientedImage, table: TablePlane | None, config: ArmConfig) -> Mask:
    """Return the pixels (H, W) of everything that reaches over the table from outside.

    Without a table nothing can be said, and no pixel is returned.
    """
    arm = np.zeros(image.depth.shape, dtype=bool)
    if table is None:
        return arm
    points = image.points()
    raised = image.valid & (table.height(points) > _LOWEST)
    labels, count = connected_surfaces(raised, image.smooth)
    inset = table.inset(points)
    over, beyond, deep = inset > 0.0, inset < -_OUTSIDE, inset > config.reach
    border = np.zeros_like(arm)
    border[:4], border[-4:], border[:, :4], border[:, -4:] = True, True, True, True
    sums = [
        np.bincount(labels[chosen], minlength=count)
        for chosen in (over & raised, (beyond | border) & raised, deep & raised)
    ]
    reaching = (
        (sums[0] >= config.inside_pixels) & (sums[1] >= config.outside_pixels) & (sums[2] > 0)
    )
    reaching[0] = False
    arm = reaching[labels] & over
    grown = cv2.dilate(arm.astype(np.uint8), np.ones((5, 5), np.uint8))
    return np.asarray(raised & (grown > 0))


def connected_surfaces(mask: Mask, depth: NDArray[np.float32]) -> tuple[NDArray[np.int32], int]:
    """Return labels (H, W) of parts of a mask that hang together in space, and their number.

    Label 0 is what is outside the mask or at a jump in depth.
    """
    kernel = np.ones((3, 3), np.uint8)
    filled = np.where(mask, depth, np.float32(0.0))
    highest = cv2.dilate(filled, kernel)
    lowest = cv2.erode(np.where(mask, depth, np.float32(10.0)), kernel)
    smooth = mask & (highest - lowest < _JUMP)
    count, labels = cv2.connectedComponents(smooth.astype(np.uint8))
    return labels, count


@dataclass(frozen=True, eq=False)
class HandSeed:
    """Where a hand is over the table: a start for tracking."""

    arm: Mask
    """(H, W) pixels of hand and forearm."""
    hand: Mask
    """(H, W) of these, the hand's: within a hand's length of its far end, of skin if any is."""
    fingers: Array
    """(3,) far end of the arm in camera coordinates [m]."""
    center: Array
    """(3,) middle of the hand's visible surface [m]."""
    direction: Array
    """(3,) unit vector from forearm to fingers."""


class SkinColor:
    """The colour of this person's skin under this lamp, learned while the sequence runs.

    Chromaticity only, so that shading does not matter. Before anything is learned, a wide prior of
    human skin stands in.
    """

    def __init__(self) -> None:
        self._mean = np.array([0.43, 0.31])
        self._variance = np.array([0.06, 0.035]) ** 2
        self._weight = 0.0

    def likely(self, color: NDArray[np.float32]) -> Mask:
        """Return whether colours (..., 3), RGB in 0..1, may be skin."""
        total = color.sum(axis=-1)
        chroma = color[..., :2] / np.maximum(total, 0.05)[..., None]
        distance = ((chroma - self._mean) ** 2 / self._variance).sum(axis=-1)
        likely: Mask = (distance < 9.0) & (total > 0.25)
        return likely

    def learn(self, color: NDArray[np.float32]) -> None:
        """Take colours (N, 3) of pixels known to be a hand; few or mixed ones change little."""
        likely = color[self.likely(color)]
        if len(likely) < 200:
            return
        chroma = likely[:, :2] / likely.sum(axis=1, keepdims=True)
        self._weight += 1.0
        share = max(0.1, 1.0 / (1.0 + self._weight))
        middle = np.median(chroma, axis=0)
        spread = 1.48 * np.median(np.abs(chroma - middle), axis=0)
        self._mean = (1.0 - share) * self._mean + share * middle
        widest = np.array([0.06, 0.035])
        spread = np.clip(2.0 * spread, 0.012, widest)
        self._variance = (1.0 - share) * self._variance + share * spread**2


def hand_seed(
    image: OrientedImage,
    table: TablePlane,
    skin: SkinColor,
    config: ArmConfig | None = None,
    length: float = 0.19,
) -> HandSeed | None:
    """Return where a hand reaches over the table, None if no arm does.

    Args:
        image: the scene.
        table: its table.
        skin: colour of skin so far; it learns from the hand that is found.
        config: of the search for arms.
        length: of a hand [m].
    """
    arm = arm_pixels(image, table, config or ArmConfig())
    if not arm.any():
        return None
    points = image.points()[arm].astype(np.float64)
    edge = table.inset(points.astype(np.float32))
    inner = points[edge >= np.quantile(edge, 0.98)]
    fingers = np.median(inner, axis=0)
    distance = np.linalg.norm(points - fingers, axis=1)
    near = distance < length
    colors = image.color[arm]
    skinned = skin.likely(colors) & near
    chosen = skinned if skinned.sum() >= 0.25 * near.sum() else near
    skin.learn(colors[near])
    hand = np.zeros_like(arm)
    hand[arm] = chosen
    center = points[chosen].mean(axis=0)
    behind = points[distance >= min(length, float(np.quantile(distance, 0.7)))]
    direction = fingers - behind.mean(axis=0)
    return HandSeed(arm, hand, fingers, center, direction / np.linalg.norm(direction))
