"""Whether each object rests, is handled or is lost: objects at rest cost nothing."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    make_pose,
    rotation_angle,
    rotation_from_vector,
    vector_from_rotation,
)
from intent_tracking.scene.hand_kernel import HandBuffers
from intent_tracking.scene.object_kernel import ObjectArrays, object_distances
from intent_tracking.scene.raster import FAR

_GRIP_RATE = 0.1  # share by which the remembered grasp follows the present one in a frame


@dataclass(frozen=True, eq=False)
class ObjectLifeConfig(Checked):
    """When an object takes part in the fit, and how tightly."""

    near: float = 0.045
    """A hand closer than this wakes an object at rest [m], 0..0.5."""
    far: float = 0.08
    """A hand farther than this lets a still object fall back to rest [m], 0..1."""
    moved: float = 0.007
    """Displacement from which an object counts as taken [m], 0..0.5."""
    turned: float = 0.12
    """Turn from which an object counts as taken [rad], 0..3.1."""
    still: float = 0.0015
    """Motion per frame below which an object counts as still [m], 0..0.1."""
    still_frames: int = 6
    """Frames that an object must be still, and the hand far, before it is at rest, 0..1000."""
    touch: float = 0.012
    """A hand closer than this to a taken object carries it [m], 0..0.2."""
    rest_place: float = 40.0
    """Weight of the resting place while nothing has moved, in observed points, 0.001..10000."""
    rest_turn: float = 0.06
    """Weight of the resting rotation [m^2 / rad^2], 1e-5..100."""
    free_place: float = 1.0
    """Weight of the predicted place once it has been moved and nobody holds it, in observed points,
    0.001..10000."""
    free_turn: float = 4e-3
    """Weight of the predicted rotation then [m^2 / rad^2], 1e-5..100."""
    carried_place: float = 15.0
    """Weight of the place that the hand carries the object to, in observed points, 0.001..10000."""
    carried_turn: float = 0.02
    """Weight of the rotation that the hand carries it to [m^2 / rad^2], 1e-5..100."""
    unseen_frames: int = 15
    """Frames in which an object that should be seen is not, until it is lost, 0..1000."""


@dataclass
class ObjectLife:
    """One object's part in the scene; changes from frame to frame."""

    rest: Array
    """(4, 4) where it rested last, in the camera's frame."""
    active: bool = False
    """Takes part in the fit."""
    taken: bool = False
    """Has left its resting place."""
    carried: bool = False
    """Moves with the hand."""
    still: int = 0
    """Frames without motion."""
    gap: float = 1.0
    """Distance to the hand in the last frame [m]."""
    unseen: int = 0
    """Frames without support in the image."""
    grip: Array | None = None
    """(4, 4) T_hand_object of the grasp, averaged over frames; None while it is not carried."""

    def update(self, gap: float, before: Array, now: Array, config: ObjectLifeConfig) -> None:
        """Take note of a frame.

        Args:
            gap: distance of the hand to the object, large without a hand [m].
            before: (4, 4) pose in the frame before.
            now: (4, 4) present pose.
            config: thresholds.
        """
        self.gap = gap
        offset = float(np.linalg.norm(now[:3, 3] - self.rest[:3, 3]))
        angle = float(rotation_angle(self.rest[:3, :3].T @ now[:3, :3]))
        if offset > config.moved or angle > config.turned:
            self.taken = True
        self.carried = self.taken and gap < config.touch
        speed = float(np.linalg.norm(now[:3, 3] - before[:3, 3]))
        self.still = self.still + 1 if speed < config.still else 0
        if gap > config.far and self.still >= config.still_frames:
            self.active = self.taken = False
            self.rest = now
        elif gap < config.near or self.taken:
            self.active = True
        else:
            self.active = self.active and gap < config.far

    def hold(self, T_hand_object: Array, seen: bool) -> None:
        """Take note of where the object lies in the hand, if it is carried.

        Args:
            T_hand_object: (4, 4) present pose in the hand.
            seen: whether enough of the object is seen to trust that pose.
        """
        if not self.carried:
            self.grip = None
        elif self.grip is None:
            self.grip = T_hand_object
        elif seen:
            turned = vector_from_rotation(self.grip[:3, :3].T @ T_hand_object[:3, :3])
            rotation = self.grip[:3, :3] @ rotation_from_vector(_GRIP_RATE * turned)
            step = _GRIP_RATE * (T_hand_object[:3, 3] - self.grip[:3, 3])
            self.grip = make_pose(rotation, self.grip[:3, 3] + step)

    def ties(self, config: ObjectLifeConfig) -> tuple[float, float, float]:
        """Return (touch, place, turn) of `Prior` for the next fit."""
        if self.carried:
            return 1.0, config.carried_place, config.carried_turn
        if self.taken:
            return 1.0, config.free_place, config.free_turn
        return 0.0, config.rest_place, config.rest_turn


def hand_gap(buffers: HandBuffers, radii: Floats, objects: ObjectArrays, pose: Array) -> float:
    """Return the distance [m] of a posed hand to the single packed object at a pose (4, 4)."""
    middle = buffers.ends.mean(axis=1)
    points = np.concatenate([buffers.ends[:, 0], middle, buffers.ends[:, 1]])
    distance = np.empty(len(points), np.float32)
    rotation = np.ascontiguousarray(pose[:3, :3], dtype=np.float32)
    origin = pose[:3, 3].astype(np.float32)
    columns = np.ascontiguousarray(points.T)
    object_distances(objects, 0, rotation, *origin, columns, FAR, distance)
    return float((distance - np.tile(radii, 3)).min())
