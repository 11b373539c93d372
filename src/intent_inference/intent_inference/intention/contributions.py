"""Why a task is probable: what each piece of evidence moved."""

from dataclasses import dataclass

import numpy as np

from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.soft_evidence import SoftEvidence


@dataclass(frozen=True)
class Contribution:
    """How much one piece of evidence moved one task."""

    task: str
    variable: str
    log_odds: float
    """Calibrated log-odds with the variable less those without it; of a measure of motion, what it
    added to log p(motion | task) less the mean over the meanings."""


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
