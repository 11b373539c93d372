"""How human fingers are bent when they reach and grasp: a prior for those that nobody sees.

A Gaussian over the 20 joint angles, learned from simulated human grasps and postures on the way
from an open hand to them. It is wide where seen fingers decide, and carries what goes together:
neighbouring fingers, both outer joints of one finger, thumb against fingers.
"""

from functools import cache
from typing import NamedTuple

from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Floats
from intent_tracking import SHARE

SHIPPED = SHARE / "posture.npz"


class Posture(NamedTuple):
    """A Gaussian over the joint angles."""

    mean: Floats
    """(20,) [rad]."""
    precision: Floats
    """(20, 20) [1 / rad^2]."""


@cache
def shipped_posture() -> Posture:
    """Return the prior that comes with the package."""
    stored = read_arrays(SHIPPED, "posture prior")
    return Posture(stored["mean"], stored["precision"])


def surprise(posture: Posture, angles: Floats) -> float:
    """Return the squared Mahalanobis distance of angles (20,) from the mean."""
    offset = angles - posture.mean
    return float(offset @ posture.precision @ offset)
