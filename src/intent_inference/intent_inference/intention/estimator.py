"""From a grasp or a reach to the probability of each task (Sec. IV-C)."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from intent_inference.intention.class_priors import ClassPriors
from intent_inference.intention.contributions import Contribution, explain
from intent_inference.intention.held_intention import HeldIntention, Rests, intended
from intent_inference.intention.reach import ReachConfig, ReachFilter, ReachForecast
from intent_inference.intention.task_posterior import TaskPosterior
from intent_inference.motion.motion_network import MotionNetwork, shipped_motion
from intent_inference.network.junction_tree import junction_tree_log_odds
from intent_inference.network.model_file import load_model, shipped_model
from intent_inference.network.probability_calibration import sigmoid
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import Features, stack_features
from intent_inference.quantisation.soft_evidence import SoftEvidence
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_detector import GraspDetector, StableGrasp
from intent_tracking.grasp.rehearsal_states import rehearsal_states
from intent_tracking.scene.scene_state import SceneState

_AT_AN_END = 0.08
"""A long thing may be held at its end: the palm may be so much farther away [m]."""
_JITTER = 0.01
"""Stamps of cameras are early or late by so much [s]."""


@dataclass(frozen=True)
class InferenceConfig(Checked):
    """How evidence becomes a posterior."""

    model: str = ""
    """Model file; empty: the shipped BN^H."""
    models: str = ""
    """Object database (YAML file or folder); empty: the shipped objects."""
    motion: str = ""
    """Motion network that `train_motion` wrote; empty: the shipped one."""
    priors: str = ""
    """YAML file of how often people mean each task, {class or any: {task: weight}}; empty: every
    task alike, none of these half as often."""
    threshold: float = 0.5
    """A grasp is good for the tasks whose probability is above this, 0.001..0.999."""
    prior: float = 0.5
    """Probability of a task before any evidence; training is balanced (0.5); 0.001..0.999."""
    least_direction_std: float = 0.10
    """Least uncertainty of the hand's orientation [rad]: trackers are off by more than they say;
    0..3.1."""
    least_position_std: float = 0.06
    """Least uncertainty of the unit grasp position, 0..2."""
    least_joint_std: float = 0.15
    """Least uncertainty of a joint angle [rad], 0..3.1."""
    engine: Literal["compiled", "junction-tree"] = "compiled"
    """compiled: the schedule; junction-tree: pgmpy's, a slow reference, for final posteriors."""
    explain: bool = True
    """Say how much each piece of evidence moved each task."""
    reach_memory: float = ReachConfig.memory
    """Time constant of the filter over frames while the hand reaches [s], 0.001..10."""
    reach_range: float = ReachConfig.range
    """Gap between hand and object beyond which nothing is said [m], 0..5."""
    period: float = 0.1
    """Every frame counts, but of the same reach or motion word is given so often; of another
    object, stage or best task at once [s]; 0: in every frame; 0..10."""


