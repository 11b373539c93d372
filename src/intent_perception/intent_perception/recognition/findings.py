"""What the detector says: candidates with their evidence, objects found, and all of one frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.recognition.conflict import PixelEvidence, explained_by
from intent_perception.recognition.estimation.shape_estimator import EstimatedShape
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.segmentation import Segmentation


@dataclass(frozen=True, eq=False)
class Detection:
    """An object found, in the camera frame, with what speaks for it."""

    model: int
    """Number in the library."""
    T_camera_object: Array
    """(4, 4)."""
    confidence: float
    """Probability that it is right."""
    visible_fraction: float
    """Share of its silhouette that is seen."""
    features: Floats
    """What the confidence is computed from."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """N refined hypotheses and their evidence."""

    models: NDArray[np.int64]
    """(N,) numbers in the library."""
    poses: Floats
    """(N, 12)."""
    evidence: PixelEvidence
    """What they say about the pixels."""

    def joined(self, other: "Candidates") -> "Candidates":
        """Return these and others."""
        return Candidates(
            np.concatenate([self.models, other.models]),
            np.concatenate([self.poses, other.poses]),
            self.evidence.joined(other.evidence),
        )

    def explained(self, chosen: NDArray[np.int64], shape: tuple[int, int]) -> Floats:
        """Return the best evidence (H, W) that some of them give for each pixel."""
        evidence = self.evidence
        explained: Floats = explained_by(evidence.values, evidence.windows, chosen, shape)
        return explained


@dataclass(frozen=True, eq=False)
class Findings:
    """Everything that recognition says about one frame."""

    detections: tuple[Detection, ...]
    """Best first."""
    image: OrientedImage
    """The scene as it was seen."""
    segmentation: Segmentation
    """Its parts."""
    hypotheses: int
    """How many were generated."""
    complete: bool
    """Whether everything in the scene has been looked at as closely as it will be."""
    shapes: tuple[EstimatedShape, ...] = ()
    """Of what none of them explains, in the frame `table`; empty until the answer is complete."""
