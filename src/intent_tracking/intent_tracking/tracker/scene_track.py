"""One hypothesis of the scene followed over frames: a hand of one side and all objects."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.fit.finger_sweep import sweep_fingers
from intent_tracking.fit.hand_shape import shaped_hand
from intent_tracking.fit.key_terms import key_cost, key_gap
from intent_tracking.fit.objective import draw_objects, forth_costs, rendered_cost
from intent_tracking.fit.pso import minimise
from intent_tracking.fit.refinement import refine
from intent_tracking.fit.swarm_cost import joint_costs, sums_of_nothing
from intent_tracking.image.appearance import FIRST_OBJECT, HAND, AppearanceModel
from intent_tracking.image.frame_evidence import KeyEvidence, Labelled, Prior
from intent_tracking.image.labelling import Bodies, evidence_of, label_pixels
from intent_tracking.image.pixel_kernels import OF_HAND, OF_OBJECT
from intent_tracking.image.tile import Tile, covering_square, cut_tile
from intent_tracking.scene.body_state import BodyState, predicted
from intent_tracking.scene.hand_kernel import HandArrays, hand_buffers, place_hand, turn
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.packed_objects import PackedObjects
from intent_tracking.scene.posture_prior import shipped_posture, surprise
from intent_tracking.scene.raster import FAR
from intent_tracking.scene.state_layout import HAND_SIZE, body_start
from intent_tracking.tracker.problem import SINGLE_LIMITS, Fit, Problem, Surroundings, Ties, View
from intent_tracking.tracker.track_config import TrackConfig

_AGREED = 0.012
"""Distance of joints from their key points up to which a fit is not questioned [m]."""
_BEYOND_DEPTH = 0.35
"""Cost per hand pixel above which depth images have shown to be no judge of a hand's pose: cloth
for skin, holes, a forearm cut off. Where they explain the hand the cost stays below."""
_KEY_PIXELS = 60.0
"""Pixels that a key point of full weight is worth where fits of one view are compared."""


class SceneTrack:
    """A hand and its objects, followed by refinement and finger sweep."""

    def __init__(
        self, hand: HandModel, state: BodyState, objects: PackedObjects, config: TrackConfig
    ) -> None:
        self.objects, self.config = objects, config
        self.state, self.before = state, state
        self.buffers = hand_buffers()
        self.cost = 0.0
        self.set_hand(hand)
        if config.swarm_only:  # slow the first time; that must not fall into a frame
            self.objects.coarse_meshes(list(range(len(objects.geometries))))

    def set_hand(self, hand: HandModel) -> None:
        """Use another hand shape from now on."""
        self.hand = hand
        self.arrays: HandArrays = shaped_hand(hand.side, hand.shape)

    def predict(self) -> BodyState:
        """Return the state expected in the next frame."""
        guess = predicted(self.before, self.state, self.config.damping)
        low, high = SINGLE_LIMITS.T
        np.clip(guess.values[6:26], low, high, out=guess.values[6:26])
        return guess

    def problem(
        self,
        frame: RgbdFrame,
        guess: BodyState,
        active: tuple[int, ...],
        ties: Ties,
        around: Surroundings,
        keys: KeyEvidence,
        seed: int,
    ) -> Problem:
        """Return what a frame asks of this track next to a guess (hand and all objects)."""
        view = self._view(frame, guess, active, around)
        view = replace(view, evidence=view.evidence._replace(keys=keys))
        return Problem(view, guess, active, self.objects(list(active)), ties, keys, seed)

    def _view(
        self, frame: RgbdFrame, guess: BodyState, active: tuple[int, ...], around: Surroundings
    ) -> View:
        """Cut out and label the surroundings of a guess (hand and all objects)."""
        part = guess.chosen(list(active))
        place_hand(self.arrays, part.values, part.rotations[0], self.buffers)
        points = [self.buffers.ends.reshape(-1, 3).astype(np.float64)]
        for row, k in enumerate(active):
            pose = part.pose(1 + row)
            points.append(self.objects.geometries[k].surface @ pose[:3, :3].T + pose[:3, 3])
        square = covering_square(frame.camera, np.concatenate(points), self.config.margin, 96.0)
        tile = cut_tile(frame, square, self.config.tile_size)
        resting = [k for k in range(len(self.objects.geometries)) if k not in active]
        bodies = Bodies(
            self.arrays,
            self.buffers,
            self.objects(list(active)),
            part.values,
            part.rotations,
            active,
        )
        rest_depth = self.drawn(resting, guess, tile)
        pixels = label_pixels(
            tile, bodies, around.appearance, rest_depth, around.table, self.config.labelling
        )
        return View(tile, pixels, *evidence_of(tile, pixels, self.config.labelling))

    def tried(self, problem: Problem) -> Fit:
        """Return the state of hand and active objects next to the guess, without looking around."""
        start = problem.start
        return self._descended(start, problem, problem.prior(start), problem.seed)

    def fit(self, problem: Problem) -> Fit:
        """Return the best state of hand and active objects near the guess."""
        config, seed = self.config, problem.seed
        start = problem.start
        prior = problem.prior(start)
        rng = np.random.default_rng([seed, 7])
        if config.swarm_only:
            size = config.pso_particles, config.pso_generations
            return self._refined(self._swarmed(start, problem, size, True, rng), problem, prior, 0)
        best = self._descended(start, problem, prior, seed)
        agreed = 0.0 <= self.key_gap(problem.keys, best.state) < _AGREED
        if agreed and best.cost > _BEYOND_DEPTH:
            return best  # seen there by the networks as well, and depth tells no better
        if best.cost > config.swarm_cost:  # the motion may have turned back
            stayed = self.state.chosen(list(problem.active))
            other = self._descended(stayed, problem, prior, seed + 3)
            best = min(best, other, key=lambda fit: fit.total)
        if best.cost > config.swarm_cost and config.swarm_particles:
            size = config.swarm_particles, config.swarm_generations
            found = self._swarmed(best.state, problem, size, False, rng)
            other = self._descended(found, problem, prior, seed + 1)
            best = min(best, other, key=lambda fit: fit.total)
        return self._slid(best, problem, prior)

    def _slid(self, fit: Fit, problem: Problem, prior: Prior) -> Fit:
        """Return the fit, or another begun farther back or ahead along the hand if that is better.

        Seen edge-on and with the arm in a sleeve, that is where its place is least certain. A fit
        that is good tries one of these starts per frame, another tries all.
        """
        config, seed = self.config, problem.seed
        poor = fit.cost > config.swarm_cost
        slides = config.slides if poor else config.slides[seed % len(config.slides) :][:1]
        found = []
        for slide in slides:
            start = fit.state.copy()
            start.values[:3] += np.float32(slide) * start.rotations[0, :, 0]
            near = self._refined(start, problem, prior, config.iterations, config.scale)
            found.append(self._refined(near.state, problem, prior, config.polish_iterations))
        other = min(found, key=lambda fit: fit.total)
        if poor or other.total < fit.total + config.clear_gain:
            other = self._descended(other.state, problem, prior, seed + 2)
        return min(fit, other, key=lambda fit: fit.total)

    def _descended(self, start: BodyState, problem: Problem, prior: Prior, seed: int) -> Fit:
        """Return a start refined on points, swept finger by finger, and refined again."""
        config = self.config
        best = self._refined(start, problem, prior, config.iterations, config.scale)
        fine = self._refined(best.state, problem, prior, config.polish_iterations)
        best = min(best, fine, key=lambda fit: fit.total)
        if config.sweep_trials == 0:
            return best
        swept = best.state.copy()
        sweep_fingers(
            self.arrays, problem.objects, problem.view.seen, swept.values, swept.rotations,
            prior.state, prior.posture, SINGLE_LIMITS, config.sweep_trials,
            np.float32(config.sweep_pull), np.float32(config.sweep_unusual),
            np.float32(config.sweep_spread), seed,
        )  # fmt: skip
        if np.array_equal(swept.values, best.state.values):
            return best
        prior = prior._replace(state=swept.values.copy(), rotations=swept.rotations.copy())
        polished = self._refined(swept, problem, prior, config.polish_iterations)
        total, cost = self._rendered(swept, problem)
        return min(best, polished, Fit(swept, best.normal, cost, total), key=lambda fit: fit.total)

    def reconsidered(self, problem: Problem, fit: Fit, row: int, pose: Array, ties: Ties) -> Fit:
        """Return the fit with one active object begun anew from a pose (4, 4), if better."""
        start = fit.state.with_object(row, pose)
        steps = self.config.polish_iterations
        rival = self._refined(start, problem, problem.prior(start, ties), steps)
        return rival if rival.total < fit.total - self.config.clear_gain else fit

    def _swarmed(
        self,
        start: BodyState,
        problem: Problem,
        size: tuple[int, int],
        move_objects: bool,
        rng: np.random.Generator,
    ) -> BodyState:
        """Return the best of a swarm on the published cost around a start.

        `size`: particles and generations.
        """
        config, active = self.config, problem.active
        cost = self._rating(start, problem, move_objects)
        spread = np.zeros(len(start.values), np.float32)
        spread[:HAND_SIZE] = config.swarm_spread
        if move_objects:
            spread[HAND_SIZE:] = np.tile([0.006] * 3 + [0.05] * 3, len(active))
        bounds = np.stack([start.values - 10.0, start.values + 10.0], axis=1)
        bounds[6:HAND_SIZE] = SINGLE_LIMITS
        swarm = minimise(cost, start.values, spread, bounds, *size, rng)
        found = BodyState(swarm.best.copy(), start.rotations.copy())
        for body in range(1 + len(active)):
            offset = body_start(body) + 3
            turn(*swarm.best[offset : offset + 3], start.rotations[body], found.rotations[body])
            found.values[offset : offset + 3] = 0.0
        return found

    def _rating(
        self, start: BodyState, problem: Problem, move_objects: bool
    ) -> Callable[[Floats], Floats]:
        """Return the published cost (P,) of states (P, D) around a start."""
        hand, objects, base = self.arrays, problem.objects, start.rotations
        seen = coarser(problem.view.seen, self.config.swarm_size)

        def of_hand(states: Floats) -> Floats:
            costs = np.empty(len(states), np.float32)
            forth_costs(hand, objects, seen, states, base, 0, len(states), costs)
            return costs

        if not move_objects:
            return of_hand
        meshes = self.objects.coarse_meshes(list(problem.active))
        above = sums_of_nothing(seen)

        def of_all(states: Floats) -> Floats:
            costs = np.empty(len(states), np.float32)
            joint_costs(hand, objects, meshes, seen, above, states, base, costs)
            return costs

        return of_all

    def key_gap(self, keys: KeyEvidence, state: BodyState) -> float:
        """Return how far a state's joints lie beside their lines of sight [m]; -1: none is seen."""
        place_hand(self.arrays, state.values, state.rotations[0], self.buffers)
        return float(key_gap(self.buffers, keys, state.rotations[0]))

    def joints(self, state: BodyState) -> Floats:
        """Return the 21 joints (21, 3) of a state in the camera's frame [m]."""
        place_hand(self.arrays, state.values, state.rotations[0], self.buffers)
        return self.buffers.landmarks.copy()

    def accept(self, problem: Problem, fit: Fit) -> None:
        """Make a fit the present state."""
        self.before = self.state
        self.state = problem.guess.replaced(list(problem.active), fit.state)
        self.cost = fit.cost

    def learn(self, problem: Problem, appearance: AppearanceModel) -> None:
        """Adapt the colours of hand and active objects to the labelled pixels."""
        pixels = problem.view.pixels
        hand = (pixels.label == OF_HAND) & (pixels.hand_gap < 0.006)
        appearance.learn(HAND, pixels.bins[hand])
        for row, k in enumerate(problem.active):
            appearance.learn(FIRST_OBJECT + k, pixels.bins[pixels.label == OF_OBJECT + row])

    def drawn(self, chosen: list[int], state: BodyState, tile: Tile) -> Floats:
        """Return the z-buffer (S, S) of chosen objects on a tile [m]."""
        depth = np.full(tile.depth.shape, FAR)
        if chosen:
            part, objects = state.chosen(chosen), self.objects(chosen)
            seen = Labelled(
                tile.depth,
                tile.depth,
                tile.depth,
                tile.depth,
                tile.depth,
                tile.u0,
                tile.v0,
                tile.step,
            )
            work = np.empty((len(objects.vertices), 3), np.float32)
            draw_objects(objects, part.values, part.rotations, seen, depth, work)
        return depth

    def _refined(
        self,
        start: BodyState,
        problem: Problem,
        prior: Prior,
        iterations: int,
        scale: float | None = None,
    ) -> Fit:
        """Return a start refined on points, by default with the narrow outlier scale."""
        weights = self.config.weights
        if scale is None:
            scale = self.config.fine_scale
        values, rotations = start.values[None].copy(), start.rotations[None].copy()
        costs = np.zeros(1, np.float32)
        normals = np.zeros((1, len(start.values), len(start.values)), np.float32)
        refine(
            self.arrays, problem.objects, problem.view.evidence,
            weights._replace(scale=np.float32(scale)), prior, values, rotations, iterations, costs,
            normals,
        )  # fmt: skip
        state = BodyState(values[0], rotations[0])
        total, cost = self._rendered(state, problem)
        return Fit(state, normals[0], cost, total)

    def _rendered(self, state: BodyState, problem: Problem) -> tuple[float, float]:
        total, cost = rendered_cost(
            self.arrays, problem.objects, problem.view.seen, state.values, state.rotations
        )
        unusual = self.config.sweep_unusual * surprise(shipped_posture(), state.values[6:HAND_SIZE])
        astray = 0.0
        if problem.keys.weights.any():
            place_hand(self.arrays, state.values, state.rotations[0], self.buffers)
            astray = _KEY_PIXELS * float(key_cost(self.buffers, problem.keys, state.rotations[0]))
        return float(total) + unusual + astray, float(cost)


def coarser(seen: Labelled, size: int) -> Labelled:
    """Return a labelled tile of fewer pixels: every n-th row and column."""
    stride = len(seen.depth) // size
    depth, hand, thing, valid, sure = (
        np.ascontiguousarray(image[::stride, ::stride])
        for image in (seen.depth, seen.hand, seen.thing, seen.valid, seen.sure)
    )
    step = np.float32(seen.step * stride)
    return Labelled(depth, hand, thing, valid, sure, seen.u0, seen.v0, step)
