"""How comfortable a grasp is for people who reach for an object that rests on a table."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_vector, transform_points
from intent_tracking.workshop.person.acting.script import sample_body

_PEOPLE = 6
"""Each reaches from another side."""
_EASE = 2.0
"""Awkwardness at which a grasp is taken by e times fewer people."""
_PALM = np.array([[0.0, 0.0, 0.0], [0.08, 0.0, 0.0]])
"""Wrist and knuckles in the hand's frame [m]."""
_ABOVE = 0.02
"""Wrist and knuckles stay this far above the table [m]."""


class Comfort:
    """Weighs grasps of one object by the arms of some people around a table."""

    def __init__(self, rests: Array, rng: np.random.Generator) -> None:
        """Seat the people.

        Args:
            rests: (N, 4, 4) T_table_object of the ways in which the object rests; z is up.
            rng: source of the people and of where they sit.
        """
        self._rests = rests if len(rests) else np.eye(4)[None]
        turns = rng.uniform(0.0, 2.0 * np.pi) + np.arange(_PEOPLE) * (2.0 * np.pi / _PEOPLE)
        axes = np.array([0.0, 0.0, 1.0]) * turns[:, None]
        poses = make_pose(rotation_from_vector(axes), np.zeros((_PEOPLE, 3)))
        self._people = [(sample_body(rng), turn) for turn in poses]

    def of(self, T_object_hand: Array) -> float:
        """Return the share, 0..1, of the people who would take the object so, as it rests best.

        Args:
            T_object_hand: (4, 4) of a right hand.
        """
        return max(self._at_rest(rest @ T_object_hand) for rest in self._rests)

    def _at_rest(self, T_table_hand: Array) -> float:
        if transform_points(T_table_hand, _PALM)[:, 2].min() < _ABOVE:
            return 0.0
        costs = np.array([body.awkwardness(turn @ T_table_hand) for body, turn in self._people])
        return float(np.exp(-np.maximum(costs, 0.0) / _EASE).mean())
