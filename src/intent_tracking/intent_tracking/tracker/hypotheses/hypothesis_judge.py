"""What speaks for and against a hypothesis: its fit, its posture, and what the networks see."""

from intent_tracking.hands.hand_watch import GONE, HandWatch
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_model import Side
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis, unusual_roll
from intent_tracking.tracker.problem import Surroundings
from intent_tracking.tracker.scene_track import SceneTrack
from intent_tracking.tracker.tracker_config import TrackerConfig

GAP_COST = 8.0
"""Cost of a hand beside its key points [1/m]: 25 mm are worth a fifth of its pixels."""
_FARTHEST_GAP = 0.10
"""Distance beyond which it does not matter how far beside its key points a hand is [m]."""
_SIDE_COST = 0.3
"""Cost of a side that the networks exclude."""
_SURE, _SURE_AGE = 0.8, 4
"""Probability of the other side, and frames since a hand is seen, from which a side is doubted."""
_EXPLAINED = 0.15
"""Cost of a fit from which on down depth explains the hand."""
_LEAST_LIKELY = 0.12
"""Probability of its side with which an old hypothesis keeps it."""
_THIN = 3
"""Frames in a row with hardly a hand pixel after which there is no hand."""


class HypothesisJudge:
    """Ranks hypotheses about one scene, doubts them and gives them up."""

    def __init__(self, config: TrackerConfig, around: Surroundings, watch: HandWatch) -> None:
        self._config, self._around, self._watch = config, around, watch

    def gap(self, track: SceneTrack, state: BodyState) -> float | None:
        """Return how far joints lie beside what the networks see [m]; None: they see nothing."""
        gap = track.key_gap(self._watch.keys_of(track.hand.side), state)
        return min(gap, _FARTHEST_GAP) if gap >= 0.0 else None

    def rank(self, hypothesis: Hypothesis) -> float:
        """Return the smoothed cost and what speaks against the hand beside it; least is best."""
        return self.judged(hypothesis.mean_cost) + self.odd(hypothesis)

    def judged(self, cost: float) -> float:
        """Return a cost as far as it says anything: all that is lost is equally so."""
        return min(cost, self._config.lost_cost)

    def odd(self, hypothesis: Hypothesis) -> float:
        """Return the cost of a hand's roll and of where and on which side the networks see it."""
        seen = self._watch.seen
        trust = 1.0 if seen is None else seen.explained
        odd = self._unusual(hypothesis) + GAP_COST * trust * (hypothesis.gap or 0.0)
        return odd + _SIDE_COST * (1.0 - self._likely_side(hypothesis))

    def _likely_side(self, hypothesis: Hypothesis) -> float:
        """Return the networks' probability of the hand's side; 1 where they see none."""
        seen = self._watch.seen
        if seen is None:
            return 1.0
        return seen.right if hypothesis.track.hand.side == "right" else 1.0 - seen.right

    def _unusual(self, hypothesis: Hypothesis) -> float:
        """Return what the hand's roll adds to the cost; nothing where no table says what is up."""
        if self._around.table is None:
            return 0.0
        track = hypothesis.track
        rotation = self._around.T_table_camera[:3, :3] @ track.state.rotations[0]
        return self._config.unusual_roll * unusual_roll(track.hand.side, rotation)

    def supported(self, hypothesis: Hypothesis) -> bool:
        """Return whether the networks see a hand where this one is.

        Then its cost says little: pixels of cloth or of white skin, or without depth, are shared
        out wrongly and cost as much as a hand in the wrong place does.
        """
        agreed = hypothesis.gap is not None and hypothesis.gap < self._config.contradiction
        return agreed and self._watch.seen is not None

    def telling_cost(self, hypothesis: Hypothesis) -> float:
        """Return the cost below which a fit tells the hand's shape.

        A wrong shape costs as well: a hand that the networks see just there need not fit so well.
        """
        agreed = hypothesis.gap is not None and hypothesis.gap < self._config.agreement
        seen = agreed and self._watch.hand is not None
        return self._config.lost_cost if seen else self._config.good_cost

    def settled(self, hypothesis: Hypothesis) -> bool:
        """Return whether fit and networks agree so well that not every frame must be read.

        Where depth explains the hand as well as it can, key points hardly count: then it is enough
        that they do not contradict.
        """
        old = hypothesis.age > self._config.decision_frames
        explained = hypothesis.mean_cost < _EXPLAINED
        limit = self._config.contradiction if explained else self._config.agreement
        agreed = hypothesis.gap is not None and hypothesis.gap < limit
        return old and agreed and hypothesis.mean_cost < self._config.doubt_cost

    def trusted(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hand fits so well that the networks may read it where it is."""
        near = hypothesis.gap is None or hypothesis.gap < self._config.contradiction
        return near and hypothesis.mean_cost < self._config.trust_cost

    def doubted(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hand fits so badly that the better network shall read it."""
        return hypothesis.mean_cost > self._config.careful_cost

    def lost(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hypothesis follows no hand any more, or none that acts."""
        if self._watch.resting:
            return True
        unseen = self._watch.ever and self._watch.missed >= GONE
        limit = self._config.good_cost if unseen else self._config.lost_cost
        poor = hypothesis.thin >= _THIN or hypothesis.mean_cost > limit
        return poor and not self.supported(hypothesis)

    def doubtful(self, hypothesis: Hypothesis, frame: int) -> bool:
        """Return whether other starts shall be tried: often when young, then when it fits badly."""
        config = self._config
        if hypothesis.age in config.young_trials and hypothesis.mean_cost > config.good_cost:
            return True
        if hypothesis.patience > 0:
            return False
        if self._contradicted(hypothesis):
            return True
        urgent = hypothesis.track.cost > config.urgent_cost
        due = urgent or frame % config.doubt_period == 0
        return due and hypothesis.age > 2 and hypothesis.mean_cost > config.doubt_cost

    def _contradicted(self, hypothesis: Hypothesis) -> bool:
        """Return whether the networks see the hand elsewhere or on the other side."""
        if hypothesis.gap is not None and hypothesis.gap > self._config.contradiction:
            return True
        seen = self._watch.seen
        old = seen is not None and seen.age > _SURE_AGE
        return old and self._likely_side(hypothesis) < 1.0 - _SURE

    def open_to(self, hypothesis: Hypothesis, side: Side) -> bool:
        """Return whether a hand of a side may take over.

        An old hypothesis keeps its side unless the networks name the other one.
        """
        if side == hypothesis.track.hand.side or hypothesis.age <= self._config.decision_frames:
            return True
        return self._likely_side(hypothesis) < _LEAST_LIKELY
