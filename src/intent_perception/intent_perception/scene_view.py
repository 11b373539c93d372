"""One scene in the arrays that the recogniser's kernels read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.oriented_image import OrientedImage
from intent_perception.segmentation import Segmentation

Floats = NDArray[np.float32]


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

    @classmethod
    def of(cls, image: OrientedImage, parts: Segmentation) -> "SceneView":
        """Return the view of a segmented image."""
        camera, table = image.camera, parts.table
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
        plane = np.zeros(4) if table is None else np.array([*table.normal, table.offset])
        return cls(image, parts, intrinsics, image.points(), plane.astype(np.float32))

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
