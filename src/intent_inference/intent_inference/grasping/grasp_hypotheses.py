"""Grasp hypotheses: free faces of the object's boxes x rolls x pre-shapes (BADGr's idea)."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_inference.grasping.grasping_hand import GraspingHand, Preshape
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.boxes import Box
from intent_perception.geometry.transforms import across, rotation_from_vector
from intent_perception.objects.model import Opening

_FREE = 0.004
"""A face is free if the point this far in front of its centre lies in no other box [m]."""

_SPOKES = 12
"""Places around a rim that are taken."""
_RIM = (0.003, 0.010, 0.012)
"""Half edges of such a place: through the wall, along it, down from the rim [m]."""
_NEAR_MASS, _NEAR_MASS_SHARE = 0.015, 0.8
"""Spread around the centre of mass [m] of this share of the pinches that prefer it."""


@dataclass(frozen=True)
class HypothesisConfig(Checked):
    """How far hypotheses are spread around box faces."""

    roll: float = 0.35
    """Largest roll about the approach from a box axis [rad], 0..3.1."""
    tilt: float = 0.12
    """Standard deviation of the approach's tilt from the face normal [rad], 0..1.5."""
    posture: float = 0.05
    """Standard deviation of the moving joints' open angles [rad], 0..1."""
    clearance: float = 0.05
    """The hand starts with its centre this far in front of all of the object [m], 0.001..0.5."""


@dataclass(frozen=True, eq=False)
class GraspApproach:
    """One face of one box, one roll, one pre-shape."""

    preshape: Preshape
    box: Box
    normal: Array
    """(3,) outward normal of the face in the object frame."""
    closing: Array
    """(3,) in-face box axis along which the fingers oppose each other."""


@dataclass(frozen=True, eq=False)
class GraspHypothesis:
    """Where a hand starts, how it approaches and closes."""

    preshape: str
    T_object_hand: Array
    approach: Array
    """(3,) unit direction in the object frame."""
    travel: float
    """Longest approach [m]."""
    joints: Array
    """(J,) open posture [rad]."""
    rates: Array
    """(J,) relative closing speeds."""
    target: Array | None = None
    """(3,) point of the object that the hand aims at, object frame."""


def approaches(boxes: Sequence[Box], hand: GraspingHand) -> list[GraspApproach]:
    """Return every combination of free face, roll and pre-shape that is not too wide to grasp."""
    found = []
    for index, box in enumerate(boxes):
        others = [other for k, other in enumerate(boxes) if k != index]
        for axis in range(3):
            for sign in (-1.0, 1.0):
                normal = sign * box.rotation[:, axis]
                if not _is_free(box.center + normal * (box.half_size[axis] + _FREE), others):
                    continue
                for roll in range(4):
                    across = (axis + 1 + roll % 2) % 3
                    closing = box.rotation[:, across] * (1.0 if roll < 2 else -1.0)
                    found += [
                        GraspApproach(preshape, box, normal, closing)
                        for preshape in hand.preshapes
                        if preshape.place != "rim"
                        and 2.0 * box.half_size[across] <= preshape.widest
                        and 2.0 * box.half_size[axis] <= preshape.thickest
                    ]
    return found


def rim_approaches(opening: Opening, hand: GraspingHand) -> list[GraspApproach]:
    """Return the ways into an opening whose rim is pinched, thumb outside or inside."""
    found = []
    for preshape in hand.preshapes:
        if preshape.place != "rim":
            continue
        for out in _spokes(opening.normal):
            rotation = np.stack([out, np.cross(opening.normal, out), opening.normal], axis=1)
            middle = opening.center + opening.radius * out - _RIM[2] * opening.normal
            box = Box(middle, rotation, np.array(_RIM))
            found += [
                GraspApproach(preshape, box, opening.normal, sign * out) for sign in (-1.0, 1.0)
            ]
    return found


def _spokes(normal: Array) -> Array:
    """Return unit vectors (N, 3) all around an axis (3,)."""
    first = across(normal)
    turns = np.arange(_SPOKES) * 2.0 * np.pi / _SPOKES
    return np.asarray(
        np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * np.cross(normal, first)
    )


