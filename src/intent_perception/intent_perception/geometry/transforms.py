"""Rigid transforms (4, 4), rotations, rotation vectors and quaternions.

`T_a_b` takes coordinates of frame b to frame a: `points_a = transform_points(T_a_b, points_b)`.
Quaternions are (x, y, z, w) as in ROS messages. Lengths are in m, angles in rad.
"""

import numpy as np
from numpy.typing import ArrayLike

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import exact_kernel

_RIGID = 1e-3
"""Greatest deviation of R^T R from the identity: poses are stored with at least four digits."""
_FARTHEST = 100.0

_SMALL_ANGLE = 1e-8
_DEGENERATE = 1e-12


def rotation_from_vector(vector: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) of the rotation vectors (..., 3) [rad]."""
    vector = np.asarray(vector, dtype=np.float64)
    rotations = np.empty((vector.size // 3, 3, 3))
    _rotations(np.ascontiguousarray(vector).reshape(-1, 3), rotations)
    return rotations.reshape(*vector.shape[:-1], 3, 3)


@exact_kernel
def _rotations(vectors: Array, rotations: Array) -> None:
    """Write Rodrigues' formula; compiled, because for single vectors numpy takes long."""
    for k in range(len(vectors)):
        x, y, z = vectors[k, 0], vectors[k, 1], vectors[k, 2]
        squared = x * x + y * y + z * z
        angle = np.sqrt(squared)
        sine, cosine = 1.0, 0.5
        if angle >= _SMALL_ANGLE:
            sine, cosine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / squared
        rotations[k, 0, 0] = 1.0 - cosine * (y * y + z * z)
        rotations[k, 1, 1] = 1.0 - cosine * (x * x + z * z)
        rotations[k, 2, 2] = 1.0 - cosine * (x * x + y * y)
        rotations[k, 0, 1] = cosine * x * y - sine * z
        rotations[k, 1, 0] = cosine * x * y + sine * z
        rotations[k, 0, 2] = cosine * x * z + sine * y
        rotations[k, 2, 0] = cosine * x * z - sine * y
        rotations[k, 1, 2] = cosine * y * z - sine * x
        rotations[k, 2, 1] = cosine * y * z + sine * x


def vector_from_rotation(rotation: ArrayLike) -> Array:
    """Return the rotation vectors (..., 3) [rad], angle in [0, pi], of matrices (..., 3, 3)."""
    quaternions = quaternion_from_rotation(rotation)
    vectors = np.empty((quaternions.size // 4, 3))
    _vectors(quaternions.reshape(-1, 4), vectors)
    return vectors.reshape(*quaternions.shape[:-1], 3)


@exact_kernel
def _vectors(quaternions: Array, vectors: Array) -> None:
    for k in range(len(quaternions)):
        x, y, z, w = quaternions[k]
        sine = np.sqrt(x * x + y * y + z * z)
        factor = 2.0 if sine < _SMALL_ANGLE else 2.0 * np.arctan2(sine, w) / sine
        vectors[k, 0], vectors[k, 1], vectors[k, 2] = factor * x, factor * y, factor * z


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
    quaternions = np.empty((matrix.size // 9, 4))
    _quaternions(np.ascontiguousarray(matrix).reshape(-1, 3, 3), quaternions)
    return quaternions.reshape(*matrix.shape[:-2], 4)


@exact_kernel
def _quaternions(matrices: Array, quaternions: Array) -> None:
    """Write each quaternion by the row of its largest component, far from 0/0 (Shepperd)."""
    for k in range(len(matrices)):
        m, q = matrices[k], quaternions[k]
        xx, yy, zz = m[0, 0], m[1, 1], m[2, 2]
        squares = (1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz)
        best = 0
        for i in range(1, 4):
            if squares[i] > squares[best]:
                best = i
        xy, xz, yz = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
        wx, wy, wz = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
        if best == 0:
            q[0], q[1], q[2], q[3] = squares[0], xy, xz, wx
        elif best == 1:
            q[0], q[1], q[2], q[3] = xy, squares[1], yz, wy
        elif best == 2:
            q[0], q[1], q[2], q[3] = xz, yz, squares[2], wz
        else:
            q[0], q[1], q[2], q[3] = wx, wy, wz, squares[3]
        length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        if q[3] < 0.0:
            length = -length
        for i in range(4):
            q[i] /= length


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


def across(direction: Array) -> Array:
    """Return a unit vector (3,) across a direction (3,)."""
    found = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    return np.asarray(found / np.linalg.norm(found))


def rotation_between(start: ArrayLike, end: ArrayLike) -> Array:
    """Return the smallest rotation (3, 3) that takes the direction start (3,) to end (3,)."""
    a = np.asarray(start, dtype=np.float64) / np.linalg.norm(start)
    b = np.asarray(end, dtype=np.float64) / np.linalg.norm(end)
    axis = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(a @ b)
    if sine < _SMALL_ANGLE:
        if cosine > 0.0:
            return np.eye(3)
        return rotation_from_vector(across(a) * np.pi)
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
