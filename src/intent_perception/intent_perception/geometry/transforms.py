"""Rigid transforms (4, 4), rotations, rotation vectors and quaternions.

`T_a_b` takes coordinates of frame b to frame a: `points_a = transform_points(T_a_b, points_b)`.
Quaternions are (x, y, z, w) as in ROS messages. Lengths are in m, angles in rad.
"""

import numpy as np
from numpy.typing import ArrayLike

from intent_perception.basics.arrays import Array

_RIGID = 1e-3
"""Greatest deviation of R^T R from the identity: poses are stored with at least four digits."""
_FARTHEST = 100.0

_SMALL_ANGLE = 1e-8
_DEGENERATE = 1e-12


def rotation_from_vector(vector: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) of the rotation vectors (..., 3) [rad]."""
    vector = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    skew = _skew(vector)
    safe = np.where(angle < _SMALL_ANGLE, 1.0, angle)
    sine = np.where(angle < _SMALL_ANGLE, 1.0, np.sin(safe) / safe)
    cosine = np.where(angle < _SMALL_ANGLE, 0.5, (1.0 - np.cos(safe)) / safe**2)
    rotation: Array = np.eye(3) + sine * skew + cosine * (skew @ skew)
    return rotation


def vector_from_rotation(rotation: ArrayLike) -> Array:
    """Return the rotation vectors (..., 3) [rad], angle in [0, pi], of matrices (..., 3, 3)."""
    quaternion = quaternion_from_rotation(rotation)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, quaternion[..., 3])
    safe = np.where(sine < _SMALL_ANGLE, 1.0, sine)
    factor = np.where(sine < _SMALL_ANGLE, 2.0, angle / safe)
    vector: Array = quaternion[..., :3] * factor[..., None]
    return vector


def rotation_from_quaternion(quaternion: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) of the quaternions (..., 4) as x, y, z, w.

    Quaternions need not be of unit length.

    Raises:
        ValueError: if a quaternion is zero or not finite.
    """
    quaternion = np.asarray(quaternion, dtype=np.float64)
    norm = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if not np.all(np.isfinite(norm)) or np.any(norm < _DEGENERATE):
        raise ValueError(f"expected quaternions other than zero, got {quaternion}")
    x, y, z, w = np.moveaxis(quaternion / norm, -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_rotation(rotation: ArrayLike) -> Array:
    """Return the unit quaternions (..., 4) as x, y, z, w with w >= 0 of matrices (..., 3, 3)."""
    matrix = np.asarray(rotation, dtype=np.float64)
    xx, yy, zz = matrix[..., 0, 0], matrix[..., 1, 1], matrix[..., 2, 2]
    xy, yx = matrix[..., 0, 1], matrix[..., 1, 0]
    xz, zx = matrix[..., 0, 2], matrix[..., 2, 0]
    yz, zy = matrix[..., 1, 2], matrix[..., 2, 1]
    # Each row is the same quaternion times four times one of its components; the row of the
    # largest component is far from 0/0 (Shepperd's method).
    candidates = np.stack(
        [
            np.stack([1 + xx - yy - zz, xy + yx, xz + zx, zy - yz], axis=-1),
            np.stack([xy + yx, 1 - xx + yy - zz, yz + zy, xz - zx], axis=-1),
            np.stack([xz + zx, yz + zy, 1 - xx - yy + zz, yx - xy], axis=-1),
            np.stack([zy - yz, xz - zx, yx - xy, 1 + xx + yy + zz], axis=-1),
        ],
        axis=-2,
    )
    diagonal = np.einsum("...ii->...i", candidates)
    best = np.argmax(diagonal, axis=-1)[..., None, None]
    quaternion = np.take_along_axis(candidates, best, axis=-2)[..., 0, :]
    quaternion = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    positive: Array = np.where(quaternion[..., 3:] < 0.0, -quaternion, quaternion)
    return positive


def make_pose(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Return poses (..., 4, 4) from rotations (..., 3, 3) and translations (..., 3) [m]."""
    rotation = np.asarray(rotation, dtype=np.float64)
    translation = np.asarray(translation, dtype=np.float64)
    shape = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    pose = np.zeros((*shape, 4, 4))
    pose[..., :3, :3] = rotation
    pose[..., :3, 3] = translation
    pose[..., 3, 3] = 1.0
    return pose


def pose_from_vector(vector: ArrayLike) -> Array:
    """Return poses (..., 4, 4) from (..., 6): position [m], then rotation vector [rad]."""
    vector = np.asarray(vector, dtype=np.float64)
    return make_pose(rotation_from_vector(vector[..., 3:]), vector[..., :3])


def vector_from_pose(pose: ArrayLike) -> Array:
    """Return (..., 6), position [m] then rotation vector [rad], of poses (..., 4, 4)."""
    pose = np.asarray(pose, dtype=np.float64)
    return np.concatenate([pose[..., :3, 3], vector_from_rotation(pose[..., :3, :3])], axis=-1)


def inverse(pose: ArrayLike) -> Array:
    """Return the inverse of rigid transforms (..., 4, 4): T_b_a of T_a_b."""
    pose = np.asarray(pose, dtype=np.float64)
    transposed = np.swapaxes(pose[..., :3, :3], -1, -2)
    return make_pose(transposed, -np.einsum("...ij,...j->...i", transposed, pose[..., :3, 3]))


def transform_points(pose: ArrayLike, points: ArrayLike) -> Array:
    """Return points (..., 3) of frame b in frame a [m], given T_a_b (4, 4)."""
    pose = np.asarray(pose, dtype=np.float64)
    moved: Array = np.asarray(points, dtype=np.float64) @ pose[:3, :3].T + pose[:3, 3]
    return moved


def rotation_angle(rotation: ArrayLike) -> Array:
    """Return the angles (...) in [0, pi] [rad] of the rotation matrices (..., 3, 3)."""
    angle: Array = np.linalg.norm(vector_from_rotation(rotation), axis=-1)
    return angle


def rotation_between(start: ArrayLike, end: ArrayLike) -> Array:
    """Return the smallest rotation (3, 3) that takes the direction start (3,) to end (3,)."""
    a = np.asarray(start, dtype=np.float64) / np.linalg.norm(start)
    b = np.asarray(end, dtype=np.float64) / np.linalg.norm(end)
    axis = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(a @ b)
    if sine < _SMALL_ANGLE:
        if cosine > 0.0:
            return np.eye(3)
        axis = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        sine = float(np.linalg.norm(axis))
        return rotation_from_vector(axis / sine * np.pi)
    return rotation_from_vector(axis / sine * np.arctan2(sine, cosine))


def look_at(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Return T_table_camera (4, 4) of an optical frame (z forward, x right, y down).

    Args:
        eye: (3,) position of the camera in the table frame [m].
        target: (3,) point that the optical axis passes through [m].
        up: (3,) direction that is upwards in the image.

    Raises:
        ValueError: if eye and target coincide or up is parallel to the line of sight.
    """
    position = np.asarray(eye, dtype=np.float64)
    forward = np.asarray(target, dtype=np.float64) - position
    right = np.cross(forward, np.asarray(up, dtype=np.float64))
    length = float(np.linalg.norm(right))
    if length < _DEGENERATE:
        raise ValueError("expected a line of sight that is not parallel to up")
    forward = forward / np.linalg.norm(forward)
    right = right / length
    return make_pose(np.stack([right, np.cross(forward, right), forward], axis=1), position)


def require_pose(pose: ArrayLike, what: str) -> Array:
    """Return a pose (4, 4), or (N, 4, 4), if each is a rigid motion within reach of a table.

    Raises:
        ValueError: if one is of another shape, holds NaN or infinity, scales, mirrors or shears, or
            lies farther away than 100 m.
    """
    poses = np.asarray(pose, dtype=np.float64)
    if poses.ndim < 2 or poses.shape[-2:] != (4, 4):
        raise ValueError(f"expected {what} as a pose 4 x 4, got {poses.shape}")
    if not np.all(np.isfinite(poses)):
        raise ValueError(f"expected {what} as a pose, got NaN or infinity in it")
    rotations, row = poses[..., :3, :3], poses[..., 3, :]
    with np.errstate(all="ignore"):
        off = np.abs(np.swapaxes(rotations, -1, -2) @ rotations - np.eye(3))
        rigid = np.all(off < _RIGID) and np.all(np.linalg.det(rotations) > 0.0)
    if not rigid or np.any(np.abs(row - [0.0, 0.0, 0.0, 1.0]) > _RIGID):
        raise ValueError(f"expected {what} as a pose, it is no rotation and shift in metres")
    if np.any(np.abs(poses[..., :3, 3]) > _FARTHEST):
        raise ValueError(f"expected {what} within {_FARTHEST:g} m (is it in millimetres?)")
    return poses


def _skew(vector: Array) -> Array:
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = ((zero, -z, y), (z, zero, -x), (-y, x, zero))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
