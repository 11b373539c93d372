"""One hand of one frame, as the networks see it."""

from dataclasses import dataclass

from intent_perception.basics.arrays import Array
from intent_tracking.hands.hand_square import HandSquare

_MIRRORED = 0.6
"""Difference of probabilities from which a look contradicts what is known of a hand's side."""
PALM = [0, 5, 9, 13, 17]
"""Wrist and knuckles among the 21 joints and key points."""


def certainty(presence: float) -> float:
    """Return the weight of what a network says about a hand of this presence.

    It reads those hands well of which it is sure, and others anyhow: .9 counts two thirds, .7 a
    quarter.
    """
    return float(max(presence, 0.01) ** 4)


@dataclass(frozen=True, eq=False)
class SeenHand:
    """A hand in a colour image."""

    identity: int
    """Number that this hand keeps while it is seen."""
    pixels: Array
    """(21, 2) key points in the order of `LANDMARK_NAMES` [pixels]; some may lie outside."""
    shape: Array
    """(21, 3) the key points of a hand of average size, seen along its line of sight: x right,
    y down, z forward as in the camera's frame [m]."""
    presence: float
    """Probability that there is a hand."""
    right: float
    """Probability that it is a right one: by this look, then by all looks, see `looked`."""
    square: HandSquare
    """Upright around it: where the next frame's key points are read."""
    age: int = 0
    """Frames since it was found."""
    looked: float | None = None
    """Probability that it is a right one by this look alone, where `right` is of all looks."""
    explained: float = 1.0
    """How well a hand explains its key points, 0..1: what no hand explains is read wrongly."""

    @property
    def mirrored(self) -> bool:
        """Whether this look takes it for a hand of the other side: its key points are not its."""
        return self.looked is not None and abs(self.looked - self.right) > _MIRRORED
