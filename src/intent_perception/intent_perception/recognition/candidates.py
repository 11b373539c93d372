"""Hypotheses worth drawing: held against the depth image pixel by pixel, after refinement."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.geometry.rasterizer import NOTHING
from intent_perception.recognition.conflict import PixelEvidence
from intent_perception.recognition.estimation.shape_estimator import EstimatedShape
from intent_perception.recognition.estimation.thing_gate import (
    ELSEWHERE,
    MISFIT,
    hardly_there,
    things_meant,
)
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.verification.alignment import align
from intent_perception.recognition.verification.alternatives import (
    SPINS,
    turned,
    worth_of_turns,
)
from intent_perception.recognition.verification.color_evidence import color_mismatch
from intent_perception.recognition.verification.drawing import Drawing
from intent_perception.recognition.verification.explanation import COUNTS, draw, explain, settle
from intent_perception.recognition.verification.point_check import support_of_all
from intent_perception.scene.scene_view import SceneView

_ALIGNMENT = np.array([0.016, 0.012, 0.010, 0.008, 0.008], np.float32)
_STEPS = np.array([0.010, 0.007, 0.005], np.float32)  # largest residuals of the refinements [m]
_FINAL_STEPS = np.array([0.006, 0.005, 0.004, 0.004], np.float32)
_ALIGNED_POINTS = 160
_TURNS_REFINED = 3
_EQUAL = 0.005  # turns that explain this much less are as good
_LEAST_SCORE = 0.1
_REGION = 48  # edge of the image regions between which the drawing is shared out [pixel]
_PER_REGION = 36
_PER_MODEL = 3  # in one region
_PER_THING = 24  # of what is known to be one thing, and how large
_PER_UNLIKELY = 8  # of these, of classes that it has not the look of
MOST_AT_FIRST, MOST_LATER = 200, 180
"""In the first look and in the second: what bounds the work in a crowd, or where a whole arm or
room is taken for objects."""
_MOST_PIXELS = 800_000  # that they cover together: near things are large, and fewer are drawn
_CLEAR = 0.3  # evidence of pixels whose colour counts
_LEAST_CONTOUR_FACTOR = 0.85  # neighbours may touch: the contour alone rules nothing out
_LEAST_COLOR_FACTOR = 0.5  # lamps and paints differ: colour alone rules nothing out
_AROUND = 20  # width of the frame in which the table is looked at [pixel]
_TILTED = 0.2  # an object tilted more than this leans on something [rad]
_AS_STABLE = 0.05  # turns that are this much further from a stable pose are as good [rad]
_COVERED = 0.03  # surfaces of one object are no further apart in depth [m]
_BELOW = 0.012  # an object that reaches further into the table is hardly there [m]


class PoseJudge:
    """Draws the models of a library into a scene."""

    def __init__(
        self,
        library: ModelLibrary,
        scene: SceneView,
        tolerance: float,
        focus: SceneView | None = None,
        resting: bool = False,
    ) -> None:
        """Prepare for one scene.

        Args:
            library: the models.
            scene: what drawings are compared with.
            tolerance: of a match at 1 m [m].
            focus: the scene with only those pixels that poses are refined on, None = all.
            resting: whether stable poses settle which of several equal turns it is.
        """
        self._library = library
        self._scene = scene
        self._tolerance = tolerance
        self._focus = focus or scene
        self._resting = resting and scene.parts.table is not None

    def drawing(self, model: int, pose: Floats) -> Drawing:
        """Return a model drawn at a pose (12,)."""
        scene, library = self._scene, self._library
        left, top, depth = draw(
            pose, library.vertices[model], library.faces[model], scene.intrinsics, *scene.shape
        )
        evidence, counts = explain(
            left, top, depth, scene.image.depth, *scene.surface, self._tolerance
        )
        rows, columns = np.nonzero(evidence > _CLEAR)
        seen = scene.image.color[rows + top, columns + left]
        mismatch = color_mismatch(seen, library.colors[model])
        return Drawing(left, top, depth, evidence, counts, mismatch)

    def settle(self, model: int, pose: Floats, final: bool) -> None:
        """Refine a pose (12,) in place; the final time on all pixels as they were measured."""
        mesh = (self._library.vertices[model], self._library.faces[model])
        if final:
            settle(pose, *mesh, *self._scene.measured, _FINAL_STEPS, 1)
        else:
            settle(pose, *mesh, *self._focus.surface, _STEPS, 2)

    def aligned(
        self,
        models: NDArray[np.int64],
        poses: Floats,
        shapes: Sequence[EstimatedShape] = (),
        most: int = MOST_AT_FIRST,
    ) -> tuple[NDArray[np.int64], Floats]:
        """Return the hypotheses worth drawing, aligned to the scene, best first in each region.

        Args:
            models: (N,) numbers.
            poses: (N, 12), which are changed.
            shapes: estimated ones. Hypotheses that are much smaller or larger than the thing at
                their place are not worth drawing.
            most: how many at most.
        """
        library, scene = self._library, self._focus
        surface = (library.points, library.normals, library.offsets)
        align(poses, models, *surface, _ALIGNED_POINTS, *scene.surface, _ALIGNMENT)
        drawn_points = (library.points, library.offsets)
        meant = things_meant(shapes, models, poses, *drawn_points, scene.intrinsics)
        models, poses, meant = (values[meant != MISFIT] for values in (models, poses, meant))
        classes = [library.models[model].object_class for model in models]
        hardly = hardly_there(shapes, meant, classes)
        score, match = support_of_all(
            poses, models, *surface, *scene.surface, self._tolerance, 0.6
        ).T
        # both a well matching and a large match count
        worth = score * np.sqrt(match * library.point_areas[models])
        column = scene.intrinsics[0] * poses[:, 9] / poses[:, 11] + scene.intrinsics[2]
        row = scene.intrinsics[1] * poses[:, 10] / poses[:, 11] + scene.intrinsics[3]
        region = (row / _REGION).astype(np.int64) * 1000 + (column / _REGION).astype(np.int64)
        # a convex body shows a quarter of its surface
        whole = library.point_areas * np.diff(library.offsets) / 4.0
        drawn = whole[models] * (scene.intrinsics[0] * scene.intrinsics[1] / poses[:, 11] ** 2)
        room = float(_MOST_PIXELS)
        taken: dict[int, int] = {}
        taken_of: dict[tuple[int, int], int] = {}
        taken_by: dict[int, int] = {}
        hardly_by: dict[int, int] = {}
        kept: list[int] = []
        for k in np.argsort(-worth, kind="stable"):
            if len(kept) >= most or room <= 0.0:
                break
            place, own = int(region[k]), (int(region[k]), int(models[k]))
            if score[k] < _LEAST_SCORE or taken.get(place, 0) >= _PER_REGION:
                continue
            if taken_of.get(own, 0) >= _PER_MODEL:
                continue
            thing = int(meant[k])
            if thing != ELSEWHERE and taken_by.get(thing, 0) >= _PER_THING:
                continue
            if hardly[k] and hardly_by.get(thing, 0) >= _PER_UNLIKELY:
                continue
            hardly_by[thing] = hardly_by.get(thing, 0) + int(hardly[k])
            taken_by[thing] = taken_by.get(thing, 0) + 1
            taken[place] = taken.get(place, 0) + 1
            taken_of[own] = taken_of.get(own, 0) + 1
            room -= float(drawn[k])
            kept.append(k)
        return models[kept], poses[kept]

    def covered(self, placed: Sequence[tuple[int, Floats]]) -> Floats:
        """Return 1 on the pixels (H, W) of models at poses (12,), 0 elsewhere.

        Whatever was measured there: of a handle or a rim half the pixels may fit badly.
        """
        covered = np.zeros(self._scene.shape, np.float32)
        for model, pose in placed:
            drawing = self.drawing(model, pose)
            height, width = drawing.depth.shape
            gap = (
                self._scene.image.depth[
                    drawing.top : drawing.top + height, drawing.left : drawing.left + width
                ]
                - drawing.depth
            )
            window = covered[
                drawing.top : drawing.top + height, drawing.left : drawing.left + width
            ]
            window[(drawing.depth < NOTHING) & (np.abs(gap) < _COVERED)] = 1.0
        return covered

    def evidence(self, models: NDArray[np.int64], poses: Floats) -> PixelEvidence:
        """Return the evidence of hypotheses; their poses (N, 12) are refined in place."""
        values, windows, counts, factors = [np.zeros(0, np.float32)], [], [], []
        nothing = np.zeros(self._scene.shape, np.float32)
        start = 0
        for model, pose in zip(models, poses, strict=True):
            self.settle(int(model), pose, final=False)
            drawing = self.drawing(int(model), pose)
            height, width = drawing.evidence.shape
            values.append(drawing.evidence.ravel())
            windows.append((drawing.left, drawing.top, width, height, start))
            counts.append(drawing.counts)
            ends, goes_on = drawing.contour(self._scene, nothing, self._tolerance)
            factor = max((ends + 5.0) / (ends + goes_on + 5.0), _LEAST_CONTOUR_FACTOR)
            if self.lowest(int(model), pose, drawing) < -_BELOW:
                factor *= 0.7
            factor *= max(float(np.exp(-drawing.mismatch)), _LEAST_COLOR_FACTOR)
            factors.append(factor * drawing.closeness(self._scene, self._tolerance))
            start += drawing.evidence.size
        return PixelEvidence(
            np.concatenate(values),
            np.array(windows, np.int64).reshape(-1, 5),
            np.array(counts, np.float32).reshape(-1, COUNTS),
            np.array(factors, np.float32),
        )

    def lowest(self, model: int, pose: Floats, drawing: Drawing) -> float:
        """Return how far the model's lowest point is above the table around it [m].

        Depth cameras bend planes by centimetres towards the image's corners, so the table's height
        is taken from its pixels near the object. 0 without a table.
        """
        scene = self._scene
        if scene.parts.table is None:
            return 0.0
        plane = scene.plane
        along = plane[:3] @ pose[:9].reshape(3, 3)
        lowest = float((self._library.vertices[model] @ along).min())
        height, width = drawing.depth.shape
        top, left = max(0, drawing.top - _AROUND), max(0, drawing.left - _AROUND)
        bottom, right = drawing.top + height + _AROUND, drawing.left + width + _AROUND
        table = scene.table_height(left, top, right, bottom)
        return lowest + float(plane[:3] @ pose[9:] + plane[3]) - table

    def best_turn(self, model: int, pose: Floats, explained: Floats) -> tuple[Floats, float]:
        """Return the pose or one of its turns that explains more, and how many turns look alike.

        Args:
            model: number of the model.
            pose: (12,).
            explained: (H, W) evidence of the other objects.

        Returns:
            The pose (12,), and the share of the turns that explain almost as much as the best but
            put the object differently.
        """
        library = self._library
        rotations, about = library.turns[model], library.spin_points[model]
        worth = self._worth_of_turns(model, pose, rotations, explained)
        best, best_worth = pose, self.drawing(model, pose).worth(explained)
        close = worth > 0.98 * max(best_worth, float(worth.max()))
        alike = float(np.mean(close & library.turns_matter[model]))
        for k in np.argsort(-worth, kind="stable")[:_TURNS_REFINED]:
            if worth[k] < 0.7 * best_worth:
                break
            other = turned(pose, rotations[k], about)
            self.settle(model, other, final=False)
            gained = self.drawing(model, other).worth(explained)
            if gained > best_worth:
                best, best_worth = other, gained
        drawn = worth[: SPINS - 1] if best is pose else None
        return self._middle(model, best, best_worth, explained, drawn), alike

    def _middle(
        self,
        model: int,
        pose: Floats,
        worth: float,
        explained: Floats,
        turned_worth: Floats | None,
    ) -> Floats:
        """Return the pose turned to the middle of the turns that explain as much.

        A mug's handle that is hidden may be anywhere behind the mug: its middle errs least. On a
        table only the turns in which the mug rests best come into question.

        Args:
            model: number of the model.
            pose: (12,).
            worth: of the pose [pixel].
            explained: (H, W) evidence of the other objects.
            turned_worth: (SPINS - 1,) of its turns, None where they have yet to be drawn.
        """
        library = self._library
        spins, about = library.turns[model][: SPINS - 1], library.spin_points[model]
        if len(spins) < SPINS - 1:
            return pose
        if turned_worth is None:
            turned_worth = self._worth_of_turns(model, pose, spins, explained)
        equal = turned_worth > worth * (1.0 - _EQUAL)
        if equal.all() or not (equal[0] or equal[-1]):
            return pose
        ahead, behind = int(np.argmin(equal)), int(np.argmin(equal[::-1]))
        steps = np.arange(-behind, ahead + 1)
        if self._resting:
            steps = steps[self._rests(model, pose, steps)]
        middle = int(steps[np.argmin(np.abs(steps - 0.5 * (ahead - behind)))])
        if middle == 0:
            return pose
        # turn k is that by k + 1 steps; from the end they count backwards
        other: Floats = turned(pose, spins[middle - 1 if middle > 0 else middle], about)
        return other

    def _worth_of_turns(
        self, model: int, pose: Floats, rotations: Floats, explained: Floats
    ) -> Floats:
        """Return what each turn (K, 3, 3) of a pose adds to what is explained (K,) [pixel]."""
        library, scene = self._library, self._scene
        worth: Floats = worth_of_turns(
            pose,
            rotations,
            library.spin_points[model],
            library.vertices[model],
            library.faces[model],
            scene.image.depth,
            *scene.surface,
            self._tolerance,
            explained,
        )
        return worth

    def _rests(self, model: int, pose: Floats, steps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which turns (K,), in steps about the spin axis, come nearest to a stable pose."""
        spins = self._library.turns[model][: SPINS - 1]
        whole = np.concatenate([np.eye(3, dtype=np.float32)[None], spins])[steps]
        up = self._scene.plane[:3] @ (pose[:9].reshape(3, 3) @ whole)
        stable = self._library.models[model].stable_poses[:, 2, :3]
        tilt = np.arccos(np.clip((up @ stable.T).max(axis=1), -1.0, 1.0))
        if tilt.min() > _TILTED:
            return np.ones(len(steps), dtype=bool)
        nearest: NDArray[np.bool_] = tilt <= tilt.min() + _AS_STABLE
        return nearest
