"""A model drawn at a pose, beside the scene: what it explains, and how well it fits there."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.recognition.verification.alternatives import worth_of
from intent_perception.recognition.verification.contour import contour, surface_beyond
from intent_perception.recognition.verification.fit_measures import patch_residual, shape_shown
from intent_perception.scene.scene_view import SceneView

_SPREAD = 0.002  # systematic error of a depth camera [m]


@dataclass(frozen=True, eq=False)
class Drawing:
    """One model at one pose, drawn and compared with the scene."""

    left: int
    """Column of the window's first pixel."""
    top: int
    """Row of the window's first pixel."""
    depth: Floats
    """(h, w) of the model."""
    evidence: Floats
    """(h, w), see `explain`."""
    counts: Floats
    """(COUNTS,)."""
    mismatch: float
    """How much the colour differs from the model's, 0 = not, see `color_mismatch`."""

    def worth(self, explained: Floats) -> float:
        """Return what it adds to what is explained (H, W), less what is against it [pixel]."""
        return float(worth_of(self.evidence, self.left, self.top, explained))

    def contour(self, scene: SceneView, explained: Floats, tolerance: float) -> tuple[int, int]:
        """Return on how many contour pixels the scene ends, and on how many it goes on."""
        image = scene.image
        ends, goes_on = contour(
            self.left,
            self.top,
            self.depth,
            image.depth,
            image.smooth,
            scene.parts.mask,
            explained,
            tolerance,
        )
        return int(ends), int(goes_on)

    def residual(self, scene: SceneView, tolerance: float) -> float:
        """Return `patch_residual` [m]."""
        place = (self.left, self.top, self.depth)
        return float(patch_residual(*place, scene.image.depth, scene.parts.mask, 2.0 * tolerance))

    def closeness(self, scene: SceneView, tolerance: float) -> float:
        """Return how closely the model follows the measured surface, 0..1."""
        return 1.0 / (1.0 + (self.residual(scene, tolerance) / _SPREAD) ** 2)

    def measures(self, scene: SceneView, explained: Floats, tolerance: float) -> Floats:
        """Return residual [mm], surface beyond the outline, and both of `shape_shown` (4,)."""
        image, mask = scene.image, scene.parts.mask
        place = (self.left, self.top, self.depth)
        residual = self.residual(scene, tolerance)
        beyond = surface_beyond(*place, image.smooth, mask, explained, tolerance)
        shown = shape_shown(self.evidence, self.left, self.top, image.normals)
        return np.array([1000.0 * residual, beyond, *shown], np.float32)
