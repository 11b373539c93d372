"""The tracker (Sec. III-B): a hand and N known objects, 26 + 6 N values from every RGB-D frame."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.fit.hand_shape import AVERAGE, HandShapeEstimate, shaped_hand
from intent_tracking.fit.initialisation import HandStart
from intent_tracking.hands.key_point_start import (
    KeyPointConfig,
    KeyPointStart,
    starts_from_key_points,
)
from intent_tracking.hands.key_points import key_evidence
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.hands.skin_depth import hand_mask
from intent_tracking.image.appearance import HAND, AppearanceModel, color_bins
from intent_tracking.image.frame_evidence import NO_KEYS, KeyEvidence
from intent_tracking.image.labelling import OF_HAND
from intent_tracking.scene.body_state import BodyState, start_state
from intent_tracking.scene.hand_kernel import HandArrays, hand_buffers
from intent_tracking.scene.hand_model import HandModel, Side
from intent_tracking.scene.object_kernel import geometry_of
from intent_tracking.scene.packed_objects import PackedObjects
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE
from intent_tracking.tracker.hand_finder import HandFinder, Search
from intent_tracking.tracker.hand_watch import GONE, MISSED, Expectation, HandWatch, at_place
from intent_tracking.tracker.held_objects import expected, note_objects, reconsidered, ties_of
from intent_tracking.tracker.hypothesis import Hypothesis, unusual_roll
from intent_tracking.tracker.object_life import ObjectLife
from intent_tracking.tracker.problem import Fit, Problem, Surroundings
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.tracker.uncertainty import state_deviation

_SMOOTHING = 0.25
"""Share of the newest frame in the smoothed cost: about four frames judge a hand."""
_GAP_SMOOTHING = 0.5
"""The same for the distance from the networks' key points, which are steadier."""
_ELSEWHERE = 0.10
"""Distance beyond which it does not matter how far beside its key points a hand is [m]."""
_USUAL_COST = 0.25
"""Cost of a fit beside which key points count as much as their weights say; the more depth leaves
unexplained, the more they count, by the square and within these factors."""
_TRUST = 0.05, 4.0
_GAP_COST = 8.0
"""Cost of a hand beside its key points [1/m]: 25 mm are worth a fifth of its pixels."""
_SIDE_COST = 0.3
"""Cost of a side that the networks exclude."""
_SURE, _SURE_AGE = 0.8, 4
"""Probability of the other side, and frames since a hand is seen, from which a side is doubted."""
_NUDGE = 0.008
"""A prediction is moved if the palm is seen farther beside it than this [m]."""
_KNOWN_SIZE = 0.01
"""Spread of the log of a calibrated hand's size."""
_PALM = [0, 5, 9, 13, 17]
_WORTH_A_TRIAL = 0.25
"""Starts this much worse than the best are not followed: a wrong side costs less at first."""


