"""Loops over the pixels of a tile that numpy would take in many passes, compiled."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, exact_kernel, kernel
from intent_tracking.scene.hand_kernel import HandArrays, HandBuffers, nearest_capsule
from intent_tracking.scene.object_kernel import ObjectArrays, object_distances
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE

NOBODY, OF_HAND, OF_ARM, OF_REST, OF_OBJECT = -1, -2, -3, -4, 0
"""Labels of pixels; active object k has label k >= 0."""
_FACTOR = np.float32(0.5 / 0.012**2)
"""A body's surface deviates by 12 mm from its prediction [1/m^2]."""
_FARTHEST = np.float32(4.5)
"""Most that the distance from its body speaks against a pixel, in log-odds: three deviations."""
_BACKGROUND = np.float32(0.5 * 2.5**2)
"""The same against the background: pixels within two and a half deviations are a body's."""
_RESTS = np.float32(3.0)
"""Log-odds of the background where the depth is that of an object at rest."""
_WRIST, _FOREARM = np.float32(-0.022), np.float32(-0.30)
"""Points with x between these in the wrist frame, near its axis, are the forearm's [m]."""
_ARM_MIDDLE, _ARM_RADIUS = np.float32(0.01), np.float32(0.07)
"""Height of that axis over the wrist and how far the forearm's points lie off it [m]."""


@exact_kernel
def pick_columns(
    depth: Floats,
    color: NDArray[np.uint8],
    columns: Indices,
    tile_depth: Floats,
    tile_color: NDArray[np.uint8],
) -> None:
    """Copy columns (S,) of rows of depth (S, W) and colour (S, W, 3) to a tile (S, S)."""
    for i in range(len(depth)):
        for j in range(len(columns)):
            tile_depth[i, j] = depth[i, columns[j]]
            for c in range(3):
                tile_color[i, j, c] = color[i, columns[j], c]


@exact_kernel
def bin_colors(
    color: NDArray[np.uint8],
    low: np.float32,
    scale: np.float32,
    chroma_bins: int,
    brightness_bins: int,
    bins: NDArray[np.int32],
) -> None:
    """Write the bin numbers (n,) of RGB values (n, 3), see `appearance`."""
    four, zero, last = np.float32(4.0), np.float32(0.0), np.float32(chroma_bins - 1)
    per_light = np.float32(brightness_bins / 780.0)
    brightest = np.float32(brightness_bins - 1)
    for n in range(len(color)):
        r, g, b = np.float32(color[n, 0]), np.float32(color[n, 1]), np.float32(color[n, 2])
        total = r + g + b + np.float32(12.0)  # dark pixels lean to grey
        red = np.int32(min(max(((r + four) / total - low) * scale, zero), last))
        green = np.int32(min(max(((g + four) / total - low) * scale, zero), last))
        light = np.int32(min(total * per_light, brightest))
        bins[n] = (red * np.int32(chroma_bins) + green) * np.int32(brightness_bins) + light


@borrowing_kernel
def candidates(
    depth: Floats,
    rest_depth: Floats,
    points: Floats,
    plane: Floats,
    clearance: np.float32,
    tolerance: np.float32,
    label: NDArray[np.int8],
    chosen: NDArray[np.int32],
) -> int:
    """Write the pixels that stand clear of the table; label the others.

    Args:
        depth: (P,) of the tile [m].
        rest_depth: (P,) of objects at rest [m].
        points: (3, P) of the tile [m].
        plane: (4,) table; its height is n . p + d.
        clearance: least height [m].
        tolerance: depth agreement of objects at rest [m].
        label: (P,) is written: `OF_REST` or `NOBODY`.
        chosen: (P,) receives the pixels' numbers.

    Returns:
        how many they are.
    """
    count = 0
    xs, ys, zs = points[0], points[1], points[2]
    for n in range(len(depth)):
        rests = abs(depth[n] - rest_depth[n]) < tolerance
        label[n] = OF_REST if rests else NOBODY
        height = plane[0] * xs[n] + plane[1] * ys[n] + plane[2] * zs[n] + plane[3]
        chosen[count] = n
        count += int(depth[n] > np.float32(0.0) and height > clearance)
    return count


