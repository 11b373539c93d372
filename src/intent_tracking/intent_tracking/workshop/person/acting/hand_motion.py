"""A motion of one hand and the objects it carries, frame by frame, built from short moves."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    rotation_from_vector,
    vector_from_rotation,
)


@dataclass(frozen=True, eq=False)
class HandMotion:
    """F frames in the table frame, of a right hand."""

    hands: Array
    """(F, 4, 4) T_table_hand."""
    angles: Array
    """(F, 20) joint angles [rad]."""
    objects: Array
    """(F, N, 4, 4) T_table_object."""


def mirrored(poses: Array) -> Array:
    """Return poses (..., 4, 4) seen in a mirror that swaps the table's x and each body's own y.

    That is how a right-handed motion becomes a left-handed one: the left hand is the mirror image
    of the right one in its own frame, and so is every object that is symmetric about y = 0.
    """
    table, body = np.diag([-1.0, 1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0, 1.0])
    image: Array = table @ poses @ body
    return image


def between(start: Array, end: Array, share: Array) -> Array:
    """Return poses (K, 4, 4) on the way from one pose to another, (K,) shares in 0..1."""
    turn = vector_from_rotation(start[:3, :3].T @ end[:3, :3])
    rotations = start[:3, :3] @ rotation_from_vector(share[:, None] * turn)
    return make_pose(rotations, start[:3, 3] + share[:, None] * (end[:3, 3] - start[:3, 3]))


def minimum_jerk(frames: int) -> Array:
    """Return (frames,) shares of a move that starts and ends at rest; the last one is 1."""
    t = np.arange(1, frames + 1) / frames
    share: Array = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    return share


class Choreography:
    """Appends moves to a motion; every move begins where the last one ended."""

    def __init__(
        self, hand: Array, angles: Array, objects: Array, rng: np.random.Generator
    ) -> None:
        self._hands, self._angles, self._objects = [hand], [angles], [objects]
        self._free = [True]
        self._rng = rng

    @property
    def frame(self) -> int:
        """Number of the last frame."""
        return len(self._hands) - 1

    @property
    def hand(self) -> Array:
        """(4, 4) where the hand is now."""
        return self._hands[-1]

    @property
    def objects(self) -> Array:
        """(N, 4, 4) where the objects are now."""
        return self._objects[-1]

    def hands_since(self, first: int) -> Array:
        """Return the hand poses (K, 4, 4) from frame `first` on."""
        return np.array(self._hands[first:])

    def wait(self, frames: int) -> None:
        """Stay for some frames."""
        self.move(frames, self.hand, self._angles[-1])

    def move(self, frames: int, hand: Array, angles: Array, rise: float = 0.0) -> None:
        """Move the empty hand to a pose and posture, on an arch that is `rise` [m] higher."""
        shares = minimum_jerk(frames)
        poses = between(self.hand, hand, shares)
        poses[:, 2, 3] += rise * np.sin(np.pi * shares) ** 2
        bend = self._angles[-1] + shares[:, None] * (angles - self._angles[-1])
        self._append(poses, bend, np.tile(self.objects, (frames, 1, 1, 1)), free=True)

    def swing(self, frames: int, over: Array, hand: Array, angles: Array) -> None:
        """Move the empty hand to a pose along a curve that bends towards the point `over` (3,)."""
        share = minimum_jerk(frames)[:, None]
        poses = between(self.hand, hand, share[:, 0])
        start, end = self.hand[:3, 3], hand[:3, 3]
        poses[:, :3, 3] = (1 - share) ** 2 * start + 2 * share * (1 - share) * over + share**2 * end
        bend = self._angles[-1] + share * (angles - self._angles[-1])
        self._append(poses, bend, np.tile(self.objects, (frames, 1, 1, 1)), free=True)

    def close(self, frames: int, angles: Array) -> None:
        """Close (or open) the fingers, the thumb last, while the hand stands still."""
        late = np.repeat([0.25, 0.0, 0.05, 0.12, 0.18], 4) + self._rng.uniform(0.0, 0.06)
        t = np.arange(1, frames + 1)[:, None] / frames
        share = np.clip((t - late) / (1.0 - late - 0.02), 0.0, 1.0)
        share = share * share * (3.0 - 2.0 * share)
        bend = self._angles[-1] + share * (angles - self._angles[-1])
        stay = np.tile(self.hand, (frames, 1, 1))
        self._append(stay, bend, np.tile(self.objects, (frames, 1, 1, 1)), free=False)

    def carry(self, frames: int, index: int, target: Array, grip: Array, rise: float = 0.0) -> None:
        """Move a held object to a pose (4, 4); the hand follows with T_object_hand `grip`."""
        shares = minimum_jerk(frames)
        poses = between(self.objects[index], target, shares)
        poses[:, 2, 3] += rise * np.sin(np.pi * shares) ** 2
        objects = np.tile(self.objects, (frames, 1, 1, 1))
        objects[:, index] = poses
        bend = np.tile(self._angles[-1], (frames, 1))
        self._append(poses @ grip, bend, objects, free=False)

    def set_angles(self, first: int, angles: Array) -> None:
        """Replace the postures (K, 20) from frame `first` on."""
        for offset, row in enumerate(angles):
            self._angles[first + offset] = row

    def _append(self, hands: Array, angles: Array, objects: Array, *, free: bool) -> None:
        self._hands += list(hands)
        self._angles += list(angles)
        self._objects += list(objects)
        self._free += [free] * len(hands)

    def motion(self, tremor: float = 1.0) -> HandMotion:
        """Return the motion with a trembling hand; a held object trembles with the hand.

        Args:
            tremor: 1 moves the wrist by about 0.6 mm and 0.3 degrees, the fingers by 0.6 degrees.
        """
        hands, angles, objects = map(np.array, (self._hands, self._angles, self._objects))
        count = len(hands)
        shift = tremor * 0.0006 * _smooth_noise(self._rng, count, 3)
        turn = tremor * np.radians(0.3) * _smooth_noise(self._rng, count, 3)
        quiver = tremor * np.radians(0.6) * _smooth_noise(self._rng, count, 20)
        loose = gaussian_filter1d(np.array(self._free, dtype=float), 2.0, mode="nearest")
        loose *= np.array(self._free)
        held = [np.any(np.abs(objects[:, i] - objects[0, i]) > 1e-9, axis=(1, 2))
                for i in range(objects.shape[1])]  # fmt: skip
        lifted = np.any(held, axis=0) if held else np.zeros(count, dtype=bool)
        amount = np.where(lifted, gaussian_filter1d(lifted * 1.0, 2.0, mode="nearest"), loose)
        shaken = make_pose(
            hands[:, :3, :3] @ rotation_from_vector(amount[:, None] * turn),
            hands[:, :3, 3] + amount[:, None] * shift,
        )
        for i, moved in enumerate(held):
            moved = moved & ~np.array(self._free)
            relative = inverse(hands[moved]) @ objects[moved, i]
            objects[moved, i] = shaken[moved] @ relative
        return HandMotion(shaken, angles + loose[:, None] * quiver, objects)


def _smooth_noise(rng: np.random.Generator, count: int, channels: int) -> Array:
    """Return (count, channels) noise of unit variance that changes over about three frames."""
    noise = gaussian_filter1d(rng.normal(size=(count + 40, channels)), 1.5, axis=0)[20:-20]
    scaled: Array = noise / 0.43
    return scaled
