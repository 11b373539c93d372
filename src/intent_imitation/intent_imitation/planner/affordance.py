"""p(task | object, grasp) under BN^R for an object whose class is known only softly (Sec. II-B)."""

from collections.abc import Mapping

import numpy as np

from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import Features, count_rows
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_perception.basics.arrays import Array

_NEGLIGIBLE = 0.005
_AFFORDS = 0.1
"""A class affords a task if p(t | class) is at least this, the task as likely as not a priori."""


def task_chances(model: TaskModel, features: Features, kinds: Mapping[str, float]) -> Array:
    """Return p(t | o, a, c) = sum over k of p(k | shape) p(t | k, o, a, c), (N, T).

    Two things keep generative networks from bold answers where they have seen nothing. A task that
    no grasp of a class has afforded stays at p(t | k), however odd the other features are. And for
    an object of no known kind, what the networks say without a class is scaled by the share of the
    known kinds that afford the task: nobody expects to pour from a thing of which he knows only
    that half of all things pour.

    Args:
        model: BN^R.
        features: N rows of one object.
        kinds: p(class | shape); what is missing to 1 is the chance of no known class. Empty:
            nothing is known of kinds, and the networks speak for themselves.
    """
    if not kinds:
        return model.posterior(features)
    rows = count_rows(features)
    of_classes = class_chances(model)
    result = np.zeros((rows, len(model.tasks)))
    for name, chance in kinds.items():
        if chance > _NEGLIGIBLE:
            known: Features = {**features, OBJECT_CLASS: np.full(rows, name)}
            told = model.posterior(known)
            alone = of_classes.get(name)
            if alone is not None:
                told = np.where(alone < _AFFORDS, np.minimum(told, alone), told)
            result += chance * told
    unlike = 1.0 - sum(kinds.values())
    if unlike > _NEGLIGIBLE:
        blank: Features = {**features, OBJECT_CLASS: np.full(rows, "")}
        fitting = [chances >= _AFFORDS for chances in of_classes.values()]
        share = np.mean(fitting, axis=0) if fitting else np.ones(len(model.tasks))
        result += unlike * share * model.posterior(blank)
    return result


def class_chances(model: TaskModel) -> dict[str, Array]:
    """Return p(t | class) (T,) of every class that BN^R knows."""
    if not model.classes:
        return {}
    chances = model.posterior({OBJECT_CLASS: np.array(model.classes)})
    return dict(zip(model.classes, chances, strict=True))
