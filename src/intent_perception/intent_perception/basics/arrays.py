"""The array types of signatures, and what numpy has only from version 2 on.

Shapes, frames and units stand in the docstrings.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
"""Single precision: images and what compiled code computes with."""
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


def set_bits(words: NDArray[np.uint64]) -> Indices:
    """Return how many bits of each word (N,) are set; numpy.bitwise_count is of numpy 2 only."""
    octets = np.ascontiguousarray(words).view(np.uint8).reshape(len(words), words.itemsize)
    return np.unpackbits(octets, axis=1).sum(axis=1, dtype=np.int64)
