"""The vertical, as an accelerometer at rest tells it: it feels the table's push, straight up."""

import numpy as np

from intent_perception.basics.arrays import Array

_GRAVITY = 9.81
_AT_REST = 0.6  # difference from gravity [m/s^2]; more is motion
_MEMORY = 0.02  # share of each new measurement in the mean


class Gravity:
    """A running mean of what an accelerometer measures while it does not move."""

    def __init__(self) -> None:
        self._mean: Array | None = None

    def add(self, acceleration: Array) -> None:
        """Take a measurement (3,) [m/s²] in the sensor's frame; one in motion counts nothing."""
        length = float(np.linalg.norm(acceleration))
        if not abs(length - _GRAVITY) < _AT_REST:
            return
        if self._mean is None:
            self._mean = np.array(acceleration, dtype=np.float64)
        self._mean += _MEMORY * (acceleration - self._mean)

    @property
    def up(self) -> Array | None:
        """(3,) unit vector in the sensor's frame; None before the first measurement at rest."""
        return None if self._mean is None else self._mean / np.linalg.norm(self._mean)
