"""Grasp hypotheses of an object that rests on a table: the hand must not go through the table.

Free-space hypotheses wrap fingers around thin things; where those lie flat, there is no room. These
come from above or from the side, and stop where the closing fingers would touch the table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from intent_imitation.planner.collision import Obstacle, clearances, hand_spheres
from intent_inference.grasping.autograsp import ClosedGrasp, close_hand
from intent_inference.grasping.contacts import Contacts, gravity_residual, opposed, touching
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis
from intent_inference.grasping.grasping_hand import GraspingHand, Preshape
from intent_inference.grasping.task_object import TaskObject
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.boxes import Box
from intent_perception.geometry.transforms import inverse, make_pose, rotation_from_vector

_CLOSING = np.linspace(0.0, 1.2, 9)  # how far the fastest joint may close [rad]


@dataclass(frozen=True)
class TabletopConfig(Checked):
    """How hypotheses are spread around an object at rest."""

    gap: float = 0.002
    """Least gap between hand and table [m], 0..0.05."""
    from_above: float = 0.6
    """Share of the hypotheses that come from above, 0..1."""
    tilt: float = 0.25
    """Standard deviation of the approach around the vertical or the horizontal [rad], 0..1.5."""
    roll: float = 0.12
    """Standard deviation of the closing direction around a box axis [rad], 0..1.5."""
    residual: float = 0.1
    """Largest share of the weight, from any side, that the contacts may fail to hold, 0..0.99."""
    friction: float = 0.8
    """Coulomb coefficient between hand and object, 0.01..10."""


@dataclass(frozen=True, eq=False)
class RestingGrasp:
    """A grasp of an object at rest that passed the static filter."""

    hypothesis: GraspHypothesis
    grasp: ClosedGrasp
    contacts: Contacts
    residual: float


def tabletop_hypotheses(
    target: TaskObject,
    hand: GraspingHand,
    T_table_object: Array,
    rng: np.random.Generator,
    config: TabletopConfig,
) -> Iterator[GraspHypothesis]:
    """Yield endless hypotheses in the object frame for an object at a pose on the table.

    Args:
        target: the object.
        hand: the robot's hand.
        T_table_object: (4, 4) how it rests.
        rng: source of randomness.
        config: spreads.
    """
    weights = np.array([preshape.weight for preshape in hand.preshapes])
    weights /= weights.sum()
    while True:
        preshape = hand.preshapes[int(rng.choice(len(hand.preshapes), p=weights))]
        box = _placed(_one_of(target.geometry.boxes, rng), T_table_object)
        approach = _approach(rng, config)
        frame = _frame(preshape, box, approach, rng, config)
        if frame is not None:
            start, travel = _way(hand, preshape, box, approach, frame, target, rng, config)
            T_object_table = inverse(T_table_object)
            yield GraspHypothesis(
                preshape.name,
                T_object_table @ start,
                T_object_table[:3, :3] @ approach,
                travel,
                preshape.open,
                preshape.rates,
            )


def tabletop_candidates(
    target: TaskObject,
    hand: GraspingHand,
    T_table_object: Array,
    rng: np.random.Generator,
    tries: int,
    config: TabletopConfig | None = None,
) -> list[RestingGrasp]:
    """Return the grasps of an object at rest that pass the static filter and clear the table."""
    config = config or TabletopConfig()
    found = []
    source = tabletop_hypotheses(target, hand, T_table_object, rng, config)
    for _, hypothesis in zip(range(tries), source, strict=False):
        candidate = _examined(target, hand, hypothesis, config)
        if candidate is not None:
            found.append(candidate)
    if not found:
        return []
    room = room_on_table(
        hand,
        target,
        T_table_object,
        np.array([c.grasp.T_object_hand for c in found]),
        np.array([c.hypothesis.approach for c in found]),
        np.array([c.hypothesis.joints for c in found]),
        np.array([c.grasp.joints for c in found]),
    )
    return [c for c, gap in zip(found, room, strict=True) if gap >= config.gap - 0.0005]


def room_on_table(
    hand: GraspingHand,
    target: TaskObject,
    T_table_object: Array,
    T_object_hand: Array,
    approach: Array,
    opened: Array,
    closed: Array,
) -> Array:
    """Return the least gap (G,) to the table of G grasps on their way [m], object frame given."""
    return clearances(
        hand,
        T_table_object @ T_object_hand,
        approach @ T_table_object[:3, :3].T,
        opened,
        closed,
        Obstacle(T_table_object, target.field),
        (),
    ).table


def _examined(
    target: TaskObject, hand: GraspingHand, hypothesis: GraspHypothesis, config: TabletopConfig
) -> RestingGrasp | None:
    """Return the closed grasp if opposed contacts can hold the weight from all sides."""
    grasp = close_hand(hand, target.field, hypothesis)[1]
    if grasp is None:
        return None
    contacts = touching(hand, target.field, grasp.spheres, grasp.clearance)
    if len(contacts.points) < 2 or not opposed(hand, contacts):
        return None
    residual = gravity_residual(
        contacts, target.center_of_mass, target.reach, config.friction, target.weight
    )
    if residual > config.residual:
        return None
    return RestingGrasp(hypothesis, grasp, contacts, residual)


def _one_of(boxes: Sequence[Box], rng: np.random.Generator) -> Box:
    return boxes[int(rng.integers(len(boxes)))]


def _placed(box: Box, pose: Array) -> Box:
    """Return a box of the object frame in the table frame."""
    rotation = pose[:3, :3] @ box.rotation
    return Box(pose[:3, :3] @ box.center + pose[:3, 3], rotation, box.half_size)


def _approach(rng: np.random.Generator, config: TabletopConfig) -> Array:
    """Return a unit direction from above, or from the side and slightly downwards."""
    turn = rng.uniform(-np.pi, np.pi)
    sideways = np.array([np.cos(turn), np.sin(turn), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    if rng.random() < config.from_above:
        angle = abs(rng.normal(0.0, config.tilt))
        return np.asarray(np.cos(angle) * down + np.sin(angle) * sideways)
    angle = abs(rng.normal(0.0, config.tilt))
    return np.asarray(np.cos(angle) * sideways + np.sin(angle) * down)


def _frame(
    preshape: Preshape,
    box: Box,
    approach: Array,
    rng: np.random.Generator,
    config: TabletopConfig,
) -> Array | None:
    """Return the hand's rotation (3, 3): closing across a box axis that it can span."""
    across = box.rotation.T @ approach
    spans = [k for k in range(3) if 2.0 * box.half_size[k] <= preshape.widest]
    spans = [k for k in spans if abs(across[k]) < 0.75]
    if not spans:
        return None
    closing = box.rotation[:, spans[int(rng.integers(len(spans)))]] * rng.choice([-1.0, 1.0])
    closing = rotation_from_vector(approach * rng.normal(0.0, config.roll)) @ closing
    closing = closing - approach * (approach @ closing)
    closing /= np.linalg.norm(closing)
    own = np.stack([preshape.approach, preshape.closing])
    own = np.concatenate([own, np.cross(own[0], own[1])[None]])
    wanted = np.stack([approach, closing, np.cross(approach, closing)], axis=1)
    return np.asarray(wanted @ own)


