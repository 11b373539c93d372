"""What the networks are compared with, on the same splits and the same variables."""

from collections.abc import Sequence

import numpy as np

from intent_inference.quantisation.feature_table import Features, is_observed, select_variables
from intent_inference.quantisation.variables import OBJECT_CLASS, coordinates_of
from intent_perception.basics.arrays import Array


def class_only(train: Features, labels: Array, test: Features) -> Array:
    """Return how often each test row's object class affords the task in training, (N,)."""
    names = np.asarray(train[OBJECT_CLASS], dtype=str)
    rates = {
        name: (float(labels[names == name].sum()) + 1.0) / (float((names == name).sum()) + 2.0)
        for name in np.unique(names)
    }
    return np.array([rates.get(str(name), 0.5) for name in test[OBJECT_CLASS]])


def boosting(train: Features, labels: Array, test: Features, variables: Sequence[str]) -> Array:
    """Return scikit-learn's HistGradientBoosting probabilities, its defaults, (N,).

    It sees the coordinates that the networks see (6-D rotation form, log lengths); the class is one
    column of categories, unknown values are NaN.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier

    names = sorted({str(n) for n in train.get(OBJECT_CLASS, np.zeros(0, str)).tolist()})
    known, asked = _columns(train, variables, names), _columns(test, variables, names)
    categories = [OBJECT_CLASS in train and OBJECT_CLASS in variables]
    categories += [False] * (known.shape[1] - 1)
    model = HistGradientBoostingClassifier(
        categorical_features=categories if categories[0] else None, random_state=0
    )
    return np.asarray(model.fit(known, labels).predict_proba(asked)[:, 1])


def _columns(features: Features, variables: Sequence[str], classes: Sequence[str]) -> Array:
    columns: list[Array] = []
    for name, values in select_variables(features, variables).items():
        if name == OBJECT_CLASS:
            index = {c: float(i) for i, c in enumerate(classes)}
            columns.insert(0, np.array([[index.get(str(v), np.nan)] for v in values]))
            continue
        known = is_observed(features, name)
        width = coordinates_of(name).embed(values[known][:1]).shape[1]
        filled = np.full((len(values), width), np.nan)
        filled[known] = coordinates_of(name).embed(values[known])
        columns.append(filled)
    return np.concatenate(columns, axis=1)
