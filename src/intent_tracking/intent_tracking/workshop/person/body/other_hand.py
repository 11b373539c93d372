"""People of another build: other proportions, joint axes and shape of the fingers.

The demonstrator of the bags has one kind of flesh; a tracker that fits it well may only have
learned that kind. Here every phalanx has a waist, thick joints and a flat pad, the palm is a slab
with knuckles, and proportions vary twice as much.
"""

from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, rotation_from_vector
from intent_tracking.workshop.person.body.blended_surface import smooth_union
from intent_tracking.workshop.person.body.person_hand import (
    FOREARM,
    PALM,
    DemonstratorHand,
    sample_hand,
)
from intent_tracking.workshop.person.body.skin import REST

_WIDTHS = np.array(
    [[0.0135, 0.0118, 0.0108], [0.0103, 0.0091, 0.0080], [0.0105, 0.0093, 0.0082],
     [0.0099, 0.0087, 0.0077], [0.0088, 0.0077, 0.0068]]
)  # fmt: skip
"""Half the width of each phalanx at its base [m]."""
_TIP = 0.80
"""Half the width at the finger tip against that of the last phalanx's base."""


@dataclass(frozen=True, eq=False)
class ShapedBones:
    """C bones in flesh: oval across, with a waist between thick ends."""

    to_bone: Array
    """(C, 4, 4) into each bone's frame; x runs along the bone, z is the palm's side."""
    lengths: Array
    """(C,) [m]."""
    radii: Array
    """(C, 2) half the width at start and end [m]."""
    waists: Array
    """(C,) share by which the middle is thinner."""
    flats: Array
    """(C, 2) height over width at start and end."""

    def distances(self, points: Array) -> Array:
        """Return (N, C) approximate signed distances of points (N, 3) to each bone [m]."""
        local = np.einsum("cij,nj->nci", self.to_bone[:, :3, :3], points) + self.to_bone[:, :3, 3]
        t = np.clip(local[..., 0] / self.lengths, 0.0, 1.0)
        radius = self.radii[:, 0] + t * (self.radii[:, 1] - self.radii[:, 0])
        radius = radius * (1.0 - self.waists * np.sin(np.pi * t) ** 2)
        flat = self.flats[:, 0] + t * (self.flats[:, 1] - self.flats[:, 0])
        beyond = local[..., 0] - t * self.lengths
        y, z = np.abs(local[..., 1]), np.abs(local[..., 2]) / flat
        oval = (y**2.4 + z**2.4) ** (1.0 / 2.4)
        distance: Array = np.hypot(beyond, oval) - radius
        return distance


def sample_other_hand(rng: np.random.Generator, side: str = "right") -> DemonstratorHand:
    """Return a person of another build: slender or broad, fingers long or short.

    Args:
        rng: source of the person.
        side: "right" or "left".
    """
    hand = sample_hand(rng, side)
    fingers, breadth = rng.uniform(0.90, 1.10), rng.uniform(0.92, 1.12)
    bones = hand.bones * fingers * rng.uniform(0.95, 1.05, (5, 1))
    bases = hand.bases * [rng.uniform(0.94, 1.06), breadth, 1.0]
    bases[0] += rng.normal(0.0, 0.003, 3)
    axes = hand.axes.copy()
    for finger in range(5):
        for k in range(4):
            turn = rng.normal(0.0, np.radians(5.0 if finger == 0 else 3.0), 3)
            axes[finger, k] = axes[finger, k] @ rotation_from_vector(turn)
    thickness = float(np.sqrt(breadth) * rng.uniform(0.92, 1.06))
    return replace(hand, bases=bases, bones=bones, axes=axes, thickness=thickness)


