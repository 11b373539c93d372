"""Pictures of hands over the frames they were found in, tiles joined to a sheet."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, ColorImage

TRUE_COLOR, FOUND_COLOR = (60, 210, 60), (250, 60, 40)
"""RGB of the truth and of what the tracker says."""


def with_skeleton(
    image: ColorImage, joints_camera: Array, camera: Camera, color: tuple[int, int, int]
) -> ColorImage:
    """Return the image with a hand of 21 joints (21, 3) [m] drawn in; NaN joints are left out."""
    drawn = image.copy()
    for finger in range(5):
        chain = joints_camera[[0, *range(1 + 4 * finger, 5 + 4 * finger)]]
        chain = chain[np.isfinite(chain[:, 0]) & (chain[:, 2] > 0.05)]
        if len(chain):
            line = np.clip(np.rint(camera.project(chain)), -2000, 4000).astype(np.int32)
            cv2.polylines(drawn, [line], False, color, 2, cv2.LINE_AA)
    return drawn


def captioned(image: ColorImage, text: str, width: int = 320) -> ColorImage:
    """Return the image scaled to a width in pixels with a line of text at its top."""
    height = round(image.shape[0] * width / image.shape[1])
    tile = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    for color, thick in (((0, 0, 0), 3), ((255, 255, 255), 1)):
        cv2.putText(tile, text, (5, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.42, color, thick, cv2.LINE_AA)
    return np.asarray(tile, dtype=np.uint8)


def tiled(rows: Sequence[Sequence[ColorImage]]) -> NDArray[np.uint8]:
    """Return one image of rows of tiles of one size; short rows end in black."""
    longest = max(len(row) for row in rows)
    black = np.zeros_like(rows[0][0])
    full = [np.hstack([*row, *[black] * (longest - len(row))]) for row in rows]
    return np.asarray(np.vstack(full), dtype=np.uint8)
