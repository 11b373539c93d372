"""An arm over the table: the pixels that reach in from outside.

What stands on the table lies wholly over it; an arm also continues beyond the table's edge or the
image's. That tells it from objects without any colour, whatever the sleeve or the glove.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from intent_perception.basics.arrays import Mask
from intent_perception.basics.parameters import Checked
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.segmentation import connected_surfaces
from intent_perception.scene.table_plane import TablePlane

_LOWEST = 0.012  # what is lower may be the table [m]
_ELBOW = 0.08  # what is higher at the table's edge may belong to an arm [m]
_OUTSIDE = 0.03  # beyond the table's edge by this is outside [m]


@dataclass(frozen=True)
class ArmConfig(Checked):
    """Parameters of the search for arms."""

    inside_pixels: int = 150
    """Pixels of an arm over the table, at least, 1..100000."""
    outside_pixels: int = 60
    """Pixels of an arm outside the table or at the image's border, at least, 1..100000."""
    edge: float = 0.05
    """Width of the strip along the table's edge where an elbow may be [m], 0..1."""
    reach: float = 0.06
    """How far beyond that strip an arm reaches, at least [m], 0..1."""


def arm_pixels(image: OrientedImage, table: TablePlane | None, config: ArmConfig) -> Mask:
    """Return the pixels (H, W) of everything that reaches over the table from outside.

    Without a table nothing can be said, and no pixel is returned.
    """
    arm = np.zeros(image.depth.shape, dtype=bool)
    if table is None:
        return arm
    points = image.points()
    height = table.height(points)
    raised = image.valid & (height > _LOWEST)
    labels, count = connected_surfaces(raised, image.smooth)
    inset = table.inset(points)
    border = np.zeros_like(arm)
    border[:4], border[-4:], border[:, :4], border[:, -4:] = True, True, True, True
    # an elbow in the air may seem to be over the table's edge
    entering = (inset < -_OUTSIDE) | border | ((inset < config.edge) & (height > _ELBOW))
    over, deep = inset > 0.0, inset > config.edge + config.reach
    sums = [np.bincount(labels[k & raised], minlength=count) for k in (over, entering, deep)]
    reaching = (
        (sums[0] >= config.inside_pixels) & (sums[1] >= config.outside_pixels) & (sums[2] > 0)
    )
    reaching[0] = False
    grown = cv2.dilate((reaching[labels] & over).astype(np.uint8), np.ones((5, 5), np.uint8))
    return np.asarray(raised & (grown > 0))
