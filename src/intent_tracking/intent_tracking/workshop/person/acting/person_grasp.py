"""The demonstrator takes an object: fingers close until the skin touches its signed distance field.

No joint angle of a grasp is written down anywhere: an open posture is brought to the object from a
side that suits the task (`demonstrator_approach`), every joint then closes until the flesh in front
of it is stopped, and only grasps that hold the weight with friction are kept.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import make_pose, transform_points
from intent_tracking.workshop.person.body.person_hand import LOWER, PALM, UPPER
from intent_tracking.workshop.person.body.skin import Skin

OPEN = {
    "power": np.radians([16, -44, 8, 8] + [0, 8, 14, 8] * 4),
    "precision": np.radians([2, -40, 14, 10] + [0, 22, 24, 12] * 4),
    "flat": np.radians([58, 8, 0, 4] + [0, 0, 2, 2] * 4),
}
"""Open postures (20,) [rad]: closing starts from the first two; flat is for low things."""

_RATES = {
    "power": np.array([0.0, 0.25, 1.0, 0.8] + [0.0, 1.0, 1.0, 0.67] * 4),
    "precision": np.array([0.0, 0.45, 0.5, 0.35] + [0.0, 1.0, 0.4, 0.2] * 4),
}
_PALM = (0.066, 0.096)
_TOUCH, _SQUEEZE = 0.0012, -0.0012
_MAX_PENETRATION = 0.0045
_FRICTION = 0.8


@dataclass(frozen=True, eq=False)
class PersonApproach:
    """One way to come to an object; all in the object frame, for a right hand."""

    rotation: Array
    """(3, 3) R_object_hand."""
    target: Array
    """(3,) where the palm (power) or the finger tips (precision) go [m]."""
    posture: str
    """Key of `OPEN`."""
    width: float = 0.0
    """What the finger tips span there, for a precision grasp [m]."""


@dataclass(frozen=True, eq=False)
class Grasp:
    """A closed hand on an object."""

    T_object_hand: Array
    """(4, 4) pose of the right wrist."""
    open_angles: Array
    """(20,) posture while reaching [rad]."""
    angles: Array
    """(20,) posture that holds [rad]."""
    touching: frozenset[str]
    """Which of palm, thumb, index, middle, ring, little touch."""
    residual: float
    """Share of the worst unit load (six directions) that friction cannot carry, 0 = all held."""
    penetration: float
    """Deepest point of the skin inside the object: the compressed flesh [m]."""
    contacts: Array
    """(K, 3) where skin presses on the object, at most two points per link, object frame [m]."""
    normals: Array
    """(K, 3) unit normals into the object."""
    links: NDArray[np.int64]
    """(K,) link of the demonstrator's hand that presses there."""


