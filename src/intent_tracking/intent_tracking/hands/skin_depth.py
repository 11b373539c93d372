"""The depth of the skin at the key points of a hand, and the pixels that surely show it.

Depth is measured beside what is meant: half a fingertip's pixels may belong to what lies behind.
So a sample is the near side of a small patch, and it counts only where it agrees with the others.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.camera import DepthImage
from intent_tracking.hands.seen_hand import PALM

BONES = np.array([(0 if j % 4 == 1 else j - 1, j) for j in range(1, 21)])
"""(20, 2) key points at the ends of each bone, palm side first."""

_NEAR = 0.25
"""Share of a patch's pixels that may be nearer than its sample: noise, not skin."""
_AGREE = 0.025
"""Samples of one hand agree within this once its shape is taken off [m]."""
_SAME_HAND = 0.07
"""Samples farther than this from where they are expected belong to other things [m]."""
_APART = 0.035
"""Depths farther apart than this may be two things [m]."""
_SECOND = 0.3
"""Share of the votes from which a second depth is tried."""
_NEAREST = 0.05
"""No camera measures less [m]."""
_SIZE_SPREAD = 0.3
"""Standard deviation of the log of a hand's size as the networks see it."""


@kernel
def _near_depths(depth: Floats, pixels: Array, half: int, share: float, out: Array) -> None:
    """Write the `share` quantile of the valid depths around each pixel (S, 2); 0 = none."""
    rows, columns = depth.shape
    values = np.empty((2 * half + 1) ** 2, np.float32)
    for s in range(pixels.shape[0]):
        u, v = round(pixels[s, 0]), round(pixels[s, 1])
        count = 0
        for r in range(max(int(v) - half, 0), min(int(v) + half + 1, rows)):
            for c in range(max(int(u) - half, 0), min(int(u) + half + 1, columns)):
                if depth[r, c] > 0.0:
                    values[count] = depth[r, c]
                    count += 1
        out[s] = 0.0
        if count > 0:
            out[s] = np.sort(values[:count])[int(share * count)]


def with_bones(points: Array) -> Array:
    """Return the key points (21, k) and after them the middles of the 20 bones: (41, k)."""
    return np.concatenate([points, points[BONES].mean(axis=1)])


def measured_depth(depth: DepthImage, pixels: Array, half: int) -> Array:
    """Return the depth (n,) of the near side of the patch around each pixel, 0 = unknown [m].

    Args:
        depth: (H, W) [m], 0 = no measurement.
        pixels: (n, 2), also outside the image.
        half: half the side of a patch [pixels].
    """
    measured = np.zeros(len(pixels))
    _near_depths(depth, pixels, half, _NEAR, measured)
    return measured


def palm_depths(measured: Array, relative: Array, by_size: float) -> list[float]:
    """Return the depths [m] that the middle of the palm may have, likeliest first, one or two.

    Over-exposed or grazed skin has no depth, and then much of what is measured lies behind.

    Args:
        measured: (41,) depth at key points and bones, 0 = unknown [m].
        relative: (41,) how much farther than the middle of the palm each is expected [m].
        by_size: depth at which the hand has its size, for want of a better one [m].
    """
    middle = (measured - relative)[measured > 0.0]
    candidates = np.sort(middle[middle > _NEAREST])
    if not candidates.size:
        return [by_size]
    agree = np.abs(candidates[:, None] - candidates) < _AGREE
    likely = np.exp(-0.5 * (np.log(candidates / by_size) / _SIZE_SPREAD) ** 2)
    votes = agree.sum(axis=1) * likely
    best = int(np.argmax(votes))
    other = np.where(np.abs(candidates - candidates[best]) < _APART, 0.0, votes)
    second = int(np.argmax(other))
    chosen = [best, second] if other[second] > _SECOND * votes[best] else [best]
    return [float(np.median(candidates[agree[row]])) for row in chosen]


def skin_depth(measured: Array, relative: Array, palm: float) -> Array:
    """Return the measured depth (41,) where it may be that of a hand at a depth, else 0 [m]."""
    near = (measured > 0.0) & (np.abs(measured - relative - palm) < _SAME_HAND)
    return np.where(near, measured, 0.0)


def hand_mask(depth: DepthImage, pixels: Array, sampled: Array) -> NDArray[np.bool_]:
    """Return the pixels (H, W) that surely show the hand: on its bones and at their depth.

    A colour model may learn from them: borders, what lies behind and what covers the hand are left
    out. Palm and bones are drawn thinner than they are.

    Args:
        depth: (H, W) [m], 0 = no measurement.
        pixels: (21, 2) key points.
        sampled: (41,) depth of the skin as in `KeyPointStart.depth`.
    """
    mask = np.zeros(depth.shape, np.uint8)
    palm = float(np.linalg.norm(pixels[9] - pixels[0]))
    width = max(1, round(0.08 * palm))
    corners = np.rint(pixels[PALM]).astype(np.int32)
    inner = corners.mean(axis=0) + 0.85 * (corners - corners.mean(axis=0))
    cv2.fillConvexPoly(mask, cv2.convexHull(np.rint(inner).astype(np.int32)), 1)
    known = sampled > 0.0
    for bone, (first, second) in enumerate(BONES):
        if known[first] and known[second] and known[21 + bone] and first > 0:
            ends = np.rint(pixels[[first, second]]).astype(np.int32).tolist()
            cv2.line(mask, ends[0], ends[1], 1, width)
    seen = mask.astype(np.bool_)
    if known.any():
        low, high = np.min(sampled[known]) - 0.02, np.max(sampled[known]) + 0.02
        seen &= (depth > low) & (depth < high)
    return seen
