"""The tracker (Sec. III-B): a hand and N known objects, 26 + 6 N values from every RGB-D frame."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.fit.hand_shape import HandShapeEstimate, shaped_hand
from intent_tracking.fit.initialisation import HandStart
from intent_tracking.image.appearance import AppearanceModel
from intent_tracking.image.labelling import OF_HAND
from intent_tracking.scene.body_state import BodyState, start_state
from intent_tracking.scene.hand_kernel import hand_buffers
from intent_tracking.scene.hand_model import HandModel, Side
from intent_tracking.scene.object_kernel import geometry_of
from intent_tracking.scene.packed_objects import PackedObjects
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE
from intent_tracking.tracker.hand_finder import HandFinder, Search
from intent_tracking.tracker.held_objects import expected, note_objects, reconsidered, ties_of
from intent_tracking.tracker.hypothesis import Hypothesis, unusual_roll
from intent_tracking.tracker.object_life import ObjectLife
from intent_tracking.tracker.problem import Fit, Problem, Surroundings
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.tracker.uncertainty import state_deviation

_SMOOTHING = 0.25
"""Share of the newest frame in the smoothed cost: about four frames judge a hand."""
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
        self.forget_hand()
        self._objects: RecognizedObjects | None = None

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
            plane if self.config.table else None,
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

    def _follow(self, hypothesis: Hypothesis, frame: RgbdFrame) -> None:
        """Fit one hypothesis to a frame and bring its record up to date."""
        track, lives = hypothesis.track, hypothesis.lives
        guess = expected(track.predict(), lives)
        active = tuple(k for k, life in enumerate(lives) if life.active)
        problem = self._problem(hypothesis, frame, guess, active)
        fit = reconsidered(hypothesis, problem, track.fit(problem), self.config.life)
        track.accept(problem, fit)
        self._note(hypothesis, problem, fit)
        due = hypothesis is self._hypotheses[0] and self._frames % self.config.learn_period == 0
        if due and hypothesis.mean_cost < self.config.doubt_cost:
            track.learn(problem, self._around.appearance)
        self._calibrate(hypothesis, problem)

    def _problem(
        self, hypothesis: Hypothesis, frame: RgbdFrame, guess: BodyState, active: tuple[int, ...]
    ) -> Problem:
        """Return what a frame asks of a hypothesis next to a guess."""
        ties = ties_of(hypothesis.lives, active, self.config.life)
        seed = self._frames + 1000 * self.config.seed
        return hypothesis.track.problem(frame, guess, active, ties, self._around, seed)

    def _calibrate(self, hypothesis: Hypothesis, problem: Problem) -> None:
        """Let a well-fitted frame speak for the shape of the hand."""
        config, track = self.config, hypothesis.track
        worst = max(hypothesis.mean_cost, track.cost)
        if len(self._hypotheses) > 1 or hypothesis.age < config.shape.first:
            return
        if worst < config.good_cost and self.shape.learn(
            track.hand, track.arrays, problem.view.evidence, config.track.weights, track.state
        ):
            shape = self.shape.shape
            self._hands = {side: HandModel.from_shape(side, shape) for side in self._hands}
            track.set_hand(self._hands[track.hand.side])

    def _note(self, hypothesis: Hypothesis, problem: Problem, fit: Fit) -> None:
        view = problem.view
        hypothesis.fit, hypothesis.active = fit, problem.active
        pixel = (view.tile.depth * view.tile.step) ** 2
        area = float(pixel[view.pixels.label == OF_HAND].sum())
        hypothesis.thin = hypothesis.thin + 1 if area < self.config.least_area else 0
        hypothesis.age += 1
        rate = max(_SMOOTHING, 1.0 / hypothesis.age)
        hypothesis.mean_cost += rate * (fit.cost - hypothesis.mean_cost)
        note_objects(hypothesis, problem, self.config.life, self._buffers)

    def _alive(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hypothesis still follows a hand; keep its objects if it does not."""
        lost = hypothesis.mean_cost > self.config.lost_cost
        if hypothesis.thin < 3 and not lost:
            return True
        if hypothesis is self._hypotheses[0]:
            state = hypothesis.track.state
            if hypothesis.age > max(self.config.young_trials):
                self._place = state.values[:3]
            far = start_state([state.pose(1 + k) for k in range(len(hypothesis.lives))])
            self._still_life.track.state = self._still_life.track.before = far
            self._still_life.lives = hypothesis.lives
        return False

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
        """Return the smoothed cost and how unusual the hand's roll is; least is best."""
        return hypothesis.mean_cost + self._unusual(hypothesis)

    def _unusual(self, hypothesis: Hypothesis) -> float:
        """Return what the hand's roll adds to the cost; nothing where no table says what is up."""
        if self._around.table is None:
            return 0.0
        track = hypothesis.track
        rotation = self._around.T_table_camera[:3, :3] @ track.state.rotations[0]
        return self.config.unusual_roll * unusual_roll(track.hand.side, rotation)

    def _doubtful(self, hypothesis: Hypothesis) -> bool:
        """Return whether other starts shall be tried: often when young, then when it fits badly."""
        if hypothesis.age in self.config.young_trials:
            return hypothesis.mean_cost > self.config.good_cost
        urgent = hypothesis.track.cost > self.config.urgent_cost
        due = urgent or self._frames % self.config.doubt_period == 0
        return due and hypothesis.age > 2 and hypothesis.mean_cost > self.config.doubt_cost

    def _search(self, frame: RgbdFrame) -> bool:
        """Look for a hand; return whether there is anything like one."""
        if self._frames % self.config.learn_period == 0:
            self._finder.learn_background(frame, self._still_life.track)
        found = self._starts(frame, tuple(self._hands))
        if not found:
            return False
        early = self._around.table is not None and self._frames < self.config.still_frames
        limit = self.config.first_cost if early else self.config.accept_cost
        best: dict[Side, HandStart] = {}
        for candidate in found:
            best.setdefault(candidate.side, candidate)
        for side, candidate in best.items():
            cost = candidate.cost - (self.config.side_bias if side == self._side else 0.0)
            if candidate.cost < limit and cost < found[0].cost + _WORTH_A_TRIAL:
                state = self._still_life.track.state.replaced([], candidate.state)
                self._hypotheses.append(self._hypothesis(side, state, cost))
        self._hypotheses.sort(key=self._rank)
        return True

    def _try_others(self, frame: RgbdFrame) -> None:
        """Replace the leading hypothesis if another start explains the frame better."""
        leader = self._hypotheses[0]
        side = leader.track.hand.side
        young = leader.age <= max(self.config.young_trials)
        sides: tuple[Side, ...] = ("right", "left") if young else (side,)
        best: dict[Side, HandStart] = {}
        place = leader.track.state.values[:3]
        for candidate in self._starts(frame, sides):
            apart = float(np.linalg.norm(candidate.state.values[:3] - place))
            near = apart < self.config.farthest_rival
            if near or candidate.cost < self.config.far_better * leader.mean_cost:
                best.setdefault(candidate.side, candidate)
        for candidate in best.values():
            rival = self._rival(leader, candidate, frame)
            lead = self._unusual(leader) - self._unusual(rival)
            if rival.track.cost < self.config.better * leader.track.cost + lead:
                self._hypotheses = [rival]
                leader = rival

    def _rival(self, leader: Hypothesis, candidate: HandStart, frame: RgbdFrame) -> Hypothesis:
        """Return what the leader would be with another start of the hand."""
        state = leader.track.state.replaced([], candidate.state)
        rival = self._hypothesis(candidate.side, state, leader.mean_cost)
        rival.lives = leader.lives
        problem = self._problem(rival, frame, state, leader.active)
        fit = rival.track.tried(problem)
        rival.track.accept(problem, fit)
        rival.track.before = rival.track.state
        rival.mean_cost, rival.age = fit.cost, leader.age
        rival.fit, rival.active = fit, leader.active
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
        return Hypothesis(track, lives, cost)

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
