"""Which pixels of a scene may be objects: what stands on the table, in clusters."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.table_plane import TablePlane

_LOWEST = 0.005  # what is lower belongs to the table [m]
_HIGHEST = 0.50  # what is higher is no object on the table [m]
_SHARE_OVER = 0.15  # of an object's pixels, at least, are over the visible table
_JUMP = 0.025  # neighbouring pixels further apart in depth do not hang together [m]
_MARGIN = 0.01  # objects may reach this far over the table's visible edge [m]
_SMALLEST = 40  # fewer connected pixels are noise


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The parts of an oriented image."""

    table: TablePlane | None
    """The plane that objects stand on, None if there is none."""
    height: NDArray[np.float32]
    """(H, W) above the table [m]; 0 without a table."""
    mask: NDArray[np.uint8]
    """(H, W) 1 where an object may be, else 0."""
    clusters: NDArray[np.int32]
    """(H, W) number of the connected cluster of object pixels from 1 on, 0 = none."""


def segment(
    image: OrientedImage, table: TablePlane | None, allowed: NDArray[np.bool_] | None = None
) -> Segmentation:
    """Return the object pixels: everything above the table, or everything if there is none.

    Args:
        image: the scene.
        table: its table, None = there is none.
        allowed: (H, W) pixels that may be objects, None = all.
    """
    if table is None:
        height = np.zeros_like(image.depth)
        mask = image.valid
    else:
        points = image.points()
        height = np.where(image.valid, table.height(points), np.float32(0.0))
        mask = (height > _LOWEST) & (height < _HIGHEST)
        labels, count = connected_surfaces(mask, image.smooth)
        over = table.over_table(points, _MARGIN)
        # the table behind an object is hidden, so the object may seem to stand beyond its edge
        total = np.bincount(labels[mask], minlength=count)
        share = np.bincount(labels[mask & over], minlength=count) / np.maximum(total, 1)
        stands = share > _SHARE_OVER
        stands[0] = False
        mask &= over | stands[labels]
    if allowed is not None:
        mask = mask & allowed
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    large = stats[:, cv2.CC_STAT_AREA] >= _SMALLEST
    large[0] = False
    number = np.where(large, np.cumsum(large), 0).astype(np.int32)
    clusters = number[labels] if count > 1 else np.zeros_like(labels)
    return Segmentation(table, height, (clusters > 0).astype(np.uint8), clusters)


def connected_surfaces(
    mask: NDArray[np.bool_], depth: NDArray[np.float32]
) -> tuple[NDArray[np.int32], int]:
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