class Tracker:
    """Follows a hand and the recognised objects; starts and restarts by itself."""

    def __init__(
        self, models: Mapping[str, ObjectModel], config: TrackerConfig | None = None
    ) -> None:
        self.config = config or TrackerConfig()
        self._track_config = replace(self.config.track, swarm_only=self.config.method == "pso")
        self._models = models
        wanted = self.config.networks and self.config.method != "pso"
        self._watch = HandWatch(self.config.reader if wanted else None, self.config.look_period)
        self.forget_hand()
        self._objects: RecognizedObjects | None = None

    @property
    def trouble(self) -> str:
        """Why no network helps to find hands, and the remedy; empty where one does."""
        return self._watch.trouble

    def forget_hand(self) -> None:
        """Expect another person: the calibration of the hand's shape begins anew."""
        self.shape = HandShapeEstimate(self.config.shape)
        sides: tuple[Side, Side] = ("right", "left")
        self._hands: dict[Side, HandModel] = {
            side: HandModel.from_shape(side, self.shape.shape) for side in sides
        }
        for side in sides:  # the first one of a side is slow; that must not fall into a frame
            shaped_hand(side, self.shape.shape)

    def start(self, objects: RecognizedObjects) -> None:
        """Begin with recognised objects at rest and no hand.

        Raises:
            ValueError: if an object is not in the database.
        """
        unknown = [o.model for o in objects.objects if o.model not in self._models]
        if unknown:
            raise ValueError(f"expected objects of the tracker's database, got {unknown}")
        self._objects = objects
        self._around = self._surroundings(objects)
        T_camera_table = inverse(self._around.T_table_camera)
        poses = [T_camera_table @ o.T_table_object for o in objects.objects]
        track = SceneTrack(
            self._hands["right"], start_state(poses), self._around.objects, self._track_config
        )
        self._still_life = Hypothesis(track, [ObjectLife(pose) for pose in poses], 0.0)
        self._finder = HandFinder(self.config, self._around)
        self._hypotheses: list[Hypothesis] = []
        self._side: Side | None = None
        self._place: Floats | None = None
        self._frames = 0
        self._watch.reset()
        self._keys: dict[Side, KeyEvidence] = {}
        self._buffers = hand_buffers()

    def _surroundings(self, objects: RecognizedObjects) -> Surroundings:
        T_table_camera = np.asarray(objects.T_table_camera, dtype=np.float64)
        T_camera_table = inverse(T_table_camera)
        normal = T_camera_table[:3, 2]
        plane = np.concatenate([normal, [-normal @ T_camera_table[:3, 3]]])
        chosen = [self._models[o.model] for o in objects.objects]
        return Surroundings(
            PackedObjects([geometry_of(model) for model in chosen]),
            AppearanceModel([model.color for model in chosen]),
            plane if self.config.table and objects.table_seen else None,
            T_table_camera,
        )

    def place_hand(self, side: Side, T_camera_hand: Array, joints: Array) -> None:
        """Start from a known hand pose instead of searching for one."""
        state = self._still_life.track.state.with_hand(T_camera_hand, joints)
        self._hypotheses = [self._hypothesis(side, state, 0.2)]
        self._side, self._place = side, state.values[:3]

    def step(self, frame: RgbdFrame) -> SceneState:
        """Return hand and objects in one frame.

        Raises:
            ValueError: if `start` was not called.
        """
        if self._objects is None:
            raise ValueError("expected Tracker.start before Tracker.step")
        if self._frames == 0:
            self._finder.begin(frame, self._still_life.track)
        self._look(frame)
        for hypothesis in self._hypotheses:
            self._follow(hypothesis, frame)
        self._hypotheses = [h for h in self._hypotheses if self._alive(h)]
        self._compete()
        visible = bool(self._hypotheses)
        if not self._hypotheses:
            visible = self._search(frame)
        elif self._doubtful(self._hypotheses[0]):
            self._try_others(frame)
        self._frames += 1
        return self._result(frame, visible)

    def _look(self, frame: RgbdFrame) -> None:
        """Let the networks look at the hand that is followed, or at any if there is none."""
        leader = self._hypotheses[0] if self._hypotheses else None
        scene = (leader or self._still_life).track
        centers = [scene.state.pose(1 + k)[:3, 3] for k in range(len(self._still_life.lives))]
        objects = _pixels(frame.camera, np.reshape(centers, (-1, 3)))
        expectation = Expectation(objects=objects)
        if leader is not None:
            middle = _palm_pixel(frame.camera, leader.track.joints(leader.track.predict()))
            expectation = Expectation(middle, self._settled(leader), objects)
        self._watch.look(frame, expectation)
        seen = self._seen
        sides = self._hands if seen is not None else ()
        self._keys = {
            side: key_evidence(seen, frame.camera, side, self.config.key_points) for side in sides
        }

    @property
    def _seen(self) -> SeenHand | None:
        """The hand that acts, wherever the networks see it."""
        return self._watch.hand or (self._watch.elsewhere if self._watch.missed >= MISSED else None)

    def _settled(self, leader: Hypothesis) -> bool:
        """Return whether fit and networks agree so well that not every frame must be read."""
        old = leader.age > self.config.decision_frames and len(self._hypotheses) == 1
        agreed = leader.gap is not None and leader.gap < self.config.agreement
        return old and agreed and leader.mean_cost < self.config.doubt_cost

    def _follow(self, hypothesis: Hypothesis, frame: RgbdFrame) -> None:
        """Fit one hypothesis to a frame and bring its record up to date."""
        track, lives = hypothesis.track, hypothesis.lives
        guess = expected(self._nudged(hypothesis, track.predict()), lives)
        active = tuple(k for k, life in enumerate(lives) if life.active)
        problem = self._problem(hypothesis, frame, guess, active)
        fit = reconsidered(hypothesis, problem, track.fit(problem), self.config.life)
        track.accept(problem, fit)
        self._note(hypothesis, problem, fit)
        due = hypothesis is self._hypotheses[0] and self._frames % self.config.learn_period == 0
        if due and hypothesis.mean_cost < self.config.doubt_cost:
            track.learn(problem, self._around.appearance)
        self._note_size(hypothesis, frame)
        self._calibrate(hypothesis, problem)

    def _nudged(self, hypothesis: Hypothesis, guess: BodyState) -> BodyState:
        """Return a prediction moved to where the networks see the palm, if that is elsewhere."""
        keys = self._keys.get(hypothesis.track.hand.side, NO_KEYS)
        if self._watch.hand is None or not keys.weights.any():
            return guess
        palm = hypothesis.track.joints(guess)[_PALM]
        shift = (keys.rays[_PALM] * palm[:, 2:] - palm[:, :2]).mean(axis=0)
        if np.linalg.norm(shift) < _NUDGE:
            return guess
        moved = guess.copy()
        moved.values[:2] += shift
        return moved

    def _problem(
        self, hypothesis: Hypothesis, frame: RgbdFrame, guess: BodyState, active: tuple[int, ...]
    ) -> Problem:
        """Return what a frame asks of a hypothesis next to a guess."""
        ties = ties_of(hypothesis.lives, active, self.config.life)
        seed = self._frames + 1000 * self.config.seed
        keys = self._keys.get(hypothesis.track.hand.side, NO_KEYS)
        trust = np.float32(np.clip((hypothesis.mean_cost / _USUAL_COST) ** 2, *_TRUST))
        keys = keys._replace(weights=keys.weights * trust)
        return hypothesis.track.problem(frame, guess, active, ties, self._around, keys, seed)

    def _calibrate(self, hypothesis: Hypothesis, problem: Problem) -> None:
        """Let a well-fitted frame speak for the shape of the hand."""
        config, track = self.config, hypothesis.track
        worst = max(hypothesis.mean_cost, track.cost)
        if len(self._hypotheses) > 1 or hypothesis.age < config.shape.first:
            return
        if worst < config.good_cost and self.shape.learn(
            track.hand, track.arrays, problem.view.evidence, config.track.weights, track.state
        ):
            self._reshape()
            track.set_hand(self._hands[track.hand.side])

    def _reshape(self) -> None:
        """Use the hand's shape as it is known by now."""
        shape = self.shape.shape
        self._hands = {side: HandModel.from_shape(side, shape) for side in self._hands}

    def _note(self, hypothesis: Hypothesis, problem: Problem, fit: Fit) -> None:
        view = problem.view
        hypothesis.fit, hypothesis.active = fit, problem.active
        pixel = (view.tile.depth * view.tile.step) ** 2
        area = float(pixel[view.pixels.label == OF_HAND].sum())
        hypothesis.thin = hypothesis.thin + 1 if area < self.config.least_area else 0
        hypothesis.age += 1
        rate = max(_SMOOTHING, 1.0 / hypothesis.age)
        hypothesis.mean_cost += rate * (fit.cost - hypothesis.mean_cost)
        gap = self._gap(hypothesis.track)
        if gap is not None:
            before = gap if hypothesis.gap is None else hypothesis.gap
            hypothesis.gap = before + _GAP_SMOOTHING * (gap - before)
        note_objects(hypothesis, problem, self.config.life, self._buffers)

    def _alive(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hypothesis still follows a hand; keep its objects if it does not."""
        unseen = self._watch.ever and self._watch.missed >= GONE
        limit = self.config.good_cost if unseen else self.config.lost_cost
        poor = hypothesis.thin >= 3 or hypothesis.mean_cost > limit
        if not poor or self._supported(hypothesis):
            return True
        if hypothesis is self._hypotheses[0]:
            state = hypothesis.track.state
            if hypothesis.age > max(self.config.young_trials):
                self._place = state.values[:3]
            far = start_state([state.pose(1 + k) for k in range(len(hypothesis.lives))])
            self._still_life.track.state = self._still_life.track.before = far
            self._still_life.lives = hypothesis.lives
        return False

    def _supported(self, hypothesis: Hypothesis) -> bool:
        """Return whether the networks see a hand where this one is.

        Then its cost says little: pixels of cloth or of white skin, or without depth, are shared
        out wrongly and cost as much as a hand in the wrong place does.
        """
        agreed = hypothesis.gap is not None and hypothesis.gap < self.config.contradiction
        return agreed and self._watch.missed < MISSED

    def _compete(self) -> None:
        """Put the better hypothesis first; end the competition when it is clear."""
        if len(self._hypotheses) > 1:
            self._hypotheses.sort(key=self._rank)
            first, second = self._hypotheses[:2]
            lead = self._rank(second) - self._rank(first)
            if first.age >= self.config.decision_frames or (
                first.age >= 3 and lead > self.config.decision_margin
            ):
                self._hypotheses = [first]
        if len(self._hypotheses) == 1:
            self._side = self._hypotheses[0].track.hand.side

    def _rank(self, hypothesis: Hypothesis) -> float:
        """Return the smoothed cost and what speaks against the hand beside it; least is best."""
        return min(hypothesis.mean_cost, self.config.lost_cost) + self._odd(hypothesis)

    def _odd(self, hypothesis: Hypothesis) -> float:
        """Return the cost of a hand's roll and of where and on which side the networks see it."""
        odd = self._unusual(hypothesis) + _GAP_COST * (hypothesis.gap or 0.0)
        seen = self._seen
        if seen is not None:
            side = hypothesis.track.hand.side
            odd += _SIDE_COST * (1.0 - (seen.right if side == "right" else 1.0 - seen.right))
        return odd

    def _unusual(self, hypothesis: Hypothesis) -> float:
        """Return what the hand's roll adds to the cost; nothing where no table says what is up."""
        if self._around.table is None:
            return 0.0
        track = hypothesis.track
        rotation = self._around.T_table_camera[:3, :3] @ track.state.rotations[0]
        return self.config.unusual_roll * unusual_roll(track.hand.side, rotation)

    def _doubtful(self, hypothesis: Hypothesis) -> bool:
        """Return whether other starts shall be tried: often when young, then when it fits badly."""
        if self._contradicted(hypothesis):
            return True
        if hypothesis.age in self.config.young_trials:
            return hypothesis.mean_cost > self.config.good_cost
        urgent = hypothesis.track.cost > self.config.urgent_cost
        due = urgent or self._frames % self.config.doubt_period == 0
        return due and hypothesis.age > 2 and hypothesis.mean_cost > self.config.doubt_cost

    def _contradicted(self, hypothesis: Hypothesis) -> bool:
        """Return whether the networks see the hand elsewhere or on the other side."""
        if hypothesis.gap is not None and hypothesis.gap > self.config.contradiction:
            return True
        seen = self._seen
        if seen is None:
            return False
        right = hypothesis.track.hand.side == "right"
        return seen.age > _SURE_AGE and (1.0 - seen.right if right else seen.right) > _SURE

    def _search(self, frame: RgbdFrame) -> bool:
        """Look for a hand; return whether there is anything like one."""
        found = self._seen_hypotheses(frame)
        visible = bool(found)
        if not found:
            found, visible = self._found_hypotheses(frame)
        self._hypotheses = sorted(found, key=self._rank)
        return visible or self._watch.hand is not None

    def _seen_hypotheses(self, frame: RgbdFrame) -> list[Hypothesis]:
        """Return what the networks' key points say, each fitted once, best first."""
        found = []
        for start in self._seen_starts(frame, tuple(self._hands)):
            state = self._still_life.track.state.replaced([], start.state)
            hypothesis = self._hypothesis(start.side, state, self.config.lost_cost)
            problem = self._problem(hypothesis, frame, state, ())
            fit = hypothesis.track.tried(problem)
            hypothesis.track.accept(problem, fit)
            hypothesis.track.before = hypothesis.track.state
            hypothesis.mean_cost, hypothesis.fit = fit.cost, fit
            hypothesis.gap = self._gap(hypothesis.track)
            if fit.cost < self.config.accept_cost or self._supported(hypothesis):
                found.append(hypothesis)
        return sorted(found, key=self._rank)

    def _seen_starts(self, frame: RgbdFrame, sides: tuple[Side, ...]) -> list[KeyPointStart]:
        """Return starts from the networks' key points, and learn the colours of what they see."""
        seen = self._seen
        if seen is None:
            return []
        starts = starts_from_key_points(seen, frame, self._sized_hands(sides), self._sizing())
        if starts:
            mask = hand_mask(frame.depth, seen.pixels, starts[0].depth)
            self._around.appearance.learn(HAND, color_bins(frame.color[mask]))
            if self.shape.note_size(starts[0].size):
                self._reshape()
        return starts

    def _sized_hands(self, sides: tuple[Side, ...]) -> dict[Side, tuple[HandModel, HandArrays]]:
        """Return the hands to fit to key points: of average size until theirs is known."""
        shape = self.shape.shape if self.shape.known else AVERAGE
        return {
            side: (HandModel.from_shape(side, shape), shaped_hand(side, shape)) for side in sides
        }

    def _sizing(self) -> KeyPointConfig:
        """Return how freely the size of those hands is fitted."""
        config = self.config.key_points
        return replace(config, usual_size=1.0, size=_KNOWN_SIZE) if self.shape.known else config

    def _note_size(self, hypothesis: Hypothesis, frame: RgbdFrame) -> None:
        """Let the key points of a young hand speak for its size."""
        seen = self._watch.hand
        if seen is None or self.shape.known or not self._supported(hypothesis):
            return
        hands = self._sized_hands((hypothesis.track.hand.side,))
        for start in starts_from_key_points(seen, frame, hands, self._sizing()):
            if self.shape.note_size(start.size):
                self._reshape()
                hypothesis.track.set_hand(self._hands[hypothesis.track.hand.side])

    def _found_hypotheses(self, frame: RgbdFrame) -> tuple[list[Hypothesis], bool]:
        """Return what depth and colour alone say, and whether anything looks like a hand."""
        if self._frames % self.config.learn_period == 0:
            self._finder.learn_background(frame, self._still_life.track)
        found = self._starts(frame, tuple(self._hands))
        hypotheses: list[Hypothesis] = []
        if not found:
            return hypotheses, False
        early = self._around.table is not None and self._frames < self.config.still_frames
        limit = self.config.first_cost if early else self.config.accept_cost
        best: dict[Side, HandStart] = {}
        for candidate in found:
            best.setdefault(candidate.side, candidate)
        for side, candidate in best.items():
            cost = candidate.cost - (self.config.side_bias if side == self._side else 0.0)
            state = self._still_life.track.state.replaced([], candidate.state)
            hypothesis = self._hypothesis(side, state, cost)
            place = _palm_pixel(frame.camera, hypothesis.track.joints(state))
            if any(at_place(hand, place) for hand in self._watch.idle):
                continue
            astray = _GAP_COST * (hypothesis.gap or 0.0)
            if candidate.cost + astray < limit and cost < found[0].cost + _WORTH_A_TRIAL:
                hypotheses.append(hypothesis)
        return hypotheses, True

    def _try_others(self, frame: RgbdFrame) -> None:
        """Replace the leading hypothesis if another start explains the frame better."""
        leader = self._hypotheses[0]
        for start in self._rival_starts(leader, frame):
            rival = self._rival(leader, start.side, start.state, frame)
            lead = self._odd(leader) - self._odd(rival)
            costs = [min(one.track.cost, self.config.lost_cost) for one in (leader, rival)]
            if costs[1] < self.config.better * costs[0] + lead:
                self._hypotheses = [rival]
                leader = rival

    def _rival_starts(self, leader: Hypothesis, frame: RgbdFrame) -> list[HandStart]:
        """Return the best start of each side that may be the leader's hand."""
        young = leader.age <= max(self.config.young_trials)
        if self._seen is not None:
            return [
                HandStart(start.side, start.state, start.cost)
                for start in self._seen_starts(frame, tuple(self._hands))
            ]
        side = leader.track.hand.side
        sides: tuple[Side, ...] = ("right", "left") if young else (side,)
        best: dict[Side, HandStart] = {}
        place = leader.track.state.values[:3]
        for candidate in self._starts(frame, sides):
            apart = float(np.linalg.norm(candidate.state.values[:3] - place))
            near = apart < self.config.farthest_rival
            if near or candidate.cost < self.config.far_better * leader.mean_cost:
                best.setdefault(candidate.side, candidate)
        return list(best.values())

    def _rival(
        self, leader: Hypothesis, side: Side, hand: BodyState, frame: RgbdFrame
    ) -> Hypothesis:
        """Return what the leader would be with another start of the hand."""
        state = leader.track.state.replaced([], hand)
        rival = self._hypothesis(side, state, leader.mean_cost)
        rival.lives = leader.lives
        problem = self._problem(rival, frame, state, leader.active)
        fit = rival.track.tried(problem)
        rival.track.accept(problem, fit)
        rival.track.before = rival.track.state
        rival.mean_cost, rival.age = fit.cost, leader.age
        rival.fit, rival.active = fit, leader.active
        rival.gap = self._gap(rival.track)
        return rival

    def _starts(self, frame: RgbdFrame, sides: tuple[Side, ...]) -> list[HandStart]:
        """Return refined starts of the given sides in a frame, best first."""
        leader = self._hypotheses[0].track if self._hypotheses else None
        search = Search(
            self._frames,
            {side: self._hands[side] for side in sides},
            leader or self._still_life.track,
            leader.state.values[:3] if leader else self._place,
        )
        return self._finder.starts(frame, search)

    def _hypothesis(self, side: Side, state: BodyState, cost: float) -> Hypothesis:
        track = SceneTrack(self._hands[side], state, self._around.objects, self._track_config)
        track.cost = cost
        lives = [ObjectLife(life.rest, life.active, life.taken) for life in self._still_life.lives]
        return Hypothesis(track, lives, cost, gap=self._gap(track))

    def _gap(self, track: SceneTrack) -> float | None:
        """Return how far a track's joints lie beside what the networks see [m]; None: nothing."""
        gap = track.key_gap(self._keys.get(track.hand.side, NO_KEYS), track.state)
        return min(gap, _ELSEWHERE) if gap >= 0.0 else None

    def _result(self, frame: RgbdFrame, visible: bool) -> SceneState:
        assert self._objects is not None
        leader = self._hypotheses[0] if self._hypotheses else None
        shown = leader or self._still_life
        track, lives = shown.track, shown.lives
        values = track.state.vector(self._around.T_table_camera)
        deviation = state_deviation(
            leader.fit if leader else None, leader.active if leader else (), len(lives)
        )
        if leader is None:
            values[:HAND_SIZE] = deviation[:HAND_SIZE] = np.nan
        return SceneState(
            frame.stamp,
            track.hand.side if leader else (self._side or "right"),
            values,
            deviation,
            track.hand.shape if leader else self.shape.shape,
            tuple(o.id for o in self._objects.objects),
            tuple(o.model for o in self._objects.objects),
            tuple(o.object_class for o in self._objects.objects),
            self._around.T_table_camera,
            float(track.cost) if leader else float("nan"),
            visible,
            visible and leader is None,
            tuple(life.unseen > self.config.life.unseen_frames for life in lives),
        )


def _palm_pixel(camera: Camera, joints: Floats) -> Array:
    """Return where the middle (2,) of the palm of joints (21, 3) is seen [pixels]."""
    return _pixels(camera, joints[_PALM].mean(axis=0, dtype=np.float64)[None])[0]


def _pixels(camera: Camera, points: Array) -> Array:
    """Return where points (n, 3) of the camera's frame are seen (n, 2) [pixels]."""
    flat = points[:, :2] / np.maximum(points[:, 2:], 0.05)
    return np.asarray(flat * [camera.fx, camera.fy] + [camera.cx, camera.cy])
