"""What a grasp or a reach says about the tasks."""

from dataclasses import dataclass

import numpy as np

from intent_inference.intention.contributions import Contribution
from intent_inference.motion.measures import MEASURES
from intent_inference.motion.motion_network import NOTHING, PHASES
from intent_perception.basics.arrays import Array

STAGES = ("REACH", *PHASES)


@dataclass(frozen=True, eq=False)
class TaskPosterior:
    """What one hand's grasp of one object, or its reach towards it, says about the tasks."""

    stamp: int
    """Stamp of the grasp or frame [ns]."""
    object_id: str
    object_class: str
    tasks: tuple[str, ...]
    probability: Array
    """(T,) what the grasp *affords*: p(task | evidence) of each task's networks; they need not sum
    to one."""
    intends: Array
    """(T + 1,) what the person *means*, by prior, grasp and motion so far: one distribution over
    the tasks and, last, "none of these"; sums to one."""
    stage: str
    """One of `STAGES`."""
    best: str | None
    """Most probable of `intends` among the tasks that the grasp is good for; None: none."""
    above_threshold: tuple[str, ...]
    """Tasks that the grasp is good for, most probable first."""
    preliminary: bool
    """No grasp has been stable yet: a forecast from the frames so far."""
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
        if self.intends.shape != (len(self.tasks) + 1,) or not (
            np.all(self.intends >= 0.0) and abs(float(self.intends.sum()) - 1.0) < 1e-6
        ):
            raise ValueError(
                f"expected intends over {', '.join(self.meanings)} that sums to one, "
                f"got {self.intends.tolist()}"
            )
        if self.stage not in STAGES:
            raise ValueError(f"expected a stage of {', '.join(STAGES)}, got {self.stage!r}")
        named = {self.best, *self.above_threshold} - {None}
        if not named <= set(self.tasks):
            raise ValueError(f"expected {', '.join(map(str, named))} among the tasks {self.tasks}")

    @property
    def grasp_explanation(self) -> tuple[Contribution, ...]:
        """What moved `probability`; the rest of the explanation is of the motion and does not."""
        return tuple(one for one in self.explanation if one.variable not in MEASURES)

    @property
    def meanings(self) -> tuple[str, ...]:
        """What `intends` is about: the tasks and, last, none of these."""
        return (*self.tasks, NOTHING)
