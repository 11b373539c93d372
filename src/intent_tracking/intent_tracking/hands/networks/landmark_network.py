"""The key points of a hand in a square of the image: MediaPipe's hand landmarks.

The order of the 21 key points is that of `LANDMARK_NAMES`.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import ColorImage
from intent_tracking.hands.hand_square import HandSquare
from intent_tracking.hands.networks.lite_network import LiteNetwork


@dataclass(frozen=True, eq=False)
class KeyPoints:
    """What the network says about one square."""

    pixels: Array
    """(21, 2) image pixels."""
    depth: Array
    """(21,) how much farther than the wrist, in units of image pixels; rough."""
    shape: Array
    """(21, 3) the hand in metres, as seen along the optical axis: x right, y down, z forward."""
    presence: float
    """Probability that there is a hand in the square."""
    right: float
    """Probability that it is a right hand."""


class LandmarkNetwork:
    """Reads key points."""

    def __init__(self, name: str) -> None:
        """Load `hand_landmark_lite` or `hand_landmark_full`; ValueError as `LiteNetwork`."""
        self._network = LiteNetwork(name, ((63,), (1,), (1,), (63,)))

    def read(self, color: ColorImage, square: HandSquare) -> KeyPoints:
        """Return the key points in a square of an image (H, W, 3) RGB."""
        size = self._network.size
        values, presence, right, world = self._network(square.cut(color, size))
        points = values.astype(np.float64).reshape(21, 3)
        shape = world.astype(np.float64).reshape(21, 3)
        shape[:, :2] = shape[:, :2] @ square.rotation.T  # the square's axes to the camera's
        return KeyPoints(
            square.to_image(points[:, :2], size),
            points[:, 2] * (square.side / size),
            shape,
            float(presence[0]),
            float(right[0]),
        )
