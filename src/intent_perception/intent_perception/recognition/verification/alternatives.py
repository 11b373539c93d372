"""Poses that look almost alike: a mug with its handle turned away, a tool end for end.

Refinement cannot cross from one to the other, and a hypothesis of either kind matches nearly all
its points. So a chosen pose is tried against its turns about the object's long axis and against
the half turns, each drawn and judged by what it newly explains.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.geometry.transforms import across, rotation_from_vector
from intent_perception.recognition.verification.explanation import draw, explain

Bytes = NDArray[np.uint8]

SPINS = 48
"""Steps of a whole turn: a handle in front of its mug is as wide as one and a half of them."""
_FLIPPED_SPINS = 12
_TURNED_POINTS = 150
_MOVED = 0.004  # distance from the surface that a camera sees [m]
_MOVED_SHARE = 0.03


def turns(axis: Array, spins: bool) -> Floats:
    """Return rotations (K, 3, 3) of the object frame to try, first those in steps of one turn.

    Args:
        axis: (3,) unit vector about which the object is turned in steps.
        spins: whether turns about it can be seen; if not, only the half turn across it is tried.
    """
    flip_axis = across(axis)
    found = []
    for flip, steps in ((0.0, SPINS), (np.pi, _FLIPPED_SPINS)):
        for k in range(steps if spins else 1):
            spin = rotation_from_vector(2.0 * np.pi * k / steps * axis)
            found.append(spin @ rotation_from_vector(flip * flip_axis))
    return np.array(found[1:], np.float32)


def turns_that_matter(
    points: Floats, normals: Floats, rotations: Floats, about: Floats
) -> NDArray[np.bool_]:
    """Return which turns (K,) move a part of the surface off the whole surface: not those of a can.

    Args:
        points: (P, 3) of the surface, those that spread widest first [m].
        normals: (P, 3).
        rotations: (K, 3, 3) turns about a point.
        about: (3,) that point.
    """
    tree = cKDTree(points)
    few = points[:_TURNED_POINTS] - about
    moved = np.einsum("kij,pj->kpi", rotations, few) + about
    nearest = tree.query(moved.reshape(-1, 3))[1]
    gaps = np.abs(np.sum((moved.reshape(-1, 3) - points[nearest]) * normals[nearest], axis=1))
    share: NDArray[np.float64] = np.mean(gaps.reshape(len(rotations), -1) > _MOVED, axis=1)
    return share > _MOVED_SHARE


def spin_axis(points: Floats, normals: Floats) -> tuple[Array, Array]:
    """Return the axis about which a surface is nearest to one of revolution: point, direction.

    The normals of a surface of revolution meet its axis. Of the three axes of the object frame the
    one is taken that most normals come near; a handle among them counts little.

    Args:
        points: (P, 3) of the surface [m].
        normals: (P, 3).
    """
    best, found = np.inf, (np.zeros(3), np.array([0.0, 0.0, 1.0]))
    for k in (2, 0, 1):
        a, b = [i for i in range(3) if i != k]
        side = np.hypot(normals[:, a], normals[:, b]) > 0.7
        if side.sum() < 20:
            continue
        # (x - p) x n = 0 in the plane across the axis
        lines = np.stack([normals[side, b], -normals[side, a]], axis=1).astype(np.float64)
        values = np.einsum("ij,ij->i", lines, points[side][:, [a, b]].astype(np.float64))
        weights = np.ones(len(values))
        center = np.zeros(2)
        for _ in range(20):
            weighted = lines * weights[:, None]
            center = np.linalg.solve(weighted.T @ lines + 1e-9 * np.eye(2), weighted.T @ values)
            weights = 1.0 / np.maximum(np.abs(lines @ center - values), 1e-4)
        miss = float(np.median(np.abs(lines @ center - values)))
        if miss < 0.7 * best:
            point, direction = np.zeros(3), np.zeros(3)
            point[[a, b]], direction[k] = center, 1.0
            best, found = miss, (point, direction)
    return found


@kernel
def turned(pose: Floats, turn: Floats, about: Floats) -> Floats:
    """Return a pose (12,) with the object turned by a rotation (3, 3) about one of its points."""
    result = pose.copy()
    for r in range(3):
        for c in range(3):
            value = np.float32(0.0)
            for k in range(3):
                value += pose[3 * r + k] * turn[k, c]
            result[3 * r + c] = value
            result[9 + r] += (pose[3 * r + c] - value) * about[c]
    return result


@kernel
def worth_of_turns(
    pose: Floats,
    rotations: Floats,
    about: Floats,
    vertices: Floats,
    faces: NDArray[np.int32],
    raw: Floats,
    smooth: Floats,
    scene_normals: Floats,
    mask: Bytes,
    intrinsics: Floats,
    tolerance: float,
    explained: Floats,
) -> Floats:
    """Return for each turn (K,) the evidence it adds to what is explained, less that against it."""
    height, width = raw.shape
    worth = np.zeros(len(rotations), np.float32)
    for k in range(len(rotations)):
        left, top, drawn = draw(
            turned(pose, rotations[k], about), vertices, faces, intrinsics, height, width
        )
        evidence, _ = explain(
            left, top, drawn, raw, smooth, scene_normals, mask, intrinsics, tolerance
        )
        worth[k] = worth_of(evidence, left, top, explained)
    return worth


@borrowing_kernel
def worth_of(evidence: Floats, left: int, top: int, explained: Floats) -> float:
    """Return what evidence (h, w) of one window adds to what is explained, less that against it."""
    total = 0.0
    for j in range(evidence.shape[0]):
        for i in range(evidence.shape[1]):
            value = evidence[j, i]
            if value < 0.0:
                total += value
            else:
                total += max(0.0, value - explained[top + j, left + i])
    return total