class OtherFlesh:
    """Flesh of another build over the bones of one hand in the rest pose."""

    def __init__(self, hand: DemonstratorHand, rng: np.random.Generator) -> None:
        poses, t = hand.link_poses(REST), hand.thickness
        self._waist = rng.uniform(0.03, 0.12)
        pad = rng.uniform(0.80, 0.95)
        rows = []
        for finger in range(5):
            width = np.append(_WIDTHS[finger], _TIP * _WIDTHS[finger, 2]) * t
            for k in range(3):
                pose = poses[1 + 3 * finger + k].copy()
                pose[:3, 3] += 0.0010 * pose[:3, 2]
                length = hand.bones[finger, k] - (0.95 * width[3] if k == 2 else 0.0)
                flats = (0.95, pad) if k == 2 else (1.0, 0.95)
                waist = 0.0 if k == 2 else self._waist
                rows.append((pose, length, width[k], width[k + 1], waist, *flats))
        self._digits = _bones(rows)
        self._digit_links = np.arange(1, 16)
        self._palm, self._arm = _bones(_slab(hand, poses, t)), _bones([_arm(t)])

    def bounds(self) -> tuple[Array, Array]:
        """Return two corners (3,) of a box around it [m]."""
        starts = inverse(np.concatenate([self._digits.to_bone, self._arm.to_bone]))
        lengths = np.concatenate([self._digits.lengths, self._arm.lengths])
        ends = starts[:, :3, 3] + lengths[:, None] * starts[:, :3, 0]
        points = np.concatenate([starts[:, :3, 3], ends])
        return points.min(axis=0) - 0.05, points.max(axis=0) + 0.05

    def field(self, points: Array) -> Array:
        """Return the signed distance to the skin, (N,) [m]."""
        digits = self._digits.distances(points)
        fingers = [smooth_union(digits[:, 3 * f : 3 * f + 3], 0.0010) for f in range(5)]
        palm = smooth_union(self._palm.distances(points), 0.0060)
        arm = self._arm.distances(points)[:, 0]
        body = smooth_union(np.stack([palm, arm], axis=1), 0.0070)
        thumb = smooth_union(np.stack([body, fingers[0]], axis=1), 0.0060)
        return smooth_union(np.stack([thumb, *fingers[1:]], axis=1), 0.0022)

    def link_distances(self, points: Array) -> Array:
        """Return the distance to the flesh of each link, (N, 17) [m]."""
        distances = np.zeros((len(points), 17))
        distances[:, self._digit_links] = self._digits.distances(points)
        behind = np.maximum(0.0, -0.35 * (points[:, 0] + 0.012))
        ahead = np.maximum(0.0, 0.35 * (points[:, 0] + 0.012))
        distances[:, PALM] = self._palm.distances(points).min(axis=1) + behind
        distances[:, FOREARM] = self._arm.distances(points)[:, 0] + ahead
        return distances


Bone = tuple[Array, float, float, float, float, float, float]
"""Pose (4, 4), length, half widths at start and end, waist, height over width at both ends."""


def _slab(hand: DemonstratorHand, poses: Array, t: float) -> list[Bone]:
    """Return a flat palm with knuckles, the thumb's ball and the outer edge."""
    b = hand.bases
    rows: list[Bone] = []
    for finger, carpal in zip(range(1, 5), (-0.013, -0.004, 0.006, 0.015), strict=True):
        start = np.array([0.010, carpal, 0.003])
        end = b[finger] + [-0.004, 0.0, 0.001]
        rows.append((*_between(start, end), 0.0148 * t, 0.0126 * t, 0.0, 0.95, 0.92))
        knuckle = b[finger] + [-0.004, 0.0, -0.0030]
        rows.append(
            (*_between(knuckle, knuckle + 0.004 * np.eye(3)[0]), 0.0098 * t, 0.0092 * t, 0, 1, 1)
        )
    tip = poses[1, :3, 3] + 0.92 * hand.bones[0, 0] * poses[1, :3, 0]
    ball = np.array([0.014, -0.006, 0.011])
    rows.append((*_between(ball, 0.35 * ball + 0.65 * tip), 0.0165 * t, 0.0135 * t, -0.10, 0.9, 1))
    web = b[1] + [-0.026, -0.004, 0.006]
    rows.append((*_between(0.4 * ball + 0.6 * tip, web), 0.0092 * t, 0.0098 * t, 0.0, 1, 1))
    heel = np.array([0.014, 0.020, 0.010])
    edge = b[4] + [-0.022, 0.002, 0.002]
    rows.append((*_between(heel, edge), 0.0150 * t, 0.0128 * t, -0.06, 1, 1))
    return rows


def _arm(t: float) -> Bone:
    """Return the wrist and the bare forearm behind it."""
    start, end = np.array([-0.002, 0.0, 0.003]), np.array([-0.13, 0.0, 0.002])
    return (*_between(start, end), 0.0290 * t, 0.0365 * t, 0.05, 0.66, 0.68)


def _between(start: Array, end: Array) -> tuple[Array, float]:
    """Return the pose (4, 4) whose x axis points from start to end, z kept up, and the length."""
    x = end - start
    length = float(np.linalg.norm(x))
    x = x / length
    z = np.array([0.0, 0.0, 1.0])
    z = z - x * (x @ z)
    z /= np.linalg.norm(z)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), start
    return pose, length


def _bones(rows: list[Bone]) -> ShapedBones:
    poses = np.array([row[0] for row in rows])
    numbers = np.array([row[1:] for row in rows], dtype=np.float64)
    return ShapedBones(
        inverse(poses), numbers[:, 0], numbers[:, 1:3], numbers[:, 3], numbers[:, 4:6]
    )