class Taker:
    """Closes one person's hand around one object; always the right one (see `Motion.mirrored`)."""

    def __init__(self, skin: Skin, sdf: SignedDistance, rng: np.random.Generator) -> None:
        self._skin, self._sdf, self._rng = skin, sdf, rng
        owner = skin.weights.argmax(axis=1)
        self._subset = np.concatenate([
            rng.permutation(np.flatnonzero(owner == link))[: 90 if link else 420]
            for link in range(16)
        ])  # fmt: skip
        self._links = owner[self._subset]
        self._mirror = skin.hand.mirror
        self._posture, self._points = b"", np.zeros((0, 3))

    def points(self, angles: Array) -> Array:
        """Return the skin samples of the right hand in its wrist frame, (S, 3) [m]; read only."""
        posture = angles.tobytes()
        if posture != self._posture:  # a hand is moved about in one posture many times
            self._posture = posture
            self._points = self._skin.posed(angles, subset=self._subset) * self._mirror
        return self._points

    def distances(self, angles: Array, T_object_hand: Array) -> Array:
        """Return the distance of every skin sample to the object, (S,) [m]."""
        points = transform_points(T_object_hand, self.points(angles))
        return np.asarray(self._sdf.distance(points), dtype=np.float64)

    def take(self, approaches: Iterable[PersonApproach]) -> Iterable[Grasp]:
        """Yield the grasps among the approaches that touch, oppose and hold."""
        for approach in approaches:
            start = self._open(approach)
            pose = self._bring(approach, start)
            if pose is None:
                continue
            angles = self._close(start, _RATES[approach.posture], pose)
            angles = self._tidied(start, angles, pose)
            for posture in self._other_thumbs(approach, start, angles, pose):
                grasp = self._judged(start, posture, pose)
                if grasp is not None:
                    yield grasp

    def _other_thumbs(
        self, approach: PersonApproach, start: Array, angles: Array, pose: Array
    ) -> Iterator[Array]:
        """Yield the posture, and for a power grasp others in which the thumb closes elsewhere."""
        yield angles
        rates = _RATES["power"].copy()
        rates[4:] = 0.0
        for _ in range(4 if approach.posture == "power" else 0):
            other = angles.copy()
            other[0] = start[0] + self._rng.uniform(-0.4, 0.5)
            other[1] = self._rng.uniform(LOWER[1], -0.4)
            other[2:4] = start[2:4] + self._rng.uniform(0.0, 0.9) * np.array([1.0, 0.7])
            other = np.clip(other, LOWER, UPPER)
            if self.distances(other, pose).min() > 2.0 * _SQUEEZE:
                yield self._close(other, rates, pose)

    def _open(self, approach: PersonApproach) -> Array:
        """Return an open posture, a little different every time, wide enough for a precision."""
        angles = OPEN[approach.posture].copy()
        angles[5::4] += self._rng.normal(0.0, 0.06)
        angles[6::4] += self._rng.normal(0.0, 0.04)
        angles[4::4] += self._rng.normal(0.0, 0.03, 4)
        spread = 0.17 if approach.posture == "precision" else 0.32
        angles[0] += self._rng.uniform(-spread, spread)
        if approach.posture == "precision":
            rates = _RATES["precision"]
            for share in np.radians(np.arange(40.0, -42.0, -2.0)):
                trial = np.clip(angles + rates * share, LOWER, UPPER)
                if self._pinch(trial)[1] > approach.width + 0.026:
                    break
            angles = trial
        return np.clip(angles, LOWER, UPPER)

    def _pinch(self, angles: Array) -> tuple[Array, float]:
        """Return the point (3,) between thumb and finger tips and their distance [m]."""
        tips = self._skin.hand.joint_positions(angles) * self._mirror
        opposite = 0.45 * tips[8] + 0.4 * tips[12] + 0.15 * tips[16]
        return 0.5 * (tips[4] + opposite), float(np.linalg.norm(tips[4] - opposite))

    def _bring(self, approach: PersonApproach, angles: Array) -> Array | None:
        """Return the wrist pose of first contact or of the reached target; None if it collides."""
        rotation = approach.rotation
        ahead = rotation[:, 2]
        power = approach.posture == "power"
        middle = np.array([self._rng.uniform(*_PALM), 0.004, 0.0])
        point = middle if power else self._pinch(angles)[0]
        travelled, stop = 0.0, 0.40 if power else 0.20
        begin = approach.target - rotation @ point - 0.20 * ahead
        for _ in range(60):
            pose = make_pose(rotation, begin + travelled * ahead)
            free = float(self.distances(angles, pose).min())
            if free < 0.0006 or travelled >= stop:
                break
            travelled = min(stop, travelled + max(0.9 * free, 0.0006))
        missed = travelled >= stop if power else travelled < stop - 0.03
        if free < -0.002 or travelled < 0.05 or missed:
            return None
        return pose

    def _close(self, start: Array, rates: Array, pose: Array) -> Array:
        """Return the posture in which every joint is stopped by flesh on the object.

        A phalanx that touches stops the joints before it; the joints after it go on.
        """
        angles, step = start.copy(), np.full(5, np.radians(4.0))
        moving = rates > 0.0
        for _ in range(160):
            if not moving.any():
                break
            trial = angles + np.where(moving, rates * np.repeat(step, 4), 0.0)
            trial = np.minimum(trial, UPPER)
            blocked = self._blocked(trial, pose)
            for finger in range(5):
                joints = slice(4 * finger, 4 * finger + 4)
                level = blocked[finger]
                if level < 0:
                    angles[joints] = trial[joints]
                    moving[joints] &= trial[joints] < UPPER[joints]
                elif step[finger] > np.radians(0.3):
                    step[finger] *= 0.5
                else:
                    moving[4 * finger : 4 * finger + level + 2] = False
                    step[finger] = np.radians(2.0)
        return angles

    def _tidied(self, start: Array, angles: Array, pose: Array) -> Array:
        """Return the posture with the fingers that met nothing curled like their neighbours."""
        distances = self.distances(angles, pose)
        owner = np.where(self._links == PALM, 0, 1 + (self._links - 1) // 3)
        near = [float(distances[owner == 1 + finger].min()) for finger in range(5)]
        busy = [finger for finger in range(1, 5) if near[finger] < _TOUCH]
        tidy = angles.copy()
        for finger in range(1, 5):
            if finger in busy or not busy:
                continue
            model = min(busy, key=lambda other: abs(other - finger))
            for share in (1.1, 0.9, 0.7, 0.5, 0.3, 0.0):
                flexion = slice(4 * finger + 1, 4 * finger + 4)
                copied = angles[4 * model + 1 : 4 * model + 4]
                tidy[flexion] = start[flexion] + share * (copied - start[flexion])
                tidy = np.clip(tidy, LOWER, UPPER)
                if self.distances(tidy, pose)[owner == 1 + finger].min() > _SQUEEZE:
                    break
        return tidy

    def _blocked(self, angles: Array, pose: Array) -> Array:
        """Return per finger the outermost phalanx (0, 1, 2) stopped by object or thumb, or -1."""
        touched = self._links[self.distances(angles, pose) < _SQUEEZE]
        blocked = np.full(5, -1)
        for link in np.unique(touched[touched > 0]):
            finger, level = divmod(int(link) - 1, 3)
            blocked[finger] = max(blocked[finger], level)
        crossed = self._crossing(angles)
        if crossed is not None:
            blocked[0] = max(blocked[0], crossed[0])
            blocked[crossed[1]] = max(blocked[crossed[1]], crossed[2])
        return blocked

    def _crossing(self, angles: Array) -> tuple[int, int, int] | None:
        """Return (thumb phalanx, finger, its phalanx) where thumb and a finger meet, or None."""
        poses, hand = self._skin.hand.link_poses(angles), self._skin.hand
        s = np.linspace(0.15, 0.9, 4)
        along = poses[1:16, :3, 0] * hand.bones.reshape(15, 1)
        dots = poses[1:16, None, :3, 3] + s[:, None] * along[:, None]
        thumb, fingers = dots[1:3].reshape(-1, 3), dots[3:].reshape(-1, 3)
        gap = np.linalg.norm(thumb[:, None] - fingers[None], axis=2)
        a, b = np.unravel_index(int(gap.argmin()), gap.shape)
        if gap[a, b] > 0.0165 * hand.thickness:
            return None
        finger, level = divmod(int(b) // 4, 3)
        return 1 + int(a) // 4, finger + 1, level

    def _judged(self, start: Array, angles: Array, pose: Array) -> Grasp | None:
        """Return the grasp if thumb and a finger oppose, nothing sinks in, and the load holds."""
        distances = self.distances(angles, pose)
        deepest = float(-distances.min())
        names = np.array(["palm", "thumb", "index", "middle", "ring", "little"])
        owner = np.where(self._links == PALM, 0, 1 + (self._links - 1) // 3)
        touching = frozenset(names[np.unique(owner[distances < _TOUCH])].tolist())
        if deepest > _MAX_PENETRATION or "thumb" not in touching:
            return None
        if not touching & {"index", "middle", "ring", "little"}:
            return None
        contact = np.flatnonzero(distances < _TOUCH)
        points = transform_points(pose, self.points(angles))[contact]
        normals = -np.asarray(self._sdf.gradient(points), dtype=np.float64)
        residual = load_residual(points, normals)
        if residual > 0.3:
            return None
        few = _spread(contact, self._links, distances)
        keep = np.isin(contact, few)
        normals = normals[keep] / np.linalg.norm(normals[keep], axis=1, keepdims=True)
        return Grasp(
            pose, start, angles, touching, residual, deepest, points[keep], normals,
            self._links[contact[keep]],
        )  # fmt: skip


def _spread(
    contact: NDArray[np.int64], links: NDArray[np.int64], distances: Array
) -> NDArray[np.int64]:
    """Return the two deepest samples of every link among the touching ones."""
    chosen = []
    for link in np.unique(links[contact]):
        own = contact[links[contact] == link]
        chosen.append(own[np.argsort(distances[own])[:2]])
    return np.concatenate(chosen)


def load_residual(points: Array, normals: Array, friction: float = _FRICTION) -> float:
    """Return the share of the worst of six unit loads that contacts with friction cannot carry.

    Args:
        points: (C, 3) contacts [m].
        normals: (C, 3) directions in which the hand pushes the object.
        friction: Coulomb coefficient.
    """
    if len(points) > 60:
        keep = np.linspace(0, len(points) - 1, 60).astype(int)
        points, normals = points[keep], normals[keep]
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(size, 1e-9)
    helper = np.where(np.abs(normals[:, :1]) < 0.8, [[1.0, 0, 0]], [[0.0, 1.0, 0]])
    u = np.cross(normals, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normals, u)
    corner = np.arange(6) * np.pi / 3
    rim = np.cos(corner)[:, None, None] * u + np.sin(corner)[:, None, None] * v
    forces = (normals + friction * rim).reshape(-1, 3)
    centre = points.mean(axis=0)
    arms = np.tile((points - centre) / 0.05, (6, 1))
    wrenches = np.concatenate([forces, np.cross(arms, forces)], axis=1).T
    loads = np.concatenate([np.eye(6)[:3], -np.eye(6)[:3]])
    return max(float(nnls(wrenches, load)[1]) for load in loads)