class HypothesisSampler:
    """Draws jittered hypotheses; approaches that proved useful can be drawn more often.

    Args:
        choices: what `approaches` found.
        hand: the hand.
        extent: no point of the object is farther from its frame's origin [m].
        center_of_mass: (3,) of the object [m].
        rng: source of choice and jitter.
        config: spreads.

    Raises:
        ValueError: if there is nothing to choose from.
    """

    def __init__(
        self,
        choices: Sequence[GraspApproach],
        hand: GraspingHand,
        extent: float,
        center_of_mass: Array,
        rng: np.random.Generator,
        config: HypothesisConfig | None = None,
    ) -> None:
        if not choices:
            raise ValueError("expected an object with at least one face that the hand can span")
        self._choices, self._hand, self._extent = choices, hand, extent
        self._center_of_mass, self._rng = center_of_mass, rng
        self._config = config or HypothesisConfig()
        counts = Counter(id(choice.preshape) for choice in choices)
        base = np.array([c.preshape.weight / counts[id(c.preshape)] for c in choices])
        self._base = base / base.sum()
        self._weights = self._base

    def __len__(self) -> int:
        """Return the number of approaches."""
        return len(self._choices)

    def favor(self, scores: Array, share: float) -> None:
        """Draw a share of the hypotheses in proportion to scores (N,) of the approaches >= 0."""
        useful = self._base * scores
        total = float(useful.sum())
        self._weights = self._base
        if total > 0.0:
            self._weights = (1.0 - share) * self._base + share * useful / total

    def draw(self) -> tuple[int, GraspHypothesis]:
        """Return the index of an approach and a hypothesis of it."""
        index = int(self._rng.choice(len(self._choices), p=self._weights))
        choice = self._choices[index]
        return index, _jittered(
            choice, self._hand, self._extent, self._center_of_mass, self._rng, self._config
        )


def _is_free(point: Array, boxes: Sequence[Box]) -> bool:
    return not any(
        np.all(np.abs((point - box.center) @ box.rotation) < box.half_size) for box in boxes
    )


def _jittered(
    choice: GraspApproach,
    hand: GraspingHand,
    extent: float,
    center_of_mass: Array,
    rng: np.random.Generator,
    config: HypothesisConfig,
) -> GraspHypothesis:
    preshape = choice.preshape
    tilt = rotation_from_vector(rng.normal(0.0, config.tilt * preshape.jitter, 3))
    most = config.roll * preshape.jitter
    roll = rotation_from_vector(choice.normal * rng.uniform(-most, most))
    turn = tilt @ roll
    approach, closing = -(turn @ choice.normal), turn @ choice.closing
    side = np.cross(approach, closing)
    in_hand = np.stack(
        [preshape.approach, preshape.closing, np.cross(preshape.approach, preshape.closing)]
    )
    rotation = np.stack([approach, closing, side], axis=1) @ in_hand
    target, depth, half_width = _target(choice, center_of_mass, rng)
    back = 2.0 * extent + config.clearance
    center = target - approach * back
    center -= closing * (preshape.side * half_width)
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = center - rotation @ preshape.center
    spread = rng.normal(0.0, config.posture, len(preshape.open)) * (preshape.rates != 0)
    joints = np.clip(preshape.open + spread, hand.table.limits[:, 0], hand.table.limits[:, 1])
    travel = back + (depth if preshape.stop == "center" else 2.0 * extent)
    return GraspHypothesis(preshape.name, pose, approach, travel, joints, preshape.rates, target)


def _target(
    choice: GraspApproach, center_of_mass: Array, rng: np.random.Generator
) -> tuple[Array, float, float]:
    """Return a point on the box face, how deep the centre should go, half the width there [m]."""
    box, preshape = choice.box, choice.preshape
    local_normal = box.rotation.T @ choice.normal
    local_closing = box.rotation.T @ choice.closing
    axis, across = int(np.argmax(np.abs(local_normal))), int(np.argmax(np.abs(local_closing)))
    along = 3 - axis - across
    point = np.zeros(3)
    point[axis] = np.sign(local_normal[axis]) * box.half_size[axis]
    point[across] = rng.uniform(-1.0, 1.0) * preshape.offset[0] * box.half_size[across]
    reach = preshape.offset[1] * box.half_size[along]
    point[along] = rng.uniform(-reach, reach)
    if preshape.near_mass and rng.random() < _NEAR_MASS_SHARE:
        mass = float((box.rotation.T @ (center_of_mass - box.center))[along])
        point[along] = np.clip(rng.normal(mass, _NEAR_MASS), -reach, reach)
    depth = min(rng.uniform(*preshape.depth), box.half_size[axis]) if preshape.depth[1] else 0.0
    return box.center + box.rotation @ point, float(depth), float(box.half_size[across])
