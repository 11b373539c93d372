"""What the tracker knows of the hand that it follows before the networks look."""

from dataclasses import dataclass

from intent_perception.basics.arrays import Array


@dataclass(frozen=True, eq=False)
class Expectation:
    """What the tracker knows before a look."""

    middle: Array | None = None
    """(2,) middle of the followed palm in the image [pixels]; None: none is followed."""
    joints: Array | None = None
    """(21, 2) its joints [pixels]."""
    settled: bool = False
    """Fit and networks agree, so that not every frame must be read."""
    trusted: bool = False
    """The joints fit so well that the hand is read where they are."""
    doubted: bool = False
    """They fit so badly that the hand is read with care."""
    objects: Array | None = None
    """(n, 2) where objects are in the image [pixels]."""
    hurried: bool = False
    """Newer frames wait already, so that not every frame is read, nor in many places."""
