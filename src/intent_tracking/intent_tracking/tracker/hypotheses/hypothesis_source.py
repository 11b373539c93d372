"""Hypotheses about the hand: what the networks' key points and what depth alone start."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import RgbdFrame
from intent_tracking.fit.initialisation import HandStart
from intent_tracking.hands.hand_place import at_place
from intent_tracking.hands.hand_watch import HandWatch
from intent_tracking.hands.key_point_start import KeyPointStart
from intent_tracking.hands.seen_palm import palm_pixel, pixels_of
from intent_tracking.hands.skin_depth import hand_mask
from intent_tracking.image.appearance import HAND, color_bins
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_model import SIDES, Side
from intent_tracking.tracker.held_objects import ties_of
from intent_tracking.tracker.hypotheses.hand_finder import HandFinder, Search
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis
from intent_tracking.tracker.hypotheses.hypothesis_judge import GAP_COST, HypothesisJudge
from intent_tracking.tracker.object_life import ObjectLife
from intent_tracking.tracker.person_hands import PersonHands
from intent_tracking.tracker.problem import Problem, Surroundings
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig

USUAL_COST = 0.25
"""Cost of a fit beside which key points count as much as their weights say; the more depth leaves
unexplained, the more they count, by the third power and within these factors."""
_TRUST = 0.0, 4.0
_WORTH_A_TRIAL = 0.25
"""Starts this much worse than the best are not followed: a wrong side costs less at first."""


@dataclass(frozen=True, eq=False)
class FrameContext:
    """A frame, and what the search for a hand in it starts from."""

    frame: RgbdFrame
    number: int
    """Of the frame."""
    side: Side | None = None
    """Of the hand followed last; None: none has been."""
    place: Floats | None = None
    """(3,) where it was [m]."""


class HandHypotheses:
    """Starts hypotheses in one scene."""

    def __init__(
        self,
        config: TrackerConfig,
        around: Surroundings,
        watch: HandWatch,
        person: PersonHands,
        still_life: Hypothesis,
    ) -> None:
        """Prepare for a scene.

        Args:
            config: of the tracker.
            around: what is known of the scene.
            watch: what the networks see.
            person: the demonstrator's hands.
            still_life: the objects as they are without a hand.
        """
        self._config, self._around, self._watch = config, around, watch
        self.person, self._still_life = person, still_life
        self._track_config = replace(config.track, swarm_only=config.method == "pso")
        self.finder = HandFinder(config, around)
        self.judge = HypothesisJudge(config, around, watch)

    def join(self, around: Surroundings, frame: RgbdFrame, new: Sequence[int]) -> None:
        """Know other objects from now on, of which some (numbers) are new in a frame."""
        self._around = around
        self.finder.join(around, frame, self._still_life.track, new)
        self.judge = HypothesisJudge(self._config, around, self._watch)

    def hypothesis(self, side: Side, state: BodyState, cost: float) -> Hypothesis:
        """Return the hypothesis that a hand of a side is in a state."""
        track = SceneTrack(
            self.person.models[side], state, self._around.objects, self._track_config
        )
        track.cost = cost
        lives = [ObjectLife(life.rest, life.active, life.taken) for life in self._still_life.lives]
        return Hypothesis(track, lives, cost, gap=self.judge.gap(track, state))

    def problem(
        self,
        hypothesis: Hypothesis,
        moment: FrameContext,
        guess: BodyState,
        active: tuple[int, ...],
    ) -> Problem:
        """Return what a frame asks of a hypothesis next to a guess.

        Args:
            hypothesis: with its record.
            moment: the frame.
            guess: near which the state is sought.
            active: numbers of the objects that are fitted together with the hand.
        """
        ties = ties_of(hypothesis.lives, active, self._config.life)
        seed = moment.number + 1000 * self._config.seed
        keys = self._watch.keys_of(hypothesis.track.hand.side)
        trust = np.float32(np.clip((hypothesis.mean_cost / USUAL_COST) ** 3, *_TRUST))
        keys = keys._replace(weights=keys.weights * trust)
        return hypothesis.track.problem(moment.frame, guess, active, ties, self._around, keys, seed)

    def seen(self, moment: FrameContext) -> list[Hypothesis]:
        """Return what the networks' key points say, each fitted once."""
        found = []
        for start in self.seen_starts(moment.frame):
            state = self._still_life.track.state.replaced([], start.state)
            hypothesis = self.hypothesis(start.side, state, self._config.lost_cost)
            self._fit_once(hypothesis, moment, state)
            if hypothesis.mean_cost < self._config.accept_cost or self.judge.supported(hypothesis):
                found.append(hypothesis)
        return found

    def seen_starts(self, frame: RgbdFrame) -> list[KeyPointStart]:
        """Return starts from the networks' key points, and learn the colours of what they see."""
        told = self._watch.told
        starts = self.person.starts(told, frame) if told is not None else []
        if told is not None and starts:
            mask = hand_mask(frame.depth, told.pixels, starts[0].depth)
            self._around.appearance.learn(HAND, color_bins(frame.color[mask]))
        return starts

    def found(self, moment: FrameContext) -> tuple[list[Hypothesis], bool]:
        """Return what depth and colour alone say, and whether anything looks like a hand."""
        config = self._config
        if moment.number % config.learn_period == 0:
            self.finder.learn_background(moment.frame, self._still_life.track)
        found = self._starts(moment, SIDES, None)
        hypotheses: list[Hypothesis] = []
        if not found:
            return hypotheses, False
        early = self._around.table is not None and moment.number < config.still_frames
        limit = config.first_cost if early else config.accept_cost
        best: dict[Side, HandStart] = {}
        for candidate in found:
            best.setdefault(candidate.side, candidate)
        for side, candidate in best.items():
            cost = candidate.cost - (config.side_bias if side == moment.side else 0.0)
            state = self._still_life.track.state.replaced([], candidate.state)
            hypothesis = self.hypothesis(side, state, cost)
            palm, joints = _in_picture(hypothesis, moment.frame)
            comes = self._around.appearance.blind or self._watch.comes(joints)
            if not comes or self._idle(palm, joints):
                continue
            astray = GAP_COST * (hypothesis.gap or 0.0)
            likely = candidate.cost + astray < limit and cost < found[0].cost + _WORTH_A_TRIAL
            if likely and not self._watch.denies(moment.frame.color, joints):
                hypotheses.append(hypothesis)
        return hypotheses, True

    def rival_starts(
        self, leader: Hypothesis, moment: FrameContext
    ) -> Sequence[HandStart | KeyPointStart]:
        """Return the best start of each side that may be the leader's hand."""
        if self._watch.told is not None:
            return self.seen_starts(moment.frame)
        young = leader.age <= max(self._config.young_trials)
        sides = SIDES if young else (leader.track.hand.side,)
        best: dict[Side, HandStart] = {}
        place = leader.track.state.values[:3]
        for candidate in self._starts(moment, sides, leader):
            apart = float(np.linalg.norm(candidate.state.values[:3] - place))
            near = apart < self._config.farthest_rival
            if near or candidate.cost < self._config.far_better * leader.mean_cost:
                best.setdefault(candidate.side, candidate)
        return list(best.values())

    def rival(
        self, leader: Hypothesis, start: HandStart | KeyPointStart, moment: FrameContext
    ) -> Hypothesis | None:
        """Return what the leader would be with another start of the hand, fitted once.

        None where its side is settled, or where that hand idles.
        """
        if not self.judge.open_to(leader, start.side):
            return None
        state = leader.track.state.replaced([], start.state)
        rival = self.hypothesis(start.side, state, leader.mean_cost)
        rival.lives, rival.age, rival.active = leader.lives, leader.age, leader.active
        self._fit_once(rival, moment, state)
        if self._watch.told is None and self._idle(*_in_picture(rival, moment.frame)):
            return None
        return rival

    def _fit_once(self, hypothesis: Hypothesis, moment: FrameContext, state: BodyState) -> None:
        """Fit a hypothesis that has just been started."""
        track = hypothesis.track
        problem = self.problem(hypothesis, moment, state, hypothesis.active)
        fit = track.tried(problem)
        track.accept(problem, fit)
        track.before = track.state
        hypothesis.mean_cost, hypothesis.fit = fit.cost, fit
        hypothesis.gap = self.judge.gap(track, track.state)

    def _starts(
        self, moment: FrameContext, sides: tuple[Side, ...], leader: Hypothesis | None
    ) -> list[HandStart]:
        """Return refined starts of the given sides in a frame, best first."""
        track = (leader or self._still_life).track
        place = leader.track.state.values[:3] if leader is not None else moment.place
        hands = {side: self.person.models[side] for side in sides}
        return self.finder.starts(moment.frame, Search(moment.number, hands, track, place))

    def _idle(self, palm: Array, joints: Array) -> bool:
        """Return whether palm (2,) and joints (21, 2) [px] are of a hand that idles.

        It does nothing while another one acts.
        """
        return any(at_place(hand, palm) for hand in self._watch.idle) or self._watch.rests(joints)


def _in_picture(hypothesis: Hypothesis, frame: RgbdFrame) -> tuple[Array, Array]:
    """Return palm (2,) and joints (21, 2) of a hypothesis [px]."""
    joints = hypothesis.track.joints(hypothesis.track.state)
    return palm_pixel(frame.camera, joints), pixels_of(frame.camera, joints)
