"""The tracker (Sec. III-B): a hand and N known objects, 26 + 6 N values from every RGB-D frame."""

from dataclasses import replace
from functools import partial

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.database import ModelSource
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.fit.hand_shape import HandShapeEstimate
from intent_tracking.hands.expectation import Expectation
from intent_tracking.hands.hand_square import square_of_key_points
from intent_tracking.hands.hand_watch import HandWatch
from intent_tracking.hands.seen_hand import PALM, SeenHand
from intent_tracking.hands.seen_palm import nudged, palm_pixel, pixels_of
from intent_tracking.image.pixel_kernels import OF_HAND
from intent_tracking.scene.body_state import start_state
from intent_tracking.scene.hand_kernel import hand_buffers
from intent_tracking.scene.hand_model import Side
from intent_tracking.scene.object_kernel import geometry_of
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.held_objects import (
    expected,
    joined_objects,
    note_objects,
    reconsidered,
)
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis
from intent_tracking.tracker.hypotheses.hypothesis_source import (
    USUAL_COST,
    FrameContext,
    HandHypotheses,
)
from intent_tracking.tracker.object_life import ObjectLife
from intent_tracking.tracker.person_hands import PersonHands
from intent_tracking.tracker.problem import Fit, Problem, surroundings_of
from intent_tracking.tracker.published_state import Shown, published_state
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig

_SMOOTHING = 0.25
"""Share of the newest frame in the smoothed cost: about four frames judge a hand."""
_NEW = 2
"""Age up to which a hand is looked at in a hurry too: a rough start needs what networks see."""
_GAP_SMOOTHING = 0.5
"""The same for the distance from the networks' key points, which are steadier."""


