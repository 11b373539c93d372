"""What lies so low that single pixels do not show it: cutlery, pens.

A table knife is 4 mm high, which the noise of one pixel hides, but not that of hundreds.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats, Mask
from intent_perception.scene.scene_view import SceneView

_AROUND = 61
"""Edge of the window whose bare pixels tell how high the table is there [pixel]."""
_MEAN = 5
"""Edge of the window over which heights are averaged [pixel]."""
_LEAST_STEP, _LEAST_EDGE = 0.0015, 0.001
"""From the table up to the midst of a thing, and to what hangs together with it [m]."""
_SPREADS, _EDGE_SPREADS = 5.0, 4.0
"""The same in standard deviations of the averaged table: depth cameras ripple."""
_SMALLEST, _LEAST_MIDST = 150, 60
"""Fewer pixels, or fewer in its midst, are noise."""
_RIM, _TALL = 9, 0.010
"""Edge of the window around tall pixels in which their rims are [pixel]; how tall they are [m]."""
_BENT = 0.015
"""The table and what is low on it are so near the plane [m]."""


def low_things(scene: SceneView, taken: Mask, most: int) -> list[Mask]:
    """Return the pixels (H, W) of each thing that lies low, apart from all that is tall.

    Args:
        scene: with a table.
        taken: (H, W) pixels of things that are known to be there.
        most: how many things, the largest.
    """
    table, higher = scene.parts.table, scene.parts.mask == 1
    if table is None or most <= 0:
        return []
    height = scene.parts.height
    level = scene.image.valid & (np.abs(height) < _BENT)
    level &= table.over_table(scene.points, 0.0)
    bare = level & ~higher
    if not bare.any():
        return []
    midst, edge = _raised(height, bare)
    tall = taken | (_mean(height, scene.image.valid, _MEAN) > _TALL)
    tall = cv2.dilate(tall.astype(np.uint8), np.ones((_RIM, _RIM), np.uint8)) > 0
    joined = (edge | higher | tall).astype(np.uint8)
    joined = cv2.morphologyEx(joined, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(joined)
    sizes = stats[:, cv2.CC_STAT_AREA]
    inner = np.bincount(labels[midst | higher], minlength=len(sizes))
    things = (sizes >= _SMALLEST) & (inner >= _LEAST_MIDST)
    things[labels[tall]] = False
    things[0] = False
    return [labels == k for k in _largest(things, sizes, most)]


def _largest(things: NDArray[np.bool_], sizes: NDArray[np.int32], most: int) -> NDArray[np.int64]:
    numbers = np.flatnonzero(things)
    return np.sort(numbers[np.argsort(-sizes[numbers], kind="stable")[:most]])


def _raised(height: Floats, bare: Mask) -> tuple[Mask, Mask]:
    """Return the pixels (H, W) that are as far above the table as the midst and edge of a thing.

    Above the plane and above what is around them: the plane alone errs where the camera bends it,
    the surroundings alone where they are seen on one side only.
    """
    above = height - _mean(height, bare, _AROUND)
    step = np.minimum(_mean(above, bare, _MEAN), _mean(height, bare, _MEAN))
    # The things are the upper side: the lower one shows how widely the table itself spreads.
    middle, low = np.quantile(step[bare], [0.5, 0.159])
    step, spread = step - middle, float(middle - low)
    midst = step > max(_LEAST_STEP, _SPREADS * spread)
    edge = step > max(_LEAST_EDGE, _EDGE_SPREADS * spread)
    return bare & midst, bare & edge


def _mean(values: Floats, counted: Mask, edge: int) -> Floats:
    """Return the mean (H, W) of the counted pixels in a window around each, 0 where none is."""
    weight = counted.astype(np.float32)
    total = cv2.boxFilter(np.where(counted, values, np.float32(0.0)), cv2.CV_32F, (edge, edge))
    share = cv2.boxFilter(weight, cv2.CV_32F, (edge, edge))
    return np.asarray(total / np.maximum(share, np.float32(1e-6)))
