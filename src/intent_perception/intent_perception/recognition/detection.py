"""Detection of known objects in one RGB-D frame (Sec. III-A): hypothesise, verify, select."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.recognition.candidates import PoseJudge
from intent_perception.recognition.confidence import confidence, features_of
from intent_perception.recognition.conflict import (
    PixelEvidence,
    explained_by,
    gains,
    quality_of,
    select,
)
from intent_perception.recognition.estimation.shape_estimator import (
    EstimatedShape,
    estimated_shapes,
)
from intent_perception.recognition.estimation.thing_gate import contradicted, left_over
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.proposal.pair_hypotheses import pair_iterations, sample_pairs
from intent_perception.recognition.proposal.pose_slots import Slots
from intent_perception.recognition.proposal.proposal_arrays import SceneArrays
from intent_perception.recognition.proposal.table_prior import sample_resting
from intent_perception.recognition.verification.explanation import DRAWN, MATCH
from intent_perception.scene.oriented_image import OrientedImage, orient
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import Segmentation, segment
from intent_perception.scene.table_plane import TablePlane
from intent_perception.scene.table_search import find_table

_COARSE = 1.7  # the first stage allows for the error of a single pair
_SELECTIONS = 3
_USUAL_MODELS = 6  # in a larger library each pair or point is looked up more often,
_GROWTH = 0.3  # by this power of its size
_LEFT = 0.5  # of the pixels that an object must explain, what refinement may leave
_ENDS_BEFORE = 5.0
"""Contour pixels on which an object is taken to end before any is looked at. On 80 scenes of seed
500 neither 0.5 nor the share itself in place of its square changes an answer."""
_SHARPNESS = 3
"""How strongly a poor match weakens a rival. On the same scenes 1 gives the same answers, and a
calibration error of the confidence, which was fitted with 3, of .0129 instead of .0125."""
LIKELY = 0.5
"""From this confidence on an object is taken to be there."""
_MOST_WITHOUT_TABLE = 40_000
"""Pixels on which things in the air are searched for; more are walls, people, a whole room."""
_SLOTS = 3  # poses kept of each model in each image cell


@dataclass(frozen=True)
class DetectorConfig(Checked):
    """Parameters of the detector."""

    focal_length: float = 525.0
    """Images of a longer focal length are reduced to about this one [pixel], 100..2000."""
    max_depth: float = 1.8
    """Measurements beyond are ignored [m], 0.3..100."""
    normal_radius: float = 0.009
    """Half the window in which normals are estimated [m], 0.002..0.1."""
    table_tolerance: float = 0.008
    """Deviation of the table top from a plane [m], 0.001..0.05."""
    table_share: float = 0.15
    """Least share of the image that a table covers, 0..1."""
    success: float = 0.7
    """Probability with which point pairs alone find an object of the assumed share, 0.5..0.9999."""
    assumed_share: float = 0.25
    """Share of all points above the table that lie on such an object, 0.01..1."""
    pair_lookups: int = 120
    """Model pairs tried for each of them, 1..100000."""
    hash_only: bool = False
    """Whether to do without the table prior, as the paper does."""
    resting_points: int = 450
    """Scene points from which resting poses are proposed, 1..100000."""
    resting_lookups: int = 300
    """Resting model points tried for each of them, 1..100000."""
    glance: float = 0.25
    """Share of all these draws in the first look; the second makes all of them on what the first
    leaves open, 0.001..1."""
    sure: float = 0.9
    """Objects of the first look at least this probable are not searched for again, 0..1."""
    refined_per_model: int = 80
    """Hypotheses of each model that are refined on their points, 1..10000."""
    tolerance: float = 0.006
    """Depth difference of a match at 1 m [m], 0.0005..0.1."""
    least_pixels: float = 80.0
    """Pixels an object must explain, 1..100000."""
    least_quality: float = 0.6
    """Least share of the judged pixels that must match, 0..1."""
    estimate: bool = True
    """Whether the shapes of things that are in no database are estimated."""
    seed: int = 0
    """Seed of all random draws, 0..2147483647."""

    @classmethod
    def for_clouds(cls) -> "DetectorConfig":
        """Return the parameters for clouds, in which no direction is up and no table is sought."""
        return cls(table_share=1.0, max_depth=100.0)


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


class _Draws(NamedTuple):
    """How much one look tries."""

    pairs: int
    pair_lookups: int
    resting: int
    resting_lookups: int
    refined_per_model: int

    def reduced(self, share: float) -> "_Draws":
        """Return about this share of all draws: fewer points and pairs, each looked up less."""
        return _Draws(*(max(1, round(count * np.sqrt(share))) for count in self))


def oriented_scene(frame: RgbdFrame, config: DetectorConfig, reduced: int = 1) -> OrientedImage:
    """Return points and normals of a frame, on images smaller by a factor than recognition's."""
    return orient(frame, config.focal_length / reduced, config.normal_radius, config.max_depth)


