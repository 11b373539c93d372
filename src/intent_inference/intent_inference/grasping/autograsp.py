"""Closes a hand on an object: approach until contact, then flex every finger until it is stopped.

One call of the kernels in `closing` tries one grasp.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from intent_inference.grasping.closing import measure_spheres, place_spheres, try_grasp
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.sdf import SignedDistance


class Fate(IntEnum):
    """Where a try ended."""

    CLOSED = 0
    START_IN_COLLISION = 1
    MISSED = 2
    PENETRATION = 3
    NO_OPPOSITION = 4
    UNSTABLE = 5
    SHAKEN_OFF = 6
    ACCEPTED = 7
    NOT_SHAKEN = 8


@dataclass(frozen=True, eq=False)
class ClosedGrasp:
    """A hand closed on an object."""

    preshape: str
    T_object_hand: Array
    joints: Array
    """(J,) [rad]."""
    closing: Array
    """(J,) relative closing speeds, the direction of the squeeze."""
    spheres: Floats
    """(S, 3) centres of the hand's spheres in the object frame [m]."""
    clearance: Floats
    """(S,) signed distance of each sphere's skin to the object [m]."""


def close_hand(
    hand: GraspingHand, field: SignedDistance, hypothesis: GraspHypothesis
) -> tuple[Fate, ClosedGrasp | None]:
    """Approach and close the hand as the hypothesis says.

    Args:
        hand: the hand.
        field: signed distance of the object, in the object frame.
        hypothesis: start pose, direction and posture.

    Returns:
        Fate.CLOSED and the grasp, or why there is none.
    """
    arrays = hand.arrays
    rotation = hypothesis.T_object_hand[:3, :3].astype(np.float32)
    position = hypothesis.T_object_hand[:3, 3].astype(np.float32)
    joints = hypothesis.joints.astype(np.float32)
    spheres = np.empty((len(arrays.sphere_links), 3), dtype=np.float32)
    clearance = np.empty(len(arrays.sphere_links), dtype=np.float32)
    fate = try_grasp(
        arrays,
        field.values,
        np.asarray(field.origin, dtype=np.float32),
        np.float32(field.spacing),
        rotation,
        position,
        hypothesis.approach.astype(np.float32),
        np.float32(hypothesis.travel),
        joints,
        hypothesis.rates.astype(np.float32),
        spheres,
        clearance,
    )
    if fate != Fate.CLOSED:
        return Fate(fate), None
    pose = hypothesis.T_object_hand.copy()
    pose[:3, 3] = position
    grasp = ClosedGrasp(
        hypothesis.preshape, pose, joints.astype(np.float64), hypothesis.rates, spheres, clearance
    )
    return Fate.CLOSED, grasp


def hand_spheres(hand: GraspingHand, T_object_hand: Array, joints: Array) -> Floats:
    """Return the hand's sphere centres (S, 3) in the object frame [m] for a given posture."""
    arrays = hand.arrays
    spheres = np.empty((len(arrays.sphere_links), 3), dtype=np.float32)
    place_spheres(
        arrays,
        T_object_hand[:3, :3].astype(np.float32),
        T_object_hand[:3, 3].astype(np.float32),
        joints.astype(np.float32),
        spheres,
    )
    return spheres


def sphere_clearance(hand: GraspingHand, field: SignedDistance, spheres: Floats) -> Floats:
    """Return the signed distance (S,) of every sphere's skin to the object [m]."""
    origin = np.asarray(field.origin, dtype=np.float32)
    clearance = np.empty(len(spheres), dtype=np.float32)
    measure_spheres(
        hand.arrays, field.values, origin, np.float32(field.spacing), 0, spheres, clearance
    )
    return clearance
