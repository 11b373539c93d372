"""What the refinement knows of one frame and of the scene before it looks."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_tracking.scene.posture_prior import Posture


class Labelled(NamedTuple):
    """The observed tile with every pixel's body."""

    depth: Floats
    """(S, S) [m], 0 = missing."""
    hand: Floats
    """(S, S) 1 where the hand is seen."""
    thing: Floats
    """(S, S) 1 where a tracked object is seen."""
    valid: Floats
    """(S, S) 0 where nothing can be said: missing depth, forearm."""
    sure: Floats
    """(S, S) 0 on the silhouettes' edges, whose width says nothing about the pose."""
    u0: np.float32
    v0: np.float32
    step: np.float32


class KeyEvidence(NamedTuple):
    """Where 21 key points of the hand are seen, in the order of the contract's joints."""

    rays: Floats
    """(21, 2) x / z and y / z of their lines of sight."""
    weights: Floats
    """(21,) of each against one observed point, 0 = not seen."""
    offsets: Floats
    """(21, 3) key point minus joint in `hand_wrist` [m]."""


NO_KEYS = KeyEvidence(
    np.zeros((21, 2), np.float32), np.zeros(21, np.float32), np.zeros((21, 3), np.float32)
)
"""Nothing is said about any."""


class FrameEvidence(NamedTuple):
    """One frame as the refinement sees it, in the camera's frame."""

    hand_points: Floats
    """(3, N) [m]."""
    object_points: Floats
    """(3, M) [m]."""
    object_owners: NDArray[np.int64]
    """(M,) which of the K objects each point belongs to."""
    depth: Floats
    """(S, S) observed depth on the tile, 0 = missing [m]."""
    outside: Floats
    """(S, S) distance to the silhouette of hand and objects, 0 within it [pixels]."""
    u0: np.float32
    """x / z of the first column."""
    v0: np.float32
    """y / z of the first row."""
    step: np.float32
    """x / z per pixel."""
    keys: KeyEvidence = NO_KEYS


class Weights(NamedTuple):
    """Weights of the terms, relative to one observed point."""

    scale: np.float32
    """s of rho_s [m]."""
    silhouette: np.float32
    front: np.float32
    penetration: np.float32
    touch: np.float32
    limit: np.float32
    """[m^2 / rad^2], as the next three."""
    angle: np.float32
    """Joint angles against their prediction."""
    dip: np.float32
    synergy: np.float32
    posture: np.float32
    """Squared Mahalanobis distance of the posture from the usual ones [m^2]."""
    key: np.float32
    """Of key points, each of which has a weight of its own."""
    hand_place: np.float32
    """Hand position against its prediction (no unit)."""


class Prior(NamedTuple):
    """What the refinement expects before it looks."""

    state: Floats
    """(26 + 6 K,) predicted state; [3:6] of each body unused."""
    rotations: Floats
    """(1 + K, 3, 3) predicted rotations."""
    limits: Floats
    """(20, 2) [rad]."""
    posture: Posture
    touch: Floats
    """(K,) factor on the attraction of hidden fingers to each object."""
    place: Floats
    """(K,) weight of each object's predicted position."""
    turn: Floats
    """(K,) weight of each object's predicted rotation [m^2 / rad^2]."""
