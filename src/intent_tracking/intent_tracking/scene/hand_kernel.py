"""The human hand for compiled code: the joint table as float32 arrays and its kinematics."""

import math
from typing import NamedTuple

import numpy as np

from intent_perception.basics.arrays import Array, Floats, Indices
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.geometry.transforms import rotation_between
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.state_layout import CAPSULES, FINGER_CAPSULES, JOINTS

LANDMARKS = 21


class HandArrays(NamedTuple):
    """A `JointTable` of the human hand; every joint turns about the z axis of its frame."""

    rotations: Floats
    """(5, 4, 3, 3) joint frame in the frame before it at angle zero."""
    translations: Floats
    """(5, 4, 3) its origin [m]."""
    ends: Floats
    """(24, 2, 3) capsule ends in their link's frame [m]: 15 of the fingers, 9 of the palm."""
    radii: Floats
    """(24,) [m]."""
    tips: Floats
    """(5, 3) fingertips in the last link's frame [m]."""


class HandBuffers(NamedTuple):
    """A posed hand in the camera's frame, written by `place_hand`."""

    ends: Floats
    """(24, 2, 3) capsule ends [m]."""
    axes: Floats
    """(20, 3) joint axes."""
    pivots: Floats
    """(20, 3) joint centres [m]."""
    landmarks: Floats
    """(21, 3) in the order of the contract [m]."""


def hand_arrays(model: HandModel) -> HandArrays:
    """Return the hand's joint table for compiled code."""
    table = model.table
    to_z = [np.eye(3)]
    for axis in table.axes[1:]:
        to_z.append(rotation_between([0.0, 0.0, 1.0], axis))
    rotations, translations = np.empty((5, 4, 3, 3)), np.empty((5, 4, 3))
    for link in range(1, 21):
        before = to_z[table.parents[link]].T
        finger, level = divmod(link - 1, 4)
        rotations[finger, level] = before @ table.origins[link, :3, :3] @ to_z[link]
        translations[finger, level] = before @ table.origins[link, :3, 3]
    turned = np.stack([to_z[link] for link in table.capsules.links])
    ends = np.einsum("cji,cej->cei", turned, table.capsules.ends)
    tips = [to_z[4 * f + 4].T @ table.landmark_offsets[4 * f + 4] for f in range(5)]
    return HandArrays(
        rotations.astype(np.float32),
        translations.astype(np.float32),
        np.ascontiguousarray(ends, dtype=np.float32),
        table.capsules.radii.astype(np.float32),
        np.array(tips, dtype=np.float32),
    )


def hand_buffers() -> HandBuffers:
    """Return buffers for one posed hand."""
    return HandBuffers(
        np.zeros((CAPSULES, 2, 3), np.float32),
        np.zeros((JOINTS, 3), np.float32),
        np.zeros((JOINTS, 3), np.float32),
        np.zeros((LANDMARKS, 3), np.float32),
    )


@kernel
def new_hand_buffers() -> HandBuffers:
    """Return `HandBuffers` inside compiled code."""
    return HandBuffers(
        np.zeros((CAPSULES, 2, 3), np.float32),
        np.zeros((JOINTS, 3), np.float32),
        np.zeros((JOINTS, 3), np.float32),
        np.zeros((21, 3), np.float32),
    )


@borrowing_kernel
def turn(wx: np.float32, wy: np.float32, wz: np.float32, rotation: Floats, out: Floats) -> None:
    """Write exp([w]) @ rotation for a rotation vector w [rad] into out (3, 3)."""
    square = wx * wx + wy * wy + wz * wz
    if square < np.float32(1e-8):
        a, b = np.float32(1.0), np.float32(0.5)
    else:
        angle = math.sqrt(square)
        a = np.float32(math.sin(angle) / angle)
        b = np.float32((np.float32(1.0) - math.cos(angle)) / square)
    one = np.float32(1.0)
    e00, e01, e02 = one - b * (wy * wy + wz * wz), b * wx * wy - a * wz, b * wx * wz + a * wy
    e10, e11, e12 = b * wx * wy + a * wz, one - b * (wx * wx + wz * wz), b * wy * wz - a * wx
    e20, e21, e22 = b * wx * wz - a * wy, b * wy * wz + a * wx, one - b * (wx * wx + wy * wy)
    for j in range(3):
        r0, r1, r2 = rotation[0, j], rotation[1, j], rotation[2, j]
        out[0, j] = e00 * r0 + e01 * r1 + e02 * r2
        out[1, j] = e10 * r0 + e11 * r1 + e12 * r2
        out[2, j] = e20 * r0 + e21 * r1 + e22 * r2


