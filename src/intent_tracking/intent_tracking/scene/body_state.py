"""Position, rotation and joints of hand and objects between frames, and their prediction."""

import math
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import exact_kernel
from intent_perception.geometry.transforms import (
    make_pose,
    rotation_from_vector,
    vector_from_pose,
    vector_from_rotation,
)
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE, body_start, state_size


@dataclass(frozen=True, eq=False)
class BodyState:
    """Hand and N objects in the camera's frame; rotations are kept as matrices."""

    values: Floats
    """(26 + 6 N,) as `SceneState.state`, but the six rotation entries are unused."""
    rotations: Floats
    """(1 + N, 3, 3)."""

    def copy(self) -> "BodyState":
        """Return an independent copy."""
        return BodyState(self.values.copy(), self.rotations.copy())

    def chosen(self, objects: list[int]) -> "BodyState":
        """Return the state of the hand and some of the objects."""
        parts = [self.values[:HAND_SIZE], *(self.values[_slice(k)] for k in objects)]
        rows = [0, *(1 + k for k in objects)]
        return BodyState(np.concatenate(parts), np.ascontiguousarray(self.rotations[rows]))

    def replaced(self, objects: list[int], part: "BodyState") -> "BodyState":
        """Return this state with hand and chosen objects taken from `part`."""
        new = self.copy()
        new.values[:HAND_SIZE], new.rotations[0] = part.values[:HAND_SIZE], part.rotations[0]
        for row, k in enumerate(objects):
            new.values[_slice(k)] = part.values[_slice(row)]
            new.rotations[1 + k] = part.rotations[1 + row]
        return new

    def with_object(self, k: int, pose: Array) -> "BodyState":
        """Return this state with object k at a pose (4, 4)."""
        new = self.copy()
        new.values[_slice(k)] = [*pose[:3, 3], 0.0, 0.0, 0.0]
        new.rotations[1 + k] = pose[:3, :3]
        return new

    def with_hand(self, pose: Array, joints: Array) -> "BodyState":
        """Return this state with the wrist at a pose (4, 4) and joints (20,)."""
        new = self.copy()
        new.values[:HAND_SIZE] = [*pose[:3, 3], 0.0, 0.0, 0.0, *joints]
        new.rotations[0] = pose[:3, :3]
        return new

    def pose(self, body: int) -> Array:
        """Return the pose (4, 4) of the hand (0) or of object body - 1."""
        offset = body_start(body)
        rotation = self.rotations[body].astype(np.float64)
        return make_pose(orthonormal(rotation), self.values[offset : offset + 3])

    def position(self, body: int) -> Array:
        """Return the position (3,) of the hand (0) or of object body - 1 [m]."""
        offset = body_start(body)
        return self.values[offset : offset + 3].astype(np.float64)

    def vector(self, T_table_camera: Array) -> Array:
        """Return the contract's 26 + 6 N values in the table's frame."""
        result = self.values.astype(np.float64)
        for body in range(len(self.rotations)):
            offset = body_start(body)
            result[offset : offset + 6] = vector_from_pose(T_table_camera @ self.pose(body))
        return result


def start_state(object_poses: list[Array]) -> BodyState:
    """Return a state with objects at poses (4, 4) in the camera's frame and the hand far away."""
    count = len(object_poses)
    values = np.zeros(state_size(count), np.float32)
    values[2] = 50.0  # no ray meets a hand there
    rotations = np.tile(np.eye(3, dtype=np.float32), (1 + count, 1, 1))
    state = BodyState(values, rotations)
    for k, pose in enumerate(object_poses):
        state = state.with_object(k, pose)
    return state


def predicted(before: BodyState, now: BodyState, damping: float) -> BodyState:
    """Return where damped constant velocity takes the bodies by the next frame."""
    new = now.copy()
    new.values[:] += np.float32(damping) * (now.values - before.values)
    for body in range(len(now.rotations)):
        if np.array_equal(now.rotations[body], before.rotations[body]):
            continue  # most objects rest
        turned = now.rotations[body].astype(np.float64) @ before.rotations[body].T
        step = rotation_from_vector(damping * vector_from_rotation(orthonormal(turned)))
        new.rotations[body] = orthonormal(step @ now.rotations[body])
    return new


def orthonormal(matrix: Array) -> Array:
    """Return the rotation (3, 3) next to a nearly orthonormal matrix."""
    rotation = np.empty((3, 3))
    _orthonormalise(np.ascontiguousarray(matrix, dtype=np.float64), rotation)
    return rotation


@exact_kernel
def _orthonormalise(matrix: Array, rotation: Array) -> None:
    """Write `orthonormal`; compiled, because for single matrices numpy takes long."""
    x0, x1, x2 = matrix[0, 0], matrix[1, 0], matrix[2, 0]
    length = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    x0, x1, x2 = x0 / length, x1 / length, x2 / length
    y0, y1, y2 = matrix[0, 1], matrix[1, 1], matrix[2, 1]
    z0, z1, z2 = x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0
    length = math.sqrt(z0 * z0 + z1 * z1 + z2 * z2)
    z0, z1, z2 = z0 / length, z1 / length, z2 / length
    rotation[0, 0], rotation[1, 0], rotation[2, 0] = x0, x1, x2
    rotation[0, 1] = z1 * x2 - z2 * x1
    rotation[1, 1] = z2 * x0 - z0 * x2
    rotation[2, 1] = z0 * x1 - z1 * x0
    rotation[0, 2], rotation[1, 2], rotation[2, 2] = z0, z1, z2


def _slice(k: int) -> slice:
    return slice(HAND_SIZE + OBJECT_SIZE * k, HAND_SIZE + OBJECT_SIZE * (k + 1))
