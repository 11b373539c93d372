"""Normal equations of one frame in the hand's pose and its shape together, compiled.

The residuals are those of the refinement that look at the hand: observed points against the nearest
capsule, model samples against silhouette and depth (see `normal_equations`). Posed capsule ends are
affine in the 22 numbers of a hand shape, so their derivatives are posed hands themselves: those of
the difference that one number makes to the joint table, with the wrist at the origin.
"""

import math
from typing import NamedTuple

import numpy as np

from intent_perception.basics.arrays import Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_tracking.fit.normal_equations import image_residual
from intent_tracking.fit.wrenches import hand_row
from intent_tracking.image.frame_evidence import FrameEvidence, Weights
from intent_tracking.scene.hand_kernel import (
    HandArrays,
    HandBuffers,
    nearest_capsule,
    new_hand_buffers,
    place_hand,
)
from intent_tracking.scene.state_layout import CAPSULES, HAND_SIZE, JOINTS


class ShapeDirections(NamedTuple):
    """What each of the 22 numbers of a hand shape adds to `HandArrays`, per unit."""

    translations: Floats
    """(22, 5, 4, 3) [m]."""
    ends: Floats
    """(22, 24, 2, 3) [m]."""
    radii: Floats
    """(22, 24) [m]."""
    tips: Floats
    """(22, 5, 3) [m]."""


@borrowing_kernel
def add_dense(
    matrix: Floats, vector: Floats, full: Floats, e: np.float32, weight: np.float32
) -> None:
    """Add weight full full^T (lower triangle) and -weight full e of one row (48,)."""
    for p in range(full.shape[0]):
        w = weight * full[p]
        if w != np.float32(0.0):
            vector[p] -= w * e
            for q in range(p + 1):
                matrix[p, q] += w * full[q]


@borrowing_kernel
def fill_row(
    buffers: HandBuffers,
    state: Floats,
    slopes: Floats,
    i: int,
    t: np.float32,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    gx: np.float32,
    gy: np.float32,
    gz: np.float32,
    row: Floats,
    index: Indices,
    full: Floats,
) -> None:
    """Write d(g . c) / d(pose, shape) into full (48,) for the point c at share t of capsule i.

    slopes (22, 24, 2, 3): derivative of the posed capsule ends by each number of the shape.
    """
    full[:] = np.float32(0.0)
    count = hand_row(buffers, state, i, x, y, z, gx, gy, gz, row, index)
    for p in range(count):
        full[index[p]] = row[p]
    for k in range(slopes.shape[0]):
        a, b = slopes[k, i, 0], slopes[k, i, 1]
        full[HAND_SIZE + k] = (
            gx * (a[0] + t * (b[0] - a[0]))
            + gy * (a[1] + t * (b[1] - a[1]))
            + gz * (a[2] + t * (b[2] - a[2]))
        )


@kernel
def add_points(
    hand: HandArrays,
    buffers: HandBuffers,
    slopes: Floats,
    thicker: Floats,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    matrix: Floats,
    vector: Floats,
    full: Floats,
) -> None:
    """Add observed points against the nearest capsule, those on sides that the camera sees."""
    points = evidence.hand_points
    work = np.empty((2, max(points.shape[1], 1)), np.float32)
    row, index = np.empty(JOINTS, np.float32), np.empty(JOINTS, np.int64)
    square, one, zero = weights.scale * weights.scale, np.float32(1.0), np.float32(0.0)
    nearest_capsule(points, buffers.ends, hand.radii, work[0], work[1])
    for n in range(points.shape[1]):
        i = int(work[1, n])
        a, b = buffers.ends[i, 0], buffers.ends[i, 1]
        px, py, pz = points[0, n], points[1, n], points[2, n]
        bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        t = ((px - a[0]) * bx + (py - a[1]) * by + (pz - a[2]) * bz) / (bx * bx + by * by + bz * bz)
        t = min(max(t, zero), one)
        cx, cy, cz = a[0] + t * bx, a[1] + t * by, a[2] + t * bz
        x, y, z = px - cx, py - cy, pz - cz
        d = math.sqrt(x * x + y * y + z * z) + np.float32(1e-9)
        x, y, z = x / d, y / d, z / d
        if x * px + y * py + z * pz <= np.float32(0.3) * pz:
            e = d - hand.radii[i]
            q = one + e * e / square
            fill_row(buffers, state, slopes, i, t, cx, cy, cz, -x, -y, -z, row, index, full)
            for k in range(22):
                full[HAND_SIZE + k] -= thicker[k, i]
            add_dense(matrix, vector, full, e, one / (q * q))


@kernel
def add_samples(
    hand: HandArrays,
    buffers: HandBuffers,
    slopes: Floats,
    thicker: Floats,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    matrix: Floats,
    vector: Floats,
    full: Floats,
) -> None:
    """Add silhouette and depth order of three samples per capsule."""
    row, index = np.empty(JOINTS, np.float32), np.empty(JOINTS, np.int64)
    g = np.empty(3, np.float32)
    wide = np.float32(4.0) * weights.scale * weights.scale
    for i in range(CAPSULES):
        for s in range(3):
            t = np.float32(s) * np.float32(0.5)
            a, b = buffers.ends[i, 0], buffers.ends[i, 1]
            x, y = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])
            z, radius = a[2] + t * (b[2] - a[2]), hand.radii[i]
            e, w = image_residual(evidence, weights, x, y, z, radius, g)
            if w > np.float32(0.0):
                q = np.float32(1.0) + e * e / wide
                fill_row(buffers, state, slopes, i, t, x, y, z, g[0], g[1], g[2], row, index, full)
                if g[2] < np.float32(0.0):  # the surface, not the axis, stands in front
                    for k in range(22):
                        full[HAND_SIZE + k] += thicker[k, i]
                add_dense(matrix, vector, full, e, w / (q * q))


@kernel
def shape_equations(
    hand: HandArrays,
    directions: ShapeDirections,
    evidence: FrameEvidence,
    weights: Weights,
    state: Floats,
    rotation: Floats,
    matrix: Floats,
    vector: Floats,
) -> None:
    """Write the normal matrix (48, 48) (lower triangle) and -half the gradient (48,) of a frame.

    Args:
        hand: `HandArrays` of the present shape.
        directions: `ShapeDirections`.
        evidence: `FrameEvidence`.
        weights: `Weights`.
        state: (26,) hand.
        rotation: (3, 3) of the wrist.
        matrix: receives the result in the order pose (26), shape (22).
        vector: likewise.
    """
    matrix[:, :] = np.float32(0.0)
    vector[:] = np.float32(0.0)
    buffers, moved = new_hand_buffers(), new_hand_buffers()
    local = state.copy()
    local[:3] = np.float32(0.0)
    slopes = np.empty((22, CAPSULES, 2, 3), np.float32)
    for k in range(22):
        change = HandArrays(
            hand.rotations, directions.translations[k], directions.ends[k], directions.radii[k],
            directions.tips[k],
        )  # fmt: skip
        place_hand(change, local, rotation, moved)
        slopes[k] = moved.ends
    place_hand(hand, state, rotation, buffers)
    full, thicker = np.empty(48, np.float32), directions.radii
    add_points(hand, buffers, slopes, thicker, evidence, weights, state, matrix, vector, full)
    add_samples(hand, buffers, slopes, thicker, evidence, weights, state, matrix, vector, full)
