"""The array types of signatures; shapes, frames and units stand in the docstrings."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
"""Single precision: images and what compiled code computes with."""
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
