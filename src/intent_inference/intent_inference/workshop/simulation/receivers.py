"""Where could another person take this object? Stratified receiver grasps, checked for room."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from intent_inference.grasping.autograsp import Fate, close_hand
from intent_inference.grasping.contacts import gravity_residual, touching
from intent_inference.grasping.grasp_hypotheses import HypothesisSampler, approaches
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.transforms import transform_points

_COUNT = 120
_TRIES = 3000
_PER_STRATUM = 4
"""Grasps kept per direction and place: no side of the object counts more because it is easy."""


@dataclass(frozen=True, eq=False)
class ReceiverBank:
    """Receiver grasps of one object."""

    centers: Floats
    """(N, S, 3) spheres of each receiver's hand and forearm, object frame [m]."""
    radii: Floats
    """(S,) [m]."""

    def free_share(self, centers: Array, radii: Array, gap: float) -> float:
        """Return the share of receivers that stay `gap` [m] away from a hand's spheres.

        Args:
            centers: (M, 3) spheres of the giver's hand and forearm [m].
            radii: (M,) [m].
            gap: distance to keep [m].
        """
        if len(self.centers) == 0:
            return 0.0
        free = _count_free(
            self.centers,
            self.radii,
            centers.astype(np.float32),
            radii.astype(np.float32),
            np.float32(gap),
        )
        return float(free) / len(self.centers)


def with_forearm(
    hand: GraspingHand, T_object_hand: Array, spheres: NDArray[Any]
) -> tuple[Array, Array]:
    """Return spheres of hand and forearm in the object frame: centres (S, 3), radii (S,) [m]."""
    direction = np.array([-1.0, 0.0, 0.0] if hand.is_human else [0.0, 0.0, -1.0])
    radius = 0.028 if hand.is_human else 0.045
    arm = transform_points(T_object_hand, np.arange(1, 9)[:, None] * 0.02 * direction)
    centers = np.concatenate([np.asarray(spheres, dtype=np.float64), arm])
    return centers, np.concatenate([hand.arrays.sphere_radii, np.full(len(arm), radius)])


@lru_cache(maxsize=64)
def receiver_bank(target: TaskObject, handle_share: float) -> ReceiverBank:
    """Return the receivers of an object: human grasps that hold it, a tool by its handle.

    Args:
        target: the object.
        handle_share: a tool is taken with at least this share of the contacts on the handle.
    """
    hand = _receiver()
    rng = np.random.default_rng(7)
    choices = [
        choice
        for choice in approaches(target.geometry.boxes, hand)
        if choice.preshape.name in ("power", "precision")
    ]
    placed: list[Array] = []
    strata: dict[tuple[int, ...], int] = {}
    functions = target.model.functions
    tool = functions is not None and functions.opening is None and bool(functions.handle)
    radii = np.zeros(0)
    sampler = (
        HypothesisSampler(choices, hand, target.extent, target.center_of_mass, rng)
        if choices
        else None
    )
    for _ in range(_TRIES if sampler else 0):
        assert sampler is not None
        _, hypothesis = sampler.draw()
        fate, grasp = close_hand(hand, target.field, hypothesis)
        if fate is not Fate.CLOSED or grasp is None:
            continue
        stratum = _stratum(target, grasp.T_object_hand)
        if strata.get(stratum, 0) >= _PER_STRATUM:
            continue
        contacts = touching(hand, target.field, grasp.spheres, grasp.clearance)
        if tool and (target.handle_share(contacts) or 0.0) < handle_share:
            continue
        if (
            gravity_residual(contacts, target.center_of_mass, target.reach, 0.8, target.weight)
            > 0.25
        ):
            continue
        strata[stratum] = strata.get(stratum, 0) + 1
        centers, radii = with_forearm(hand, grasp.T_object_hand, grasp.spheres)
        placed.append(centers)
        if len(placed) == _COUNT:
            break
    return ReceiverBank(
        np.array(placed, dtype=np.float32).reshape(len(placed), -1, 3), radii.astype(np.float32)
    )


@lru_cache(maxsize=1)
def _receiver() -> GraspingHand:
    return GraspingHand.load("human")


def _stratum(target: TaskObject, T_object_hand: Array) -> tuple[int, ...]:
    """Return a coarse cell of where the hand comes from and where its fingers point."""
    palm = transform_points(T_object_hand, np.array([0.08, 0.0, 0.03])) - target.geometry.center
    place = np.rint(palm / 0.06).astype(int)
    fingers = np.rint(1.2 * T_object_hand[:3, 0]).astype(int)
    return (*map(int, place), *map(int, fingers))


@nb.njit(cache=True, fastmath=True, error_model="numpy")
def _count_free(
    receivers: Floats, receiver_radii: Floats, centers: Floats, radii: Floats, gap: float
) -> int:
    """Count the receivers none of whose spheres comes within `gap` of a sphere of the hand."""
    low = np.full(3, np.float32(1e9))
    high = np.full(3, np.float32(-1e9))
    for j in range(centers.shape[0]):
        for k in range(3):
            low[k] = min(low[k], centers[j, k] - radii[j] - gap)
            high[k] = max(high[k], centers[j, k] + radii[j] + gap)
    free = 0
    for receiver in range(receivers.shape[0]):
        hit = False
        for i in range(receivers.shape[1]):
            near = True
            for k in range(3):
                x, r = receivers[receiver, i, k], receiver_radii[i]
                near &= low[k] - r < x < high[k] + r
            if not near:
                continue
            for j in range(centers.shape[0]):
                reach = receiver_radii[i] + radii[j] + gap
                square = np.float32(0.0)
                for k in range(3):
                    square += (receivers[receiver, i, k] - centers[j, k]) ** 2
                if square < reach * reach:
                    hit = True
                    break
            if hit:
                break
        if not hit:
            free += 1
    return free
