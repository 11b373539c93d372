"""How many numbers a state has, and where each body's stand: 26 of the hand, 6 of each object."""

JOINTS = 20
HAND_SIZE = 6 + JOINTS
OBJECT_SIZE = 6
FINGER_CAPSULES = 15
CAPSULES = FINGER_CAPSULES + 9
"""Capsules of a hand: three of each finger, then those of the palm."""


def state_size(objects: int) -> int:
    """Return the number of values of a hand and some objects."""
    return HAND_SIZE + OBJECT_SIZE * objects


def object_start(k: int) -> int:
    """Return where the values of object k begin."""
    return HAND_SIZE + OBJECT_SIZE * k


def body_start(body: int) -> int:
    """Return where the values of the hand (0) or of object body - 1 begin."""
    return 0 if body == 0 else object_start(body - 1)