def _way(
    hand: GraspingHand,
    preshape: Preshape,
    box: Box,
    approach: Array,
    rotation: Array,
    target: TaskObject,
    rng: np.random.Generator,
    config: TabletopConfig,
) -> tuple[Array, float]:
    """Return where the hand starts (4, 4) in the table frame and how far it may travel [m]."""
    offsets = rng.uniform(-0.85, 0.85, 3) * box.half_size
    closing = rotation @ preshape.closing
    along = box.rotation @ offsets
    along -= 0.85 * closing * (closing @ along)
    back = 2.0 * target.extent + 0.05
    center = box.center + along
    position = center - rotation @ preshape.center - back * approach
    travel = back + (rng.uniform(0.0, 0.02) if preshape.stop == "center" else target.extent)
    if approach[2] < -0.05:
        lowest = _lowest(hand, preshape, rotation) + position[2]
        room = lowest - config.gap - rng.exponential(0.003)
        travel = min(travel, room / -approach[2])
    return make_pose(rotation, position), float(max(travel, 0.0))


def _lowest(hand: GraspingHand, preshape: Preshape, rotation: Array) -> float:
    """Return the lowest point of the closing hand relative to its base [m]."""
    limits = hand.table.limits
    rates = preshape.rates / max(float(np.abs(preshape.rates).max()), 1e-9)
    joints = np.clip(preshape.open + _CLOSING[:, None] * rates, limits[:, 0], limits[:, 1])
    heights = hand_spheres(hand, joints) @ rotation[2]
    return float((heights - hand.arrays.sphere_radii).min())
