"""Whether a scene differs from the one that was answered: a few milliseconds on small images.

Most frames show what the last one showed, or a hand over it. Both are told from a reduced depth
image; only a scene that has changed, with no hand near its objects, is worth a recognition.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from intent_perception.bags.frame_assembly import NANOSECONDS
from intent_perception.basics.arrays import Array, Floats, Mask
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import transform_points
from intent_perception.recognition.detector_config import DetectorConfig, oriented_scene, table_of
from intent_perception.scene.arm_pixels import ArmConfig, arm_pixels
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.table_plane import TablePlane

_REDUCED = 2
"""The images looked at are smaller than those of a recognition by this factor."""
_SKETCH = 4
"""Of the sensor's rows and columns, one in so many is compared first."""


@dataclass(frozen=True)
class ChangeConfig(Checked):
    """What counts as a change."""

    hand_distance: float = 0.10
    """A hand this near an object holds the answer [m], 0..1."""
    edge: float = 0.03
    """Changes this near the table's edge do not count: the demonstrator sits there [m], 0..1."""
    pixels: int = 150
    """Pixels that differ from the last answer's scene when it is looked at again, 1..100000."""
    depth: float = 0.012
    """Difference in depth that counts as a change [m], 0.001..0.1."""
    still: float = 0.2
    """A changed scene is looked at once nothing has moved in it for this long [s], 0..10."""


class SceneMemory:
    """The scene of the last answer."""

    def __init__(self, config: ChangeConfig, arm: ArmConfig, detection: DetectorConfig) -> None:
        self._config, self._detection = config, detection
        area = _REDUCED**2
        inside, outside = arm.inside_pixels // area, arm.outside_pixels // area
        self._arm = replace(arm, inside_pixels=max(inside, 1), outside_pixels=max(outside, 1))
        self.forget()

    def forget(self) -> None:
        """Know no scene."""
        self._seen: Floats | None = None
        self._up: Array | None = None
        self._sketch: Floats | None = None
        self._moved: tuple[int, Floats] | None = None

    def keep(self, frame: RgbdFrame, up: Array | None = None) -> None:
        """Take the scene of an answer; arms in it are no part of it.

        Args:
            frame: that was answered.
            up: (3,) the vertical in the camera's frame, None = the scene tells it.
        """
        image = oriented_scene(frame, self._detection, _REDUCED)
        self._up = up
        arm = arm_pixels(image, table_of(image, self._detection, up), self._arm)
        self._seen = np.where(arm, np.float32(0.0), image.smooth)
        self._sketch = _sketched(frame)

    def differs(self, frame: RgbdFrame, centers: Array, reaches: Array) -> bool:
        """Return whether a frame shows another scene that no hand is about to change again.

        Args:
            frame: the present one.
            centers: (N, 3) of the answer's objects in the camera's frame [m].
            reaches: (N,) half of their diameters [m].
        """
        sketch = _sketched(frame)
        if self._seen is None or not self._differ(sketch, self._sketch):
            return False
        if self._moved is None or self._differ(sketch, self._moved[1]):
            self._moved = frame.stamp, sketch
        if frame.stamp - self._moved[0] < self._config.still * NANOSECONDS:
            return False
        image = oriented_scene(frame, self._detection, _REDUCED)
        table = table_of(image, self._detection, self._up)
        if table is None:
            return False
        arm = arm_pixels(image, table, self._arm)
        return not self._held(image, arm, centers, reaches) and self._changed(image, table, arm)

    def _differ(self, now: Floats, before: Floats | None) -> bool:
        """Return whether raw measurements differ on more than noise would."""
        if before is None or before.shape != now.shape:
            return True
        differs = (now > 0.0) & (before > 0.0) & (np.abs(now - before) > self._config.depth)
        return int(_steady(differs).sum()) * _SKETCH**2 > self._config.pixels

    def _held(self, image: OrientedImage, arm: Mask, centers: Array, reaches: Array) -> bool:
        """Return whether an arm is near any object of the answer."""
        points = image.points()[arm][::3].astype(np.float64)
        if len(points) == 0 or len(centers) == 0:
            return False
        gaps = np.linalg.norm(points[:, None] - centers, axis=2).min(axis=0) - reaches
        return bool(np.any(gaps < self._config.hand_distance))

    def _changed(self, image: OrientedImage, table: TablePlane, arm: Mask) -> bool:
        """Return whether the scene differs from the one of the answer in more than noise."""
        assert self._seen is not None
        if self._seen.shape != image.smooth.shape:
            return True
        near_arm = cv2.dilate(arm.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
        both = (self._seen > 0.0) & (image.smooth > 0.0) & ~near_arm
        both &= table.inset(image.points()) > self._config.edge
        differs = both & (np.abs(self._seen - image.smooth) > self._config.depth)
        return int(_steady(differs).sum()) * _REDUCED**2 > self._config.pixels


def centers_of(T_camera_objects: Array, centers: Array) -> Array:
    """Return the placed centres (N, 3) of objects at poses (N, 4, 4)."""
    placed = [transform_points(T, c) for T, c in zip(T_camera_objects, centers, strict=True)]
    return np.reshape(placed, (-1, 3))


def _sketched(frame: RgbdFrame) -> Floats:
    return np.ascontiguousarray(frame.depth[_SKETCH // 2 :: _SKETCH, _SKETCH // 2 :: _SKETCH])


def _steady(differs: Mask) -> Mask:
    """Return the pixels whose four neighbours differ as well: single ones at edges flicker."""
    steady = differs[1:-1, 1:-1] & differs[:-2, 1:-1] & differs[2:, 1:-1]
    return np.asarray(steady & differs[1:-1, :-2] & differs[1:-1, 2:])
