"""Detection of known objects in one RGB-D frame (Sec. III-A): hypothesise, verify, select."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.recognition.candidates import MOST_AT_FIRST, MOST_LATER, PoseJudge
from intent_perception.recognition.confidence import confidence, features_of
from intent_perception.recognition.conflict import gains, quality_of, select
from intent_perception.recognition.detector_config import (
    DetectorConfig,
    oriented_scene,
    table_of,
)
from intent_perception.recognition.estimation.shape_estimator import (
    EstimatedShape,
    estimated_shapes,
)
from intent_perception.recognition.estimation.thing_gate import (
    contradicted,
    left_over,
    settled,
)
from intent_perception.recognition.findings import Candidates, Detection, Findings
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.proposal.pose_draws import Draws, drawn_poses
from intent_perception.recognition.verification.explanation import DRAWN, MATCH
from intent_perception.scene.oriented_image import OrientedImage
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.scene.table_plane import TablePlane

_SELECTIONS = 3
_LEFT = 0.5  # of the pixels that an object must explain, what refinement may leave
_ENDS_BEFORE = 5.0
"""Contour pixels on which an object is taken to end before any is looked at. On 80 scenes of seed
500 neither 0.5 nor the share itself in place of its square changes an answer."""
_SHARPNESS = 3
"""How strongly a poor match weakens a rival. On the same scenes 1 gives the same answers, and a
calibration error of the confidence, which was fitted with 3, of .0129 instead of .0125."""
LIKELY = 0.5
"""From this confidence on an object is taken to be there."""
_HINT = 0.02
"""From this confidence on an object may be there."""
_MOST_WITHOUT_TABLE = 40_000
"""Pixels on which things in the air are searched for; more are walls, people, a whole room."""


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
            if not complete:
                focus = self._unsettled(found, shapes, focus, judge)
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

    def _unsettled(
        self,
        found: Sequence[Detection],
        shapes: Sequence[EstimatedShape],
        focus: SceneView,
        judge: PoseJudge,
    ) -> SceneView:
        """Return what to look at once more: not things, seen whole, that look like nothing known.

        Of an object of the library that is seen whole the first look finds at least a hint.
        """
        hints = self._covered([one for one in found if one.confidence >= _HINT], judge)
        return focus if not shapes else focus.without(settled(shapes, hints))

    def _covered(self, found: Sequence[Detection], judge: PoseJudge) -> Floats:
        """Return 1 on the pixels (H, W) of some objects, 0 elsewhere."""
        centred = self.library.centred_pose
        return judge.covered([(o.model, centred(o.model, o.T_camera_object)) for o in found])

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
        explained = self._covered([one for one in found if one.confidence >= LIKELY], judge)
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
        pixels, whole = int(focus.parts.mask.sum()), int(scene.parts.mask.sum())
        draws = Draws.of(self.config, len(self.library), pixels, whole, share)
        slots, made = drawn_poses(focus, self.library, self.config, draws, rng)
        judge = PoseJudge(self.library, scene, self.config.tolerance, focus)
        most = MOST_AT_FIRST if share < 1.0 else MOST_LATER
        models, poses = judge.aligned(*slots.best(draws.refined_per_model), shapes, most)
        return Candidates(models, poses, judge.evidence(models, poses)), made

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
