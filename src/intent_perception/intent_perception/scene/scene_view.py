"""One scene in the arrays that the recogniser's kernels read."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.segmentation import Segmentation

_EXPLAINED = 0.2  # evidence above which a pixel belongs to an object
_BENT = 0.02  # largest error of the table plane [m]
_LEAST_BARE = 50
_SMALLEST = 60  # fewer connected pixels left over are the rim of an object


@dataclass(frozen=True, eq=False)
class SceneView:
    """An oriented image and its segmentation, ready for kernels."""

    image: OrientedImage
    """Points and normals."""
    parts: Segmentation
    """Which of them may be objects."""
    intrinsics: Floats
    """(4,) fx, fy, cx, cy."""
    points: Floats
    """(H, W, 3) in the camera frame [m]."""
    plane: Floats
    """(4,) normal and offset of the table, zero without one."""

    bare: NDArray[np.float64]
    """(2, H + 1, W + 1) sums over all pixels above and to the left: how many show the bare table,
    and their heights [m]."""

    @classmethod
    def of(cls, image: OrientedImage, parts: Segmentation) -> "SceneView":
        """Return the view of a segmented image."""
        camera, table = image.camera, parts.table
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
        plane = np.zeros(4) if table is None else np.array([*table.normal, table.offset])
        bare = (parts.mask == 0) & (np.abs(parts.height) < _BENT) & (parts.height != 0.0)
        sums = np.stack(
            [
                cv2.integral(values, sdepth=cv2.CV_64F)
                for values in (bare.astype(np.float32), np.where(bare, parts.height, 0.0))
            ]
        )
        return cls(image, parts, intrinsics, image.points(), plane.astype(np.float32), sums)

    def table_height(self, left: int, top: int, right: int, bottom: int) -> float:
        """Return the mean height of the bare table in a window [m], 0 where too little is seen.

        Depth cameras bend planes by centimetres towards the image's corners.
        """
        height, width = self.shape
        right, bottom = min(right, width), min(bottom, height)
        corners = self.bare[:, [top, bottom, top, bottom], [left, right, right, left]]
        count, total = corners @ np.array([1.0, 1.0, -1.0, -1.0])
        return float(total / count) if count > _LEAST_BARE else 0.0

    def without(self, explained: Floats) -> "SceneView":
        """Return the scene whose object pixels are those that nothing explains (H, W) so far."""
        taken = cv2.dilate((explained > _EXPLAINED).astype(np.uint8), np.ones((3, 3), np.uint8))
        mask = ((self.parts.mask == 1) & (taken == 0)).astype(np.uint8)
        _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
        large = stats[:, cv2.CC_STAT_AREA] >= _SMALLEST
        large[0] = False
        return replace(self, parts=replace(self.parts, mask=large[labels].astype(np.uint8)))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the images."""
        return self.image.depth.shape[0], self.image.depth.shape[1]

    @property
    def surface(self) -> tuple[Floats, Floats, NDArray[np.uint8], Floats]:
        """Smoothed depth, normals, mask and intrinsics, as most kernels take them."""
        return self.image.smooth, self.image.normals, self.parts.mask, self.intrinsics

    @property
    def measured(self) -> tuple[Floats, Floats, NDArray[np.uint8], Floats]:
        """Depth as measured, normals, mask and intrinsics."""
        return self.image.depth, self.image.normals, self.parts.mask, self.intrinsics
