"""The demonstrator's arm: where elbow and shoulder are for a hand pose, and how awkward that is."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from intent_perception.basics.arrays import Array

_SWIVELS = np.linspace(-np.pi, np.pi, 36, endpoint=False)


@dataclass(frozen=True, eq=False)
class PersonBody:
    """The right half of a person who sits at the table's far side and faces -y; table frame."""

    shoulder: Array
    """(3,) [m]."""
    upper_arm: float
    """Shoulder to elbow [m]."""
    forearm: float
    """Elbow to wrist [m]."""
    edge: float
    """y of the table edge in front of the person [m]."""

    def elbows(self, wrist: Array) -> tuple[Array, Array]:
        """Return possible elbows (K, 3) around the line from shoulder to wrist, and the shoulder.

        The person leans forward where the arm is too short: the shoulder (3,) moves.
        """
        reach = 0.97 * (self.upper_arm + self.forearm)
        offset = wrist - self.shoulder
        distance = float(np.linalg.norm(offset))
        ahead = offset / distance
        shoulder = wrist - ahead * min(distance, reach)
        distance = min(distance, reach)
        a = (self.upper_arm**2 - self.forearm**2 + distance**2) / (2.0 * distance)
        radius = np.sqrt(max(self.upper_arm**2 - a**2, 0.0))
        u = np.cross(ahead, [0.0, 0.0, 1.0])
        u /= np.linalg.norm(u)
        v = np.cross(ahead, u)
        ring = np.cos(_SWIVELS)[:, None] * u + np.sin(_SWIVELS)[:, None] * v
        return shoulder + a * ahead + radius * ring, shoulder

    def costs(self, T_hand: Array) -> Array:
        """Return how awkward each elbow is for a hand pose (4, 4), (K,) about 0 to 10."""
        wrist = T_hand[:3, 3]
        elbow, shoulder = self.elbows(wrist)
        along = wrist - elbow
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        bend = np.arccos(np.clip(along @ T_hand[:3, 0], -1.0, 1.0))
        side = elbow - 0.5 * (shoulder + wrist)
        pole = side @ np.array([-0.65, 0.25, -0.70])
        table = np.maximum(0.0, 0.05 - elbow[:, 2]) * (elbow[:, 1] < self.edge + 0.05)
        chest = np.maximum(0.0, elbow[:, 0] - shoulder[0] - 0.10)
        stiff = bend**2 + 3.0 * np.maximum(0.0, bend - 0.8) ** 2
        cost: Array = stiff + 2.0 * (0.3 - pole) + 60.0 * table + 10.0 * chest
        return cost

    def awkwardness(self, T_hand: Array) -> float:
        """Return the least cost over the elbows, more for a thumb that points down."""
        twist = max(0.0, float(T_hand[2, 1]) - 0.45)  # y of a right hand points away from the thumb
        return float(self.costs(T_hand).min() + 6.0 * twist)

    def arms(self, T_hands: Array) -> tuple[Array, Array]:
        """Return smooth elbows and shoulders (F, 3) of a motion of hand poses (F, 4, 4) [m]."""
        costs = np.array([self.costs(T) for T in T_hands])
        change = np.abs(np.angle(np.exp(1j * (_SWIVELS[:, None] - _SWIVELS)))) ** 2
        best, back = costs[0], []
        for cost in costs[1:]:  # the cheapest way through all frames
            total = best[:, None] + 8.0 * change
            back.append(total.argmin(axis=0))
            best = total.min(axis=0) + cost
        path = [int(best.argmin())]
        for step in reversed(back):
            path.append(int(step[path[-1]]))
        found = [self.elbows(T[:3, 3]) for T in T_hands]
        elbows = np.array([e[i] for (e, _), i in zip(found, reversed(path), strict=True)])
        shoulders = np.array([s for _, s in found])
        smooth = {"axis": 0, "sigma": 2.5, "mode": "nearest"}
        return gaussian_filter1d(elbows, **smooth), gaussian_filter1d(shoulders, **smooth)