class Tracker:
    """Follows a hand and the recognised objects; starts and restarts by itself."""

    def __init__(self, models: ModelSource, config: TrackerConfig | None = None) -> None:
        self.config = config or TrackerConfig()
        self._models = models
        self._objects: RecognizedObjects | None = None
        wanted = self.config.networks and self.config.method != "pso"
        reader = self.config.reader if wanted else None
        self._watch = HandWatch(reader, self.config.key_points, self.config.look_period)
        self.forget_hand()
        self._answer: RecognizedObjects | None = None

    @property
    def trouble(self) -> str:
        """Why no network helps to find hands, and the remedy; empty where one does."""
        return self._watch.trouble

    def forget_hand(self) -> None:
        """Expect another person: the calibration of the hand's shape begins anew."""
        self._person = PersonHands(self.config.shape, self.config.key_points)
        if self._objects is not None:
            self._source.person = self._person

    @property
    def shape(self) -> HandShapeEstimate:
        """The shape of the demonstrator's hand, as it is known by now."""
        return self._person.shape

    def start(self, objects: RecognizedObjects) -> None:
        """Begin with recognised objects at rest and no hand.

        Raises:
            ValueError: if an object is not in the database.
        """
        chosen = self._models_of(objects)
        self._objects, self._answer = objects, None
        self._around = surroundings_of(objects, chosen, self.config.table)
        T_camera_table = inverse(self._around.T_table_camera)
        poses = [T_camera_table @ o.T_table_object for o in objects.objects]
        track = SceneTrack(
            self._person.models["right"],
            start_state(poses),
            self._around.objects,
            self.config.track,
        )
        self._still_life = Hypothesis(track, [ObjectLife(pose) for pose in poses], 0.0)
        self._source = HandHypotheses(
            self.config, self._around, self._watch, self._person, self._still_life
        )
        self._hypotheses: list[Hypothesis] = []
        self._side: Side | None = None
        self._place: Floats | None = None
        self._frames, self._hurried = 0, False
        self._watch.reset()
        self._buffers = hand_buffers()

    def prepare(self, objects: RecognizedObjects) -> None:
        """Compute the shapes of objects that will join; may run in another thread than `step`.

        Raises:
            ValueError: if an object is not in the database.
        """
        for model in self._models_of(objects):
            geometry_of(model)

    def join(self, objects: RecognizedObjects) -> None:
        """Take a new answer of the recogniser with the next frame.

        A hand that is followed, and the objects that it holds, are followed on.

        Raises:
            ValueError: if an object is not in the database, or if `start` was not called.
        """
        if self._objects is None:
            raise ValueError("expected Tracker.start before Tracker.join")
        self._models_of(objects)
        self._answer = objects

    def _models_of(self, objects: RecognizedObjects) -> list[ObjectModel]:
        unknown = [o.model for o in objects.objects if o.model not in self._models]
        if unknown:
            raise ValueError(f"expected objects of the tracker's database, got {unknown}")
        return [self._models[o.model] for o in objects.objects]

    def _join(self, answer: RecognizedObjects, frame: RgbdFrame) -> None:
        """Let the objects of an answer take part from this frame on."""
        assert self._objects is not None
        T_table_camera, leader = answer.T_table_camera, (self._hypotheses or [self._still_life])[0]
        held = {
            item.id: T_table_camera @ leader.track.state.pose(1 + k)
            for k, item in enumerate(self._objects.objects)
            if leader.lives[k].active or leader.lives[k].taken
        }
        self._objects, kept = joined_objects(self._objects, answer, held)
        ids = [item.id for item in self._objects.objects]
        models = self._models_of(self._objects)
        around = surroundings_of(self._objects, models, self.config.table)
        appearance = self._around.appearance.joined([model.color for model in models], kept)
        self._around = replace(around, appearance=appearance)
        T_camera_table = inverse(T_table_camera)
        poses = [T_camera_table @ item.T_table_object for item in self._objects.objects]
        pairs = list(zip(ids, kept, strict=True))
        for one in (self._still_life, *self._hypotheses):
            lives = [one.lives[k] if k is not None and i in held else None for i, k in pairs]
            one.join(self._around.objects, poses, lives)
        new = [k for k, before in enumerate(kept) if before is None]
        self._source.join(self._around, frame, new)

    def place_hand(self, side: Side, T_camera_hand: Array, joints: Array) -> None:
        """Start from a known hand pose instead of searching for one."""
        state = self._still_life.track.state.with_hand(T_camera_hand, joints)
        self._hypotheses = [self._source.hypothesis(side, state, 0.2)]
        self._side, self._place = side, state.values[:3]

    def step(self, frame: RgbdFrame, hurried: bool = False) -> SceneState:
        """Return hand and objects in one frame.

        Args:
            frame: the next one.
            hurried: whether newer ones wait behind it: then what can be put off is.

        Raises:
            ValueError: if `start` was not called.
        """
        if self._objects is None:
            raise ValueError("expected Tracker.start before Tracker.step")
        if self._frames == 0:
            self._source.finder.begin(frame, self._still_life.track)
        if self._answer is not None:
            answer, self._answer = self._answer, None
            self._join(answer, frame)
        self._hurried = hurried
        self._look(frame)
        for hypothesis in self._hypotheses:
            self._follow(hypothesis, frame)
        self._give_up_lost()
        self._compete()
        visible = bool(self._hypotheses)
        if not self._hypotheses:
            visible = self._search(frame, self._objects.complete)
        elif self._doubtful(self._hypotheses[0]):
            self._try_others(frame)
        self._frames += 1
        leader = self._hypotheses[0] if self._hypotheses else None
        side = leader.track.hand.side if leader else (self._side or "right")
        shape = leader.track.hand.shape if leader else self.shape.shape
        shown = Shown(leader or self._still_life, leader is not None, visible, side, shape)
        return published_state(frame.stamp, self._objects, shown, self.config.life.unseen_frames)

    def _doubtful(self, leader: Hypothesis) -> bool:
        """Return whether other starts are tried now, in a hurry those that networks see alone."""
        young = leader.age <= max(self.config.young_trials) and self._watch.told is not None
        return (young or not self._hurried) and self._source.judge.doubtful(leader, self._frames)

    def rehearse(self, frame: RgbdFrame) -> None:
        """Go once through what only a hand needs that the networks see and that fits well.

        The hand that is followed is taken for it; `forget_hand` and `start` forget it.
        """
        leader = self._hypotheses[0]
        joints = leader.track.joints(leader.track.state)
        pixels = pixels_of(frame.camera, joints)
        shape = (joints - joints[PALM].mean(axis=0)).astype(np.float64)
        seen = SeenHand(0, pixels, shape, 1.0, 1.0, square_of_key_points(pixels))
        self._watch.pretend(seen, frame.camera)
        self._source.seen_starts(frame)
        state, active = leader.track.state, leader.active
        problem = self._source.problem(leader, self._moment(frame), state, active)
        leader.track.fit(problem)
        self._person.calibrate(leader.track, problem)

    def _moment(self, frame: RgbdFrame) -> FrameContext:
        return FrameContext(frame, self._frames, self._side, self._place)

    def _look(self, frame: RgbdFrame) -> None:
        """Let the networks look at the hand that is followed, or at any if there is none."""
        leader = self._hypotheses[0] if self._hypotheses else None
        scene = (leader or self._still_life).track
        centers = [scene.state.position(1 + k) for k in range(len(self._still_life.lives))]
        objects = pixels_of(frame.camera, np.reshape(centers, (-1, 3)))
        expectation = Expectation(objects=objects, hurried=self._hurried)
        if leader is not None:
            joints = leader.track.joints(leader.track.predict())
            middle, seen = palm_pixel(frame.camera, joints), pixels_of(frame.camera, joints)
            judge, alone = self._source.judge, len(self._hypotheses) == 1
            settled, trusted = alone and judge.settled(leader), alone and judge.trusted(leader)
            doubted, hurried = judge.doubted(leader), self._hurried and leader.age > _NEW
            expectation = Expectation(middle, seen, settled, trusted, doubted, objects, hurried)
        around = self._around
        upright = around.T_table_camera[:3, :3] if around.table is not None else None
        tell = partial(self._person.told, frame, upright)
        self._watch.look(frame, expectation, tell)

    def _follow(self, hypothesis: Hypothesis, frame: RgbdFrame) -> None:
        """Fit one hypothesis to a frame and bring its record up to date."""
        track, lives = hypothesis.track, hypothesis.lives
        guess = track.predict()
        if self._watch.hand is not None and (hypothesis.gap or 0.0) < self.config.contradiction:
            guess = nudged(guess, track.joints(guess), self._watch.keys_of(track.hand.side))
        guess = expected(guess, lives)
        active = tuple(k for k, life in enumerate(lives) if life.active)
        problem = self._source.problem(hypothesis, self._moment(frame), guess, active)
        fit = track.tried(problem) if self._hurried else track.fit(problem)
        fit = reconsidered(hypothesis, problem, fit, self.config.life)
        track.accept(problem, fit)
        self._note(hypothesis, problem, fit)
        due = hypothesis is self._hypotheses[0] and self._frames % self.config.learn_period == 0
        if due and hypothesis.mean_cost < self.config.doubt_cost:
            track.learn(problem, self._around.appearance)
        self._learn_shape(hypothesis, problem, frame)

    def _learn_shape(self, hypothesis: Hypothesis, problem: Problem, frame: RgbdFrame) -> None:
        """Let key points of a young hand and well-fitted frames of an older one tell its shape."""
        track, seen = hypothesis.track, self._watch.hand
        poor = hypothesis.mean_cost > self.config.good_cost  # else depth knows the size better
        if seen is not None and poor and self._source.judge.supported(hypothesis):
            self._person.size(track, seen, frame)
        if len(self._hypotheses) > 1 or hypothesis.age < self.config.shape.first or self._hurried:
            return
        if max(hypothesis.mean_cost, track.cost) < self._source.judge.telling_cost(hypothesis):
            self._person.calibrate(track, problem)

    def _note(self, hypothesis: Hypothesis, problem: Problem, fit: Fit) -> None:
        view = problem.view
        hypothesis.fit, hypothesis.active = fit, problem.active
        pixel = (view.tile.depth * view.tile.step) ** 2
        area = float(pixel[view.pixels.label == OF_HAND].sum())
        hypothesis.thin = hypothesis.thin + 1 if area < self.config.least_area else 0
        hypothesis.age += 1
        hypothesis.patience = max(0, hypothesis.patience - 1)
        rate = max(_SMOOTHING, 1.0 / hypothesis.age)
        hypothesis.mean_cost += rate * (fit.cost - hypothesis.mean_cost)
        gap = self._source.judge.gap(hypothesis.track, hypothesis.track.state)
        if gap is not None:
            before = gap if hypothesis.gap is None else hypothesis.gap
            hypothesis.gap = before + _GAP_SMOOTHING * (gap - before)
        note_objects(hypothesis, problem, self.config.life, self._buffers)

    def _give_up_lost(self) -> None:
        """Forget hypotheses that follow no hand; what the leader knows of the objects is kept."""
        lost = [
            hypothesis for hypothesis in self._hypotheses if self._source.judge.lost(hypothesis)
        ]
        if lost and lost[0] is self._hypotheses[0]:
            state = lost[0].track.state
            if lost[0].age > max(self.config.young_trials):
                self._place = state.values[:3]
            far = start_state([state.pose(1 + k) for k in range(len(lost[0].lives))])
            self._still_life.track.state = self._still_life.track.before = far
            self._still_life.lives = lost[0].lives
        self._hypotheses = [one for one in self._hypotheses if one not in lost]

    def _compete(self) -> None:
        """Put the better hypothesis first; end the competition when it is clear."""
        if len(self._hypotheses) > 1:
            self._hypotheses.sort(key=self._source.judge.rank)
            first, second = self._hypotheses[:2]
            lead = self._source.judge.rank(second) - self._source.judge.rank(first)
            if first.age >= self.config.decision_frames or (
                first.age >= 3 and lead > self.config.decision_margin
            ):
                self._hypotheses = [first]
        if len(self._hypotheses) == 1:
            self._side = self._hypotheses[0].track.hand.side

    def _search(self, frame: RgbdFrame, complete: bool) -> bool:
        """Look for a hand; return whether there is anything like one."""
        moment = self._moment(frame)
        found = self._source.seen(moment)
        visible = bool(found)
        turn = complete and self._frames % self.config.search_period == 0
        # By depth alone where networks overlook what moves or have lost a hand.
        sought = self._watch.overlooked or self._watch.ever
        due = sought if self._watch.moving else turn
        if not found and (self._watch.trouble or (due and not self._hurried)):
            found, visible = self._source.found(moment)
        self._hypotheses = sorted(found, key=self._source.judge.rank)
        return visible or self._watch.hand is not None

    def _try_others(self, frame: RgbdFrame) -> None:
        """Replace the leading hypothesis if another start explains the frame better."""
        first = leader = self._hypotheses[0]
        moment, judge = self._moment(frame), self._source.judge
        for start in self._source.rival_starts(leader, moment):
            rival = self._source.rival(leader, start, moment)
            if rival is None:
                continue
            lead = judge.odd(leader) - judge.odd(rival)
            if self._watch.hand is not None:
                # Both are where it is seen: depth that explains the leader is believed.
                lead *= min(1.0, (leader.mean_cost / USUAL_COST) ** 2)
            cost = judge.judged(leader.track.cost)
            if judge.judged(rival.track.cost) < self.config.better * cost + lead:
                self._hypotheses = [rival]
                leader = rival
        if leader is first:
            leader.note_vain(self.config.vain_period)
