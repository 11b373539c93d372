"""From a grasp or a reach to the probability of each task (Sec. IV-C)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from intent_inference.intention.reach import ReachConfig, ReachFilter
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


@dataclass(frozen=True)
class Contribution:
    """How much one piece of evidence moved one task."""

    task: str
    variable: str
    log_odds: float
    """Calibrated log-odds with the variable less those without it."""


@dataclass(frozen=True, eq=False)
class TaskPosterior:
    """What one hand's grasp of one object, or its reach towards it, says about the tasks."""

    stamp: int
    """Stamp of the grasp or frame [ns]."""
    object_id: str
    object_class: str
    tasks: tuple[str, ...]
    probability: Array
    """(T,) p(task | evidence) of each task's networks; they need not sum to one."""
    best: str | None
    """Most probable task above the threshold; None: none of these tasks."""
    above_threshold: tuple[str, ...]
    """Tasks that the grasp is good for, most probable first."""
    preliminary: bool
    """The hand is still reaching: a forecast from the frames so far."""
    unknown_score: float
    """-log p(evidence): high for an object or grasp unlike all in training."""
    missing: tuple[str, ...]
    """Variables of the model that were not observed."""
    explanation: tuple[Contribution, ...]
    """Every observed variable and task, the largest effect first."""

    def __post_init__(self) -> None:
        """Refuse what is no probability of the tasks."""
        if self.probability.shape != (len(self.tasks),) or not np.all(
            (self.probability >= 0.0) & (self.probability <= 1.0)
        ):
            raise ValueError(
                f"expected a probability in 0..1 of {', '.join(self.tasks)}, "
                f"got {self.probability.tolist()}"
            )
        named = {self.best, *self.above_threshold} - {None}
        if not named <= set(self.tasks):
            raise ValueError(f"expected {', '.join(map(str, named))} among the tasks {self.tasks}")


@dataclass(frozen=True)
class InferenceConfig(Checked):
    """How evidence becomes a posterior."""

    model: str = ""
    """Model file; empty: the shipped BN^H."""
    models: str = ""
    """Object database (YAML file or folder); empty: the shipped objects."""
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
        self._prior = float(np.log(self._config.prior / (1.0 - self._config.prior)))

    @property
    def model(self) -> TaskModel:
        """The networks that are asked."""
        return self._model

    def reset(self) -> None:
        """Forget the reach so far."""
        self._reach.reset()

    def rehearse(self) -> None:
        """Go through an invented grasp, so that the first real one finds everything loaded."""
        detector = GraspDetector(self.database)
        for state in rehearsal_states(self.database.example, 12):
            self.step(state)
            if (grasp := detector.step(state)) is not None:
                self.step(grasp)
        self.reset()

    def step(self, observation: StableGrasp | SceneState) -> TaskPosterior | None:
        """Return the posterior of a stable grasp, or a preliminary one of a frame of a reach.

        A frame says nothing (None) while no hand is tracked, none is near an object, or the grasped
        object has not been let go of.
        """
        if isinstance(observation, StableGrasp):
            return self._final(observation)
        return self._preliminary(observation)

    def _final(self, grasp: StableGrasp) -> TaskPosterior:
        self._reach.hold(grasp.object_id)
        features = stack_features([grasp.features])
        deviations = least_deviations(features, self._config, stack_features([grasp.std]))
        evidence = self._model.evidence(features, deviations)
        odds = None
        if self._config.engine == "junction-tree":
            odds = junction_tree_log_odds(self._model, evidence)
        log_odds = self._model.calibrated_log_odds(evidence, odds)[0] + self._prior
        return self._posterior(
            grasp.stamp, grasp.object_id, grasp.object_class, log_odds, evidence, False
        )

    def _preliminary(self, state: SceneState) -> TaskPosterior | None:
        found = self._reach.step(state)
        if found is None:
            return None
        index = found.target
        return self._posterior(
            state.stamp, state.object_ids[index], state.object_classes[index],
            found.log_odds + self._prior, found.evidence, True,
        )  # fmt: skip

    def _posterior(
        self, stamp: int, object_id: str, object_class: str, log_odds: Array,
        evidence: SoftEvidence, preliminary: bool,
    ) -> TaskPosterior:  # fmt: skip
        probability = sigmoid(log_odds)
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
            best=above[0] if above else None,
            above_threshold=above,
            preliminary=preliminary,
            unknown_score=-float(self._model.log_evidence_of(evidence)[0]),
            missing=missing,
            explanation=explain(self._model, evidence) if self._config.explain else (),
        )


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


def explain(model: TaskModel, evidence: SoftEvidence) -> tuple[Contribution, ...]:
    """Return how the log-odds of every task fall when each observed variable is removed.

    Args:
        model: the networks.
        evidence: one observation.
    """
    names = [name for name in model.variables if name in evidence.observed]
    names = [name for name in names if evidence.observed[name][0]]
    cases = [evidence, *(evidence.without(model.bank, (name,)) for name in names)]
    stacked = SoftEvidence(
        np.concatenate([case.likelihoods[:1] for case in cases]),
        np.concatenate([case.log_scale[:1] for case in cases]),
        {name: np.array([case.observed[name][0] for case in cases]) for name in evidence.observed},
    )
    log_odds = model.calibrated_log_odds(stacked)
    effects = [
        Contribution(task, name, float(log_odds[0, column] - log_odds[row, column]))
        for row, name in enumerate(names, start=1)
        for column, task in enumerate(model.tasks)
    ]
    return tuple(sorted(effects, key=lambda effect: -abs(effect.log_odds)))
