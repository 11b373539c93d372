"""Where a closed hand touches an object, and whether those contacts can hold it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import transform_points

_DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)])
_NEAR = 0.0018
"""A link touches where its skin is this close to the object [m]."""
PAD = 0.004
"""Torque about its normal that a soft finger pad bears per normal force [m]: 2/3 of the friction
times a patch of 7 mm radius."""
_APART = 0.012
"""A link may touch twice if the places are this far apart [m]."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """K places where the hand presses on the object."""

    points: Array
    """(K, 3) in the object frame [m]."""
    normals: Array
    """(K, 3) unit normals into the object."""
    links: NDArray[np.int64]
    """(K,) link of the hand."""
    forces: Array
    """(K,) normal force [N], 1 where only the geometry is known."""

    def of_force(self, mask: NDArray[np.bool_]) -> float:
        """Return the share of the contact force that the chosen contacts carry."""
        return float(self.forces[mask].sum() / max(float(self.forces.sum()), 1e-9))


def touching(
    hand: GraspingHand, field: SignedDistance, spheres: Floats, clearance: Floats
) -> Contacts:
    """Return at most two contacts per link of a hand that is closed on an object.

    Args:
        hand: the hand.
        field: signed distance of the object.
        spheres: (S, 3) centres of the hand's spheres, object frame [m].
        clearance: (S,) distance of each sphere's skin to the object [m].
    """
    kept: list[int] = []
    for link in np.unique(hand.arrays.sphere_links[clearance < _NEAR]):
        members = np.flatnonzero((hand.arrays.sphere_links == link) & (clearance < _NEAR))
        members = members[np.argsort(clearance[members], kind="stable")]
        kept.append(int(members[0]))
        gap = np.linalg.norm(spheres[members] - spheres[members[0]], axis=1)
        if gap.max() > _APART:
            kept.append(int(members[np.flatnonzero(gap > _APART)[0]]))
    centers = spheres[kept].astype(np.float64)
    outward = field.gradient(centers)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    reach = (hand.arrays.sphere_radii[kept] + clearance[kept]).astype(np.float64)
    return Contacts(
        centers - outward * reach[:, None],
        -outward,
        hand.arrays.sphere_links[kept].astype(np.int64),
        np.ones(len(kept)),
    )


def wrench_basis(contacts: Contacts, center: Array, scale: float, friction: float) -> Array:
    """Return unit wrenches (6, 8K) whose mixtures are what K soft finger contacts can exert.

    Args:
        contacts: K contacts; each contributes, with a normal force of 1, six edges of the friction
            cone and a twist of the pad either way.
        center: (3,) point that torques refer to [m].
        scale: length that makes torques comparable with forces [m].
        friction: Coulomb's coefficient.
    """
    normals = contacts.normals
    helper = np.where(np.abs(normals[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    angles = np.arange(6) * (np.pi / 3.0)
    edges = normals[:, None] + friction * (
        np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
    )
    torques = np.cross((contacts.points - center)[:, None], edges) / scale
    arm = np.cross(contacts.points - center, normals)[:, None]
    twists = (arm + PAD * np.array([1.0, -1.0])[:, None] * normals[:, None]) / scale
    pads = np.concatenate([np.repeat(normals[:, None], 2, axis=1), twists], axis=2)
    cones = np.concatenate([edges, torques], axis=2)
    return np.asarray(np.concatenate([cones, pads], axis=1).reshape(-1, 6).T)


def gravity_residual(
    contacts: Contacts,
    center: Array,
    scale: float,
    friction: float,
    weight: float,
    enough: float = 1.0,
    strength: float = 60.0,
) -> float:
    """Return the largest share of its weight, over six directions, that the contacts cannot hold.

    0: gravity from any side can be held with the hand's strength; at least 0.3: it needs more.

    Args:
        contacts: the contacts.
        center: (3,) centre of mass [m].
        scale: length that makes torques comparable with forces [m].
        friction: Coulomb's coefficient.
        weight: the object's weight [N].
        enough: stop at the first direction whose share is above this.
        strength: sum of the normal forces that the hand can exert [N].
    """
    if len(contacts.points) < 2:
        return 1.0
    basis = wrench_basis(contacts, center, scale, friction)
    worst = 0.0
    for direction in _DIRECTIONS:
        weights, residual = nnls(basis, np.concatenate([-direction, np.zeros(3)]))
        excess = 0.3 if weight * weights.sum() > strength else 0.0
        worst = max(worst, float(residual), excess)
        if worst > enough:
            break
    return worst


def holding_force(contacts: Contacts, wrench: Array, center: Array, friction: float) -> float:
    """Return the least sum of normal forces [N] that balances a wrench; inf if none does.

    Solved as one non-negative least squares problem: the balance weighs 1000 times more than the
    square of the sum, which has the same minimum as the linear programme up to a thousandth.

    Args:
        contacts: the contacts.
        wrench: (6,) external force [N] and torque about `center` [N m].
        center: (3,) point that torques refer to [m].
        friction: Coulomb's coefficient.
    """
    scale, weight = 0.1, 1000.0
    if len(contacts.points) == 0:
        return float("inf")
    basis = wrench_basis(contacts, center, scale, friction)
    target = -np.concatenate([wrench[:3], wrench[3:] / scale])
    rows = np.concatenate([weight * basis, np.ones((1, basis.shape[1]))])
    forces, _ = nnls(rows, np.append(weight * target, 0.0))
    missing = float(np.linalg.norm(basis @ forces - target))
    return float(forces.sum()) if missing < 0.02 * np.linalg.norm(target) else float("inf")


def opposed(hand: GraspingHand, contacts: Contacts) -> bool:
    """Return whether two parts of the hand (fingers, palm) press against each other."""
    groups = finger_of_links(hand)[contacts.links]
    facing = contacts.normals @ contacts.normals.T < -0.25
    return bool(np.any(facing & (groups[:, None] != groups)))


def finger_of_links(hand: GraspingHand) -> NDArray[np.int64]:
    """Return the finger (L,) that each link belongs to; -1 for the palm."""
    fingers = np.searchsorted(
        hand.arrays.chain_starts, np.arange(len(hand.arrays.parents)), side="right"
    )
    return np.asarray(fingers - 1, dtype=np.int64)


def moved(contacts: Contacts, T_b_a: Array) -> Contacts:
    """Return the contacts of frame a in frame b."""
    return Contacts(
        transform_points(T_b_a, contacts.points),
        contacts.normals @ T_b_a[:3, :3].T,
        contacts.links,
        contacts.forces,
    )