@borrowing_kernel
def decide(
    near: Floats,
    gap: Floats,
    distances: Floats,
    log_table: Floats,
    bins: NDArray[np.int32],
    rows: Indices,
    state: Floats,
    rotation: Floats,
    reach: np.float32,
    chosen: NDArray[np.int32],
    label: NDArray[np.int8],
    hand_gap: Floats,
) -> None:
    """Label the chosen pixels (n,) by their score for background, hand and each object.

    Args:
        near: (3, n) points [m].
        gap: (n,) distance to the predicted hand [m].
        distances: (K, n) signed distance to each object [m].
        log_table: (classes, bins) log-probability of colours.
        bins: (P,) of all pixels.
        rows: (2 + K,) rows of background, hand and objects in the table.
        state: of the prediction; its first three values are the wrist's position.
        rotation: (3, 3) of the wrist.
        reach: farthest that a body's pixels lie from it [m].
        chosen: (n,) numbers of the pixels.
        label: (P,) is written.
        hand_gap: (P,) is written.
    """
    zero, r = np.float32(0.0), rotation
    for n in range(near.shape[1]):
        pixel = chosen[n]
        code, rests = bins[pixel], label[pixel] == OF_REST
        hand_gap[pixel] = gap[n]
        best = log_table[rows[0], code] - _BACKGROUND + (_RESTS if rests else zero)
        kind = NOBODY
        score = log_table[rows[1], code] - min(gap[n] * gap[n] * _FACTOR, _FARTHEST)
        if gap[n] <= reach and score > best:
            best, kind = score, OF_HAND
        for k in range(distances.shape[0]):
            d = distances[k, n]
            score = log_table[rows[2 + k], code] - min(d * d * _FACTOR, _FARTHEST)
            if abs(d) <= reach and score > best:
                best, kind = score, OF_OBJECT + k
        if kind < OF_OBJECT:
            x, y, z = near[0, n] - state[0], near[1, n] - state[1], near[2, n] - state[2]
            along = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
            if _FOREARM < along < _WRIST:
                y, z = (
                    r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
                    r[0, 2] * x + r[1, 2] * y + r[2, 2] * z - _ARM_MIDDLE,
                )
                if y * y + z * z < _ARM_RADIUS * _ARM_RADIUS:
                    kind = OF_ARM
        label[pixel] = OF_REST if rests and kind == NOBODY else kind


@kernel
def share_out(
    hand: HandArrays,
    buffers: HandBuffers,
    objects: ObjectArrays,
    state: Floats,
    rotations: Floats,
    rows: Indices,
    log_table: Floats,
    bins: NDArray[np.int32],
    depth: Floats,
    rest_depth: Floats,
    points: Floats,
    plane: Floats,
    limits: tuple[np.float32, np.float32, np.float32],
    label: NDArray[np.int8],
    hand_gap: Floats,
) -> None:
    """Write the body of every pixel of a tile, and its distance to the predicted hand.

    Args:
        hand: `HandArrays` of the prediction.
        buffers: the same posed.
        objects: `ObjectArrays` of K active objects.
        state: (26 + 6 K,) of the prediction.
        rotations: (1 + K, 3, 3).
        rows: (2 + K,) rows of background, hand and objects in the table of colours.
        log_table: (classes, bins) log-probability of colours.
        bins: (P,) colours of the tile.
        depth: (P,) [m].
        rest_depth: (P,) of objects at rest, large where there is none [m].
        points: (3, P) [m].
        plane: (4,) table; its height is n . p + d.
        limits: reach, clearance and tolerance of objects at rest [m], see `LabellingConfig`.
        label: (P,) is written.
        hand_gap: (P,) is written where it is known [m].
    """
    reach, clearance, tolerance = limits
    chosen = np.empty(len(depth) + 1, np.int32)
    count = candidates(depth, rest_depth, points, plane, clearance, tolerance, label, chosen)
    near = np.empty((3, count), np.float32)
    for axis in range(3):
        for n in range(count):
            near[axis, n] = points[axis, chosen[n]]
    gap, nearest = np.empty(count, np.float32), np.empty(count, np.float32)
    nearest_capsule(near, buffers.ends, hand.radii, gap, nearest)
    distances = np.empty((objects.surface.shape[0], count), np.float32)
    for k in range(objects.surface.shape[0]):
        o = HAND_SIZE + OBJECT_SIZE * k
        object_distances(
            objects, k, rotations[1 + k], state[o], state[o + 1], state[o + 2], near, reach,
            distances[k],
        )  # fmt: skip
    decide(
        near, gap, distances, log_table, bins, rows, state, rotations[0], reach, chosen, label,
        hand_gap,
    )  # fmt: skip