@borrowing_kernel
def place_finger(
    hand: HandArrays, state: Floats, rotation: Floats, f: int, out: HandBuffers
) -> None:
    """Pose finger f alone, as `place_hand` poses all of the hand."""
    x0, x1, x2 = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    y0, y1, y2 = rotation[0, 1], rotation[1, 1], rotation[2, 1]
    z0, z1, z2 = rotation[0, 2], rotation[1, 2], rotation[2, 2]
    q0, q1, q2 = state[0], state[1], state[2]
    for k in range(4):
        t = hand.translations[f, k]
        q0 += x0 * t[0] + y0 * t[1] + z0 * t[2]
        q1 += x1 * t[0] + y1 * t[1] + z1 * t[2]
        q2 += x2 * t[0] + y2 * t[1] + z2 * t[2]
        m = hand.rotations[f, k]
        a0 = x0 * m[0, 0] + y0 * m[1, 0] + z0 * m[2, 0]
        a1 = x1 * m[0, 0] + y1 * m[1, 0] + z1 * m[2, 0]
        a2 = x2 * m[0, 0] + y2 * m[1, 0] + z2 * m[2, 0]
        b0 = x0 * m[0, 1] + y0 * m[1, 1] + z0 * m[2, 1]
        b1 = x1 * m[0, 1] + y1 * m[1, 1] + z1 * m[2, 1]
        b2 = x2 * m[0, 1] + y2 * m[1, 1] + z2 * m[2, 1]
        z0, z1, z2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        n = 4 * f + k
        c, s = math.cos(state[6 + n]), math.sin(state[6 + n])
        x0, x1, x2 = c * a0 + s * b0, c * a1 + s * b1, c * a2 + s * b2
        y0, y1, y2 = c * b0 - s * a0, c * b1 - s * a1, c * b2 - s * a2
        out.axes[n, 0], out.axes[n, 1], out.axes[n, 2] = z0, z1, z2
        out.pivots[n, 0], out.pivots[n, 1], out.pivots[n, 2] = q0, q1, q2
        if k == 0:
            continue
        out.landmarks[n, 0], out.landmarks[n, 1], out.landmarks[n, 2] = q0, q1, q2
        i = 3 * f + k - 1
        for e in range(2):
            u, v, w = hand.ends[i, e, 0], hand.ends[i, e, 1], hand.ends[i, e, 2]
            out.ends[i, e, 0] = x0 * u + y0 * v + z0 * w + q0
            out.ends[i, e, 1] = x1 * u + y1 * v + z1 * w + q1
            out.ends[i, e, 2] = x2 * u + y2 * v + z2 * w + q2
    u, v, w = hand.tips[f, 0], hand.tips[f, 1], hand.tips[f, 2]
    out.landmarks[4 * f + 4, 0] = x0 * u + y0 * v + z0 * w + q0
    out.landmarks[4 * f + 4, 1] = x1 * u + y1 * v + z1 * w + q1
    out.landmarks[4 * f + 4, 2] = x2 * u + y2 * v + z2 * w + q2


@borrowing_kernel
def place_hand(hand: HandArrays, state: Floats, rotation: Floats, out: HandBuffers) -> None:
    """Pose the hand: `HandArrays`, state (26+,), wrist rotation (3, 3) -> `HandBuffers`.

    state[3:6] is not read: the rotation is given as a matrix.
    """
    for j in range(3):
        out.landmarks[0, j] = state[j]
    for i in range(FINGER_CAPSULES, CAPSULES):
        for e in range(2):
            x, y, z = hand.ends[i, e, 0], hand.ends[i, e, 1], hand.ends[i, e, 2]
            for j in range(3):
                out.ends[i, e, j] = (
                    rotation[j, 0] * x + rotation[j, 1] * y + rotation[j, 2] * z + state[j]
                )
    for f in range(5):
        place_finger(hand, state, rotation, f, out)


def posed_landmarks(hand: HandArrays, joints: Array) -> Array:
    """Return the 21 landmarks (B, 21, 3) in `hand_wrist` [m] of postures (B, 20) [rad]."""
    buffers, upright = hand_buffers(), np.eye(3, dtype=np.float32)
    landmarks = np.empty((len(joints), LANDMARKS, 3))
    for posture, points in zip(joints, landmarks, strict=True):
        state = np.concatenate([np.zeros(6), posture]).astype(np.float32)
        place_hand(hand, state, upright, buffers)
        points[:] = buffers.landmarks
    return landmarks


@borrowing_kernel
def nearest_capsule(
    points: Floats, ends: Floats, radii: Floats, distance: Floats, nearest: Indices
) -> None:
    """Write the unsigned distance to the nearest capsule surface and its index.

    points (3, N) [m], ends (C, 2, 3), radii (C,); distance and nearest (N,) float32 are written.
    """
    xs, ys, zs = points[0], points[1], points[2]
    for n in range(points.shape[1]):
        distance[n] = np.float32(1e3)
        nearest[n] = np.float32(0.0)
    for i in range(ends.shape[0]):
        ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
        bx, by, bz = ends[i, 1, 0] - ax, ends[i, 1, 1] - ay, ends[i, 1, 2] - az
        inverse = np.float32(1.0) / (bx * bx + by * by + bz * bz)
        radius, index = radii[i], np.float32(i)
        for n in range(points.shape[1]):
            x, y, z = xs[n] - ax, ys[n] - ay, zs[n] - az
            t = (x * bx + y * by + z * bz) * inverse
            t = min(max(t, np.float32(0.0)), np.float32(1.0))
            x -= t * bx
            y -= t * by
            z -= t * bz
            d = abs(math.sqrt(x * x + y * y + z * z) - radius)
            closer = d < distance[n]
            nearest[n] = index if closer else nearest[n]
            distance[n] = d if closer else distance[n]
