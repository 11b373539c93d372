"""Poses drawn at random, at most so many: of resting objects and from point pairs (Sec. III-A)."""

from dataclasses import dataclass

import numpy as np

from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.proposal.pair_hypotheses import pair_iterations, sample_pairs
from intent_perception.recognition.proposal.pose_slots import Slots
from intent_perception.recognition.proposal.proposal_arrays import SceneArrays
from intent_perception.recognition.proposal.table_prior import sample_resting
from intent_perception.scene.scene_view import SceneView

_COARSE = 1.7  # the first stage allows for the error of a single pair
_USUAL_MODELS = 6  # in a larger library each pair or point is looked up more often,
_GROWTH = 0.3  # by this power of its size
_SLOTS = 3  # poses kept of each model in each image cell


@dataclass(frozen=True)
class Draws:
    """How much one look tries."""

    pairs: int
    """Pairs of scene points."""
    pair_lookups: int
    """Model pairs tried for each."""
    resting: int
    """Scene points from which resting poses are proposed."""
    resting_lookups: int
    """Resting model points tried for each."""
    refined_per_model: int
    """Poses of each model that go on to the next stage."""

    @classmethod
    def of(
        cls, config: DetectorConfig, models: int, pixels: int, whole: int, share: float = 1.0
    ) -> "Draws":
        """Return what to draw.

        Args:
            config: of the detector.
            models: in the library.
            pixels: drawn from.
            whole: object pixels of the whole scene: on a part of it fewer draws do as well.
            share: of all draws: fewer points and pairs, each looked up less.
        """
        part = pixels / max(whole, pixels, 1)
        more = max(1.0, models / _USUAL_MODELS) ** _GROWTH  # siblings share their pairs
        hidden = min(1.0, config.assumed_share / max(part, 1e-6))
        counts = (
            pair_iterations(config.success, hidden),
            int(config.pair_lookups * more),
            int(config.resting_points * part),
            int(config.resting_lookups * more),
            config.refined_per_model,
        )
        return cls(*(max(1, round(count * np.sqrt(share))) for count in counts))


def drawn_poses(
    scene: SceneView,
    library: ModelLibrary,
    config: DetectorConfig,
    draws: Draws,
    rng: np.random.Generator,
) -> tuple[Slots, int]:
    """Return the poses that passed the first stage, and how many were generated.

    Args:
        scene: with the pixels to draw from.
        library: the models.
        config: of the detector.
        draws: how many.
        rng: of the draws.
    """
    slots = Slots.empty(len(library), *scene.shape, _SLOTS)
    pixels = np.argwhere(scene.parts.mask == 1).astype(np.int64)
    if len(pixels) < config.least_pixels:
        return slots, 0
    tolerance = config.tolerance * _COARSE
    view = SceneArrays(scene.points, *scene.surface, scene.plane)
    made = 0
    if scene.parts.table is not None and not config.hash_only:
        some = rng.choice(len(pixels), min(draws.resting, len(pixels)), replace=False)
        made += sample_resting(
            draws.resting_lookups,
            rng,
            pixels[np.sort(some)],
            view,
            scene.parts.table.T_table_camera().astype(np.float32),
            library.resting,
            library.arrays,
            slots.arrays,
            tolerance,
        )
    made += sample_pairs(
        draws.pairs,
        draws.pair_lookups,
        rng,
        pixels,
        view,
        library.pairs.arrays,
        library.arrays,
        slots.arrays,
        tolerance,
    )
    return slots, int(made)