class IntentionEstimator:
    """Final posteriors of stable grasps and preliminary ones of reaching hands."""

    def __init__(self, config: InferenceConfig | None = None) -> None:
        """Load the model and the objects.

        Raises:
            ModelFileError: if the model file cannot be used.
        """
        self._config = config or InferenceConfig()
        self._model = load_model(self._config.model) if self._config.model else shipped_model()
        reach = ReachConfig(memory=self._config.reach_memory, range=self._config.reach_range)
        self.database = ObjectDatabase.load(self._config.models or None)
        """Objects that may be held; it learns shapes that are estimated on the way."""
        self._reach = ReachFilter(self._model, self.database, reach)
        self._release = reach.release
        self._motion = _motion_of(self._config.motion)
        self._priors = ClassPriors({})
        if self._config.priors:
            self._priors = ClassPriors.load(self._config.priors)
        self._prior = float(np.log(self._config.prior / (1.0 - self._config.prior)))
        self.reset()

    @property
    def model(self) -> TaskModel:
        """The networks that are asked."""
        return self._model

    def reset(self) -> None:
        """Forget reach, grasp and motion so far."""
        self._reach.reset()
        self._rests = Rests()
        self._held: HeldIntention | None = None
        self._last: TaskPosterior | None = None
        self._affords = np.zeros(len(self._model.tasks))
        self._came_from: Array | None = None
        self._newest = -1
        self._told: tuple[int, tuple[str | None, ...]] | None = None

    def rehearse(self) -> None:
        """Go through an invented grasp, so that the first real one finds everything loaded."""
        detector = GraspDetector(self.database)
        for state in rehearsal_states(self.database.example, 12):
            self.step(state)
            if (grasp := detector.step(state)) is not None:
                self.step(grasp)
        self.reset()

    def step(self, observation: StableGrasp | SceneState) -> TaskPosterior | None:
        """Return the posterior of a stable grasp or of a frame: of a reach, then of the motion.

        A frame says nothing (None) while no hand is tracked, while none is near an object, and
        where it is too much like the one of which word was given last.
        """
        if isinstance(observation, StableGrasp):
            return self._grasped(observation)
        return self._frame(observation)

    def _grasped(self, grasp: StableGrasp) -> TaskPosterior:
        self._reach.hold(grasp.object_id)
        features = stack_features([grasp.features])
        deviations = least_deviations(features, self._config, stack_features([grasp.std]))
        evidence = self._model.evidence(features, deviations)
        odds = None
        if self._config.engine == "junction-tree":
            odds = junction_tree_log_odds(self._model, evidence)
        self._affords = self._model.calibrated_log_odds(evidence, odds)[0]
        if self._held is None or self._held.object_id != grasp.object_id:
            self._held = self._taken(grasp.object_id, grasp.object_class)
        self._last = self._posterior(
            grasp.stamp, grasp.object_id, grasp.object_class, self._affords, evidence,
            self._held.intends(self._affords), "GRASP", preliminary=False,
        )  # fmt: skip
        return self._with_motion(self._last)

    def _taken(self, object_id: str, object_class: str) -> HeldIntention:
        return HeldIntention(
            self._motion, self._model.tasks, self._priors, object_id, object_class,
            known=object_class in self._model.classes,
        )  # fmt: skip

    def _frame(self, state: SceneState) -> TaskPosterior | None:
        if state.stamp < self._newest:  # another recording begins
            self.reset()
        self._newest = state.stamp
        if not state.hand_tracked:
            self._reach.step(state)
            self._rests.step(state, () if self._held is None else (self._held.object_id,))
            return None
        if self._came_from is None:
            self._came_from = state.T_table_hand[:3, 3]
        gaps = self._reach.gaps(state)
        self._rests.step(state, [name for name, gap in gaps.items() if gap < self._release])
        held = self._held
        if held is not None and self._let_go(held, gaps):
            self._held, self._came_from = None, state.T_table_hand[:3, 3]
            last, self._last = self._last, None
            if last is not None:  # the object has been let go of: the last word about it
                self._reach.step(state, gaps)
                return replace(last, stamp=state.stamp, stage="PUT_BACK")
        if self._held is not None and self._last is not None:
            return self._moving(state, self._held, self._last, gaps)
        found = self._reach.step(state, gaps)
        return None if found is None else self._forecast(state, found, gaps)

    def _forecast(
        self, state: SceneState, found: ReachForecast, gaps: dict[str, float]
    ) -> TaskPosterior | None:
        """Return what the reach says; a lifted object's motion counts before the grasp."""
        name, kind = state.object_ids[found.target], state.object_classes[found.target]
        lifted = self._rests.left(name, state.T_table_objects[found.target])
        stage, intends = "REACH", intended(
            self._priors.of(kind, self._model.tasks), found.log_odds,
            known=kind in self._model.classes,
        )  # fmt: skip
        if lifted and gaps[name] < self._release + _AT_AN_END:
            if self._held is None or self._held.object_id != name:
                self._held = self._taken(name, kind)
            self._held.hold(gaps[name])
            self._follow(state, self._held)
            intends, stage = self._held.intends(found.log_odds), self._held.stage(found.log_odds)
        else:
            self._held = None
        if not self._due(state.stamp, name, stage):
            return None
        return self._posterior(
            state.stamp, name, kind, found.log_odds, found.evidence, intends, stage,
            preliminary=True,
        )  # fmt: skip

    def _let_go(self, held: HeldIntention, gaps: dict[str, float]) -> bool:
        """Return whether the palm is away from an object, farther than while it was held."""
        usual = max(self._release, held.palm_gap + _AT_AN_END)
        return gaps.get(held.object_id, 0.0) >= usual

    def _moving(
        self, state: SceneState, held: HeldIntention, last: TaskPosterior, gaps: dict[str, float]
    ) -> TaskPosterior | None:
        """Return the grasp's posterior with what the motion up to this frame adds."""
        if held.object_id not in state.object_ids:
            return None
        held.hold(gaps.get(held.object_id, 0.0))
        self._follow(state, held)
        intends = held.intends(self._affords)
        self._last = replace(
            last, stamp=state.stamp, intends=intends, stage=held.stage(self._affords),
            best=_best(last.tasks, last.above_threshold, intends),
        )  # fmt: skip
        if not self._due(state.stamp, held.object_id, self._last.stage, self._last.best):
            return None
        return self._with_motion(self._last)

    def _due(self, stamp: int, *word: str | None) -> bool:
        """Return whether to give word of a frame: of something else at once, else now and then."""
        if self._told is not None and self._told[1] == word:
            elapsed = (stamp - self._told[0]) * 1e-9
            if elapsed < self._config.period - _JITTER:
                return False
        self._told = stamp, word
        return True

    def _follow(self, state: SceneState, held: HeldIntention) -> None:
        index = state.object_ids.index(held.object_id)
        rest = self._rests.of(held.object_id)
        if rest is not None:
            held.step(state, index, rest, self._came_from)

    def _with_motion(self, posterior: TaskPosterior) -> TaskPosterior:
        """Return the posterior with what each measure of motion moved among its reasons."""
        if not self._config.explain or self._held is None:
            return posterior
        moved = tuple(
            Contribution(task, name, float(values[column]))
            for name, values in self._held.moved().items()
            for column, task in enumerate(posterior.tasks)
        )
        return replace(posterior, explanation=(*posterior.explanation, *moved))

    def _posterior(
        self, stamp: int, object_id: str, object_class: str, affords: Array,
        evidence: SoftEvidence, intends: Array, stage: str, *, preliminary: bool,
    ) -> TaskPosterior:  # fmt: skip
        probability = sigmoid(affords + self._prior)
        order = np.argsort(-probability)
        tasks = self._model.tasks
        above = tuple(tasks[i] for i in order if probability[i] > self._config.threshold)
        missing = tuple(
            name for name in self._model.variables
            if name not in evidence.observed or not evidence.observed[name][0]
        )  # fmt: skip
        return TaskPosterior(
            stamp=stamp,
            object_id=object_id,
            object_class=object_class,
            tasks=tasks,
            probability=probability,
            intends=intends,
            stage=stage,
            best=_best(tasks, above, intends),
            above_threshold=above,
            preliminary=preliminary,
            unknown_score=-float(self._model.log_evidence_of(evidence)[0]),
            missing=missing,
            explanation=explain(self._model, evidence) if self._config.explain else (),
        )


def _best(tasks: tuple[str, ...], above: tuple[str, ...], intends: Array) -> str | None:
    """Return the task most probably meant of those that the grasp is good for."""
    return max(above, key=lambda task: intends[tasks.index(task)], default=None)


def _motion_of(path: str) -> MotionNetwork:
    return MotionNetwork.load(Path(path)) if path else shipped_motion()


def least_deviations(
    features: Features, config: InferenceConfig, std: Features | None = None
) -> Features:
    """Return standard deviations of tracked features, not below what trackers are known to reach.

    Args:
        features: N grasps.
        config: the least standard deviations.
        std: what the tracker says, (N) rows, NaN where it says nothing.
    """
    given = dict(std or {})
    given.pop(OBJECT_CLASS, None)
    least = {
        # Each component of a quaternion moves by half the angle.
        "dir": config.least_direction_std / 2.0,
        "npos": config.least_position_std,
        "fcon": config.least_joint_std,
    }
    for name, floor in least.items():
        if name in features:
            known = np.nan_to_num(given.get(name, np.zeros_like(features[name])), nan=0.0)
            given[name] = np.maximum(known, floor)
    return {name: values for name, values in given.items() if name in features}