def table_of(
    image: OrientedImage, config: DetectorConfig, up: Array | None = None
) -> TablePlane | None:
    """Return the table of a scene, None if there is none.

    Args:
        image: the scene.
        config: what a table is.
        up: (3,) the vertical in the camera's frame, None = the scene tells it.
    """
    rng = np.random.default_rng(config.seed)
    return find_table(image, rng, config.table_tolerance, config.table_share, up)


class Detector:
    """The stages of Sec. III-A over one library of models."""

    def __init__(self, library: ModelLibrary, config: DetectorConfig) -> None:
        self.library = library
        self.config = config

    def oriented(self, frame: RgbdFrame) -> OrientedImage:
        """Return points and normals of a frame."""
        return oriented_scene(frame, self.config)

    def table(self, image: OrientedImage, up: Array | None = None) -> TablePlane | None:
        """Return the table of a scene, None if there is none; see `table_of`."""
        return table_of(image, self.config, up)

    def find(self, frame: RgbdFrame) -> Findings:
        """Return all objects of the library in a frame."""
        image = self.oriented(frame)
        *_, last = self.looks(image, self.table(image), None)
        return last

    def looks(
        self,
        image: OrientedImage,
        table: TablePlane | None,
        allowed: NDArray[np.bool_] | None,
        known: Sequence[Detection] = (),
    ) -> Iterator[Findings]:
        """Yield the objects of the library in a scene: after a first look, and complete.

        Most objects are found by a small part of the draws. The rest of them is made on what the
        first look leaves unexplained or doubtful, and all candidates are judged together.

        Args:
            image: the scene.
            table: its table, if it has one.
            allowed: (H, W) pixels that may be objects, None = all.
            known: objects of an earlier frame: those that are still there are not searched for.
        """
        config = self.config
        rng = np.random.default_rng(config.seed)
        scene = SceneView.of(image, segment(image, table, allowed))
        judge = PoseJudge(self.library, scene, config.tolerance, resting=not config.hash_only)
        crowded = int(scene.parts.mask.sum()) > _MOST_WITHOUT_TABLE
        if table is None and crowded and self.config.table_share < 1.0:
            # Nothing stands out: a search among walls and people would take minutes.
            yield Findings((), image, scene.parts, 0, True)
            return
        shapes = self._shapes(scene)
        candidates, made = self._remembered(known, judge), 0
        found, focus = self._judged(scene, judge, candidates)
        for share, complete in ((config.glance, False), (1.0, True)):
            more, extra = self._candidates(scene, focus, rng, share, shapes)
            candidates, made = candidates.joined(more), made + extra
            if len(more.models):
                found, focus = self._judged(scene, judge, candidates)
            kept = self._uncontradicted(found, shapes, scene)
            rest = self._unexplained(kept, shapes, scene, judge) if complete else ()
            yield Findings(kept, image, scene.parts, made, complete, rest)

    def _shapes(self, scene: SceneView) -> list[EstimatedShape]:
        """Return the shapes of all that stands on the table, known or not."""
        table = scene.parts.table
        if table is None or not self.config.estimate:
            return []
        rng = np.random.default_rng(self.config.seed)
        return estimated_shapes(scene, table.T_table_camera(), rng)

    def _uncontradicted(
        self, found: Sequence[Detection], shapes: Sequence[EstimatedShape], scene: SceneView
    ) -> tuple[Detection, ...]:
        """Return the objects but those where an estimated shape of another class fits better."""
        table = scene.parts.table
        if table is None or not shapes:
            return tuple(found)
        models = [self.library.models[one.model] for one in found]
        wrong = contradicted(
            shapes,
            [model.mesh for model in models],
            [model.object_class for model in models],
            [one.T_camera_object for one in found],
            scene,
            table.T_table_camera(),
        )
        return tuple(one for one, no in zip(found, wrong, strict=True) if not no)

    def _unexplained(
        self,
        found: Sequence[Detection],
        shapes: Sequence[EstimatedShape],
        scene: SceneView,
        judge: PoseJudge,
    ) -> tuple[EstimatedShape, ...]:
        """Return the shapes of what no object, more likely right than wrong, explains."""
        table = scene.parts.table
        if table is None or not shapes:
            return ()
        likely = [one for one in found if one.confidence >= LIKELY]
        explained = judge.covered(
            [
                (one.model, self.library.centred_pose(one.model, one.T_camera_object))
                for one in likely
            ]
        )
        rng = np.random.default_rng(self.config.seed)
        return left_over(shapes, scene.without(explained), table.T_table_camera(), rng)

    def _remembered(self, known: Sequence[Detection], judge: PoseJudge) -> Candidates:
        """Return objects of an earlier frame, refined in this one."""
        models = np.array([one.model for one in known], np.int64)
        poses = [self.library.centred_pose(one.model, one.T_camera_object) for one in known]
        refined = np.array(poses, np.float32).reshape(-1, 12)
        return Candidates(models, refined, judge.evidence(models, refined))

    def _judged(
        self, scene: SceneView, judge: PoseJudge, candidates: Candidates
    ) -> tuple[tuple[Detection, ...], SceneView]:
        """Return the objects among candidates, best first, and the scene that they leave open."""
        chosen = self._chosen(scene, judge, candidates)
        found = [self._detection(scene, judge, candidates, chosen, k) for k in range(len(chosen))]
        sure = [one is not None and one.confidence >= self.config.sure for one in found]
        kept = [detection for detection in found if detection is not None]
        ranked = sorted(kept, key=lambda detection: -detection.confidence)
        explained = candidates.explained(chosen[np.array(sure, bool)], scene.shape)
        return tuple(ranked), scene.without(explained) if any(sure) else scene

    def _candidates(
        self,
        scene: SceneView,
        focus: SceneView,
        rng: np.random.Generator,
        share: float = 1.0,
        shapes: Sequence[EstimatedShape] = (),
    ) -> tuple[Candidates, int]:
        """Return the hypotheses worth a decision on the pixels in focus, and how many were made."""
        draws = self._draws(focus, int(scene.parts.mask.sum()), share)
        slots, made = self.generated(focus, rng, draws)
        judge = PoseJudge(self.library, scene, self.config.tolerance, focus)
        models, poses = judge.aligned(*slots.best(draws.refined_per_model), shapes)
        return Candidates(models, poses, judge.evidence(models, poses)), made

    def _draws(self, focus: SceneView, whole: int, share: float) -> "_Draws":
        """Return what to draw from the pixels in focus.

        Args:
            focus: the pixels.
            whole: object pixels of the whole scene: on the rest of it fewer draws do as well.
            share: of all draws.
        """
        config = self.config
        pixels = int(focus.parts.mask.sum())
        part = pixels / max(whole, pixels, 1)
        more = max(1.0, len(self.library) / _USUAL_MODELS) ** _GROWTH  # siblings share their pairs
        hidden = min(1.0, config.assumed_share / max(part, 1e-6))
        return _Draws(
            pair_iterations(config.success, hidden),
            int(config.pair_lookups * more),
            int(config.resting_points * part),
            int(config.resting_lookups * more),
            config.refined_per_model,
        ).reduced(share)

    def generated(
        self, scene: SceneView, rng: np.random.Generator, draws: "_Draws | None" = None
    ) -> tuple[Slots, int]:
        """Return the poses that passed the first stage, and how many were generated.

        Args:
            scene: with the pixels to draw from.
            rng: of the draws.
            draws: how many, None = all.
        """
        library, config = self.library, self.config
        slots = Slots.empty(len(library), *scene.shape, _SLOTS)
        pixels = np.argwhere(scene.parts.mask == 1).astype(np.int64)
        if len(pixels) < config.least_pixels:
            return slots, 0
        draws = draws or self._draws(scene, len(pixels), 1.0)
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

    def _chosen(
        self, scene: SceneView, judge: PoseJudge, candidates: Candidates
    ) -> NDArray[np.int64]:
        """Return the hypotheses that stand together; those in the midst of a surface stand back."""
        config, evidence = self.config, candidates.evidence
        factors = evidence.factors.copy()
        chosen = np.zeros(0, np.int64)
        for _ in range(_SELECTIONS):
            weighted = replace(evidence, factors=factors)
            chosen = select(weighted, scene.shape, config.least_pixels, config.least_quality, 0.5)
            before = factors.copy()
            for k, index in enumerate(chosen):
                explained = candidates.explained(np.delete(chosen, k), scene.shape)
                model = int(candidates.models[index])
                drawing = judge.drawing(model, candidates.poses[index])
                ends, goes_on = drawing.contour(scene, explained, config.tolerance)
                share = (ends + _ENDS_BEFORE) / (ends + goes_on + _ENDS_BEFORE)
                factors[index] = min(factors[index], share**2)
            if np.array_equal(before, factors):
                break
        return chosen

    def _detection(
        self,
        scene: SceneView,
        judge: PoseJudge,
        candidates: Candidates,
        chosen: NDArray[np.int64],
        k: int,
    ) -> Detection | None:
        """Return the k-th chosen hypothesis, turned, refined and with its confidence.

        None if hardly anything that others do not explain is left to it after refinement.
        """
        models, evidence = candidates.models, candidates.evidence
        model = int(models[chosen[k]])
        explained = candidates.explained(np.delete(chosen, k), scene.shape)
        pose, alike = judge.best_turn(model, candidates.poses[chosen[k]].copy(), explained)
        judge.settle(model, pose, final=True)
        drawing = judge.drawing(model, pose)
        worth = drawing.worth(explained)
        if worth < _LEFT * self.config.least_pixels:
            return None
        new = gains(evidence.values, evidence.windows, explained)
        quality = quality_of(evidence.counts) ** _SHARPNESS
        rivals = (new - evidence.contrary) * quality * evidence.factors
        rival = float(np.max(rivals, where=models != model, initial=0.0))
        features = features_of(
            drawing,
            drawing.contour(scene, explained, self.config.tolerance),
            judge.lowest(model, pose, drawing),
            alike,
            worth,
            rival / max(float(rivals[chosen[k]]), 1.0),
            drawing.measures(scene, explained, self.config.tolerance),
        )
        return Detection(
            model,
            self.library.object_pose(model, pose),
            confidence(features),
            float(drawing.counts[MATCH] / max(drawing.counts[DRAWN], 1.0)),
            features,
        )
