"""What the kernels that draw hypotheses read and write: arrays that travel together."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats, Indices


class SceneArrays(NamedTuple):
    """A scene of H x W pixels."""

    points: Floats
    """(H, W, 3) in the camera frame [m]."""
    depth: Floats
    """(H, W) smoothed depth [m]; with normals, mask and intrinsics as for `support`."""
    normals: Floats
    """(H, W, 3)."""
    mask: NDArray[np.uint8]
    """(H, W)."""
    intrinsics: Floats
    """(4,) fx, fy, cx, cy."""
    plane: Floats
    """(4,) normal and offset of the table, zero without one: nothing reaches far below."""


class ModelArrays(NamedTuple):
    """The surface points of M models, one after the other."""

    points: Floats
    """(P, 3) [m]."""
    normals: Floats
    """(P, 3)."""
    offsets: Indices
    """(M + 1,) where each model's points begin."""
    coarse: Indices
    """(M,) how many of a model's first points the coarse stage uses."""
    axes: Floats
    """(M, 3) symmetry axes, zero without."""


class PairArrays(NamedTuple):
    """The hash table of point pairs."""

    distances: Floats
    """(S,) distances of the pairs that are stored [m]."""
    tolerance: float
    """Of a distance [m]."""
    starts: Indices
    """(S * BINS^3 + 1,) where the entries of each key begin."""
    entries: NDArray[np.uint16]
    """(E, 3) model and two of its points."""


class RestingArrays(NamedTuple):
    """The table of resting points."""

    starts: Indices
    """(heights * tilts + 1,) where the entries of each bin begin."""
    entries: Indices
    """(E, 3) model, row of `poses`, row of the model's points."""
    poses: Floats
    """(R, 12) rotation by rows and translation, object -> table, at x = y = 0."""


class SlotArrays(NamedTuple):
    """The best poses so far; written by the kernels."""

    score: Floats
    """(M, C, K); -1 where the slot is free."""
    pose: Floats
    """(M, C, K, 12) rotation by rows and translation, object -> camera."""
    columns: int
    """Cells per image row."""
