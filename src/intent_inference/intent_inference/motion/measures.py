"""Measures of how a held object moves, frame by frame: what the motion network observes.

All are relative to where the object rested and to the person: `out` is horizontal and away from
the person, `across` horizontal and towards the side of the other hand. They are soft-quantised on
fixed, overlapping cells: K states per measure, each frame a share of each.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import vector_from_rotation

MEASURES = (
    "height", "out", "across", "extent", "tilt", "speed", "spin", "rise", "advance", "beats",
    "twist", "other",
)  # fmt: skip
"""Height above rest [m], way out and across [m], horizontal
distance from the person's body [m], turn of the axis that was upright [rad], speed
[m/s], turning speed [rad/s], upward and outward velocity [m/s], reversals of direction in the
last second, of the turn too, and horizontal distance to the nearest other object [m],
NaN without one."""
CENTERS = {
    "height": (0.0, 0.03, 0.08, 0.16, 0.28, 0.42, 0.60),
    "out": (-0.45, -0.25, -0.10, 0.0, 0.10, 0.25, 0.45),
    "across": (-0.50, -0.25, -0.10, 0.0, 0.10, 0.25, 0.50),
    "extent": (0.05, 0.15, 0.25, 0.35, 0.50, 0.65, 0.85),
    "tilt": (0.0, 0.3, 0.7, 1.1, 1.6, 2.3),
    "speed": (0.0, 0.06, 0.2, 0.5, 1.0),
    "spin": (0.0, 0.3, 1.0, 2.5, 5.0),
    "rise": (-0.5, -0.15, 0.0, 0.15, 0.5),
    "advance": (-0.5, -0.15, 0.0, 0.15, 0.5),
    "beats": (0.0, 1.0, 2.0, 4.0),
    "twist": (0.0, 1.0, 2.0, 4.0),
    "other": (0.0, 0.08, 0.16, 0.3),
}
"""Centres of the cells."""
CELLS = tuple(len(CENTERS[name]) for name in MEASURES)
STATES = max(CELLS)
BODY = 0.50
"""The person's body is about this far from where the object rested [m]."""
_SMOOTH = 0.12
"""Time constant of velocities [s]."""
_WINDOW = 1.0
"""Reversals are counted over this long [s]."""
_LEAST_SPEED, _LEAST_SPIN = 0.06, 0.6
"""A reversal goes from beyond one to beyond the other sign of this [m/s], [rad/s]."""


@dataclass(frozen=True, eq=False)
class Person:
    """Where the person is, seen from the object."""

    out: Array
    """(3,) horizontal unit vector away from the person."""
    across: Array
    """(3,) horizontal unit vector towards the side of the other hand."""


def person_of(T_table_hand: Array, came_from: Array | None, side: str) -> Person:
    """Return where the person is: behind the forearm and where the wrist came from.

    Args:
        T_table_hand: (4, 4) at the grasp.
        came_from: (3,) where the wrist was first seen [m]; None: nothing is known.
        side: of the hand.
    """
    out = _unit(T_table_hand[:3, 0])
    if came_from is not None:
        out = out + 0.5 * _unit(T_table_hand[:3, 3] - came_from)
    out = _unit(out)
    if not out.any():
        out = np.array([1.0, 0.0, 0.0])
    left = np.array([-out[1], out[0], 0.0])
    return Person(out, left if side == "right" else -left)


def _unit(direction: Array) -> Array:
    flat = np.array([direction[0], direction[1], 0.0])
    length = float(np.linalg.norm(flat))
    return flat / length if length > 0.05 else np.zeros(3)


class HeldMotion:
    """Measures one held object from frame to frame."""

    def __init__(self, T_table_rest: Array, person: Person) -> None:
        """Begin where the object rested (4, 4), with the person known."""
        self._rest, self._person = T_table_rest.copy(), person
        self._last: tuple[float, Array] | None = None
        self._velocity, self._turning = np.zeros(3), np.zeros(3)
        self._signs = np.zeros(6)
        self._turns: deque[tuple[float, int]] = deque()

    def step(self, second: float, T_table_object: Array, other: float = float("nan")) -> Array:
        """Return the measures (M,) of a frame, in the order of `MEASURES`.

        Args:
            second: stamp [s].
            T_table_object: (4, 4).
            other: horizontal distance to the nearest other object [m], NaN without one.
        """
        if self._last is not None and second > self._last[0]:
            self._advance(second - self._last[0], T_table_object, self._last[1])
        self._last = (second, T_table_object.copy())
        self._count(second)
        way = T_table_object[:3, 3] - self._rest[:3, 3]
        turn = T_table_object[:3, :3] @ self._rest[:3, :3].T
        out, across = self._person.out, self._person.across
        counts = np.zeros(6)
        for _, axis in self._turns:
            counts[axis] += 1.0
        return np.array([
            way[2], way @ out, way @ across, np.hypot(way @ out + BODY, way @ across),
            np.arccos(np.clip(turn[2, 2], -1.0, 1.0)),
            np.linalg.norm(self._velocity), np.linalg.norm(self._turning),
            self._velocity[2], self._velocity @ out, counts[:3].max(), counts[3:].max(), other,
        ])  # fmt: skip

    def _advance(self, elapsed: float, now: Array, before: Array) -> None:
        share = 1.0 - float(np.exp(-elapsed / _SMOOTH))
        velocity = (now[:3, 3] - before[:3, 3]) / elapsed
        turning = vector_from_rotation(now[:3, :3] @ before[:3, :3].T) / elapsed
        self._velocity = self._velocity + share * (velocity - self._velocity)
        self._turning = self._turning + share * (turning - self._turning)

    def _count(self, second: float) -> None:
        level = np.concatenate([self._velocity / _LEAST_SPEED, self._turning / _LEAST_SPIN])
        fresh = np.where(np.abs(level) > 1.0, np.sign(level), self._signs)
        for axis in np.flatnonzero(fresh * self._signs < 0.0):
            self._turns.append((second, int(axis)))
        self._signs = fresh
        while self._turns and self._turns[0][0] < second - _WINDOW:
            self._turns.popleft()


def shares(measures: Array) -> Array:
    """Return how much of each cell a frame's measures (M,) are, (M, STATES); rows sum to one.

    A value between two centres belongs to both; a measure that is NaN gives a row of zeros.
    """
    result = np.zeros((len(MEASURES), STATES))
    for row, name in enumerate(MEASURES):
        value, centers = float(measures[row]), CENTERS[name]
        if value != value:
            continue
        above = 0
        while above < len(centers) and centers[above] <= value:
            above += 1
        if above == 0:
            result[row, 0] = 1.0
        elif above == len(centers):
            result[row, above - 1] = 1.0
        else:
            part = (value - centers[above - 1]) / (centers[above] - centers[above - 1])
            result[row, above - 1], result[row, above] = 1.0 - part, part
    return result
