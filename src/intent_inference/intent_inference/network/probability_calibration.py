"""Log-odds that mean what they say, for each set of observed variables."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import exact_kernel

_LARGEST = 30.0
_SLOPE = 0.1
"""Of the map beyond its outermost knots."""
_ROUNDS = 50


@dataclass(frozen=True, eq=False)
class OddsCalibration:
    """Increasing map from the networks' log-odds to calibrated ones, for one set of variables."""

    observed: tuple[str, ...]
    """Variables that were known when it was fitted."""
    weights: Array
    """(M,) weight of each network's log-odds, not negative."""
    knots: Array
    """(J,) weighted log-odds, increasing."""
    levels: Array
    """(J,) calibrated log-odds at the knots, increasing."""

    def apply(self, log_odds: Array) -> Array:
        """Return calibrated log-odds (N,) of the networks' log-odds (N, M)."""
        result: Array = _calibrated(log_odds, self.weights, self.knots, self.levels)
        return result


@exact_kernel
def _calibrated(log_odds: Array, weights: Array, knots: Array, levels: Array) -> Array:
    """Return the piecewise-linear map of the weighted log-odds (N, M) -> (N,)."""
    result = np.empty(log_odds.shape[0])
    last = len(knots) - 1
    for n in range(log_odds.shape[0]):
        score = 0.0
        for m in range(len(weights)):
            score += weights[m] * min(max(log_odds[n, m], -_LARGEST), _LARGEST)
        # Straight on beyond the knots, so that the order of extreme cases is kept.
        if score <= knots[0]:
            result[n] = levels[0] + _SLOPE * (score - knots[0])
        elif score >= knots[last]:
            result[n] = levels[last] + _SLOPE * (score - knots[last])
        else:
            j = np.searchsorted(knots, score, side="right") - 1
            share = (score - knots[j]) / (knots[j + 1] - knots[j])
            result[n] = levels[j] + share * (levels[j + 1] - levels[j])
    return result


def sigmoid(log_odds: Array) -> Array:
    """Return probabilities of log-odds."""
    result: Array = 1.0 / (1.0 + np.exp(-np.clip(log_odds, -700.0, 700.0)))
    return result


def fit_calibration(
    observed: Sequence[str],
    log_odds: Array,
    labels: Array,
    weights: Array,
    knots: int = 9,
    ridge: float = 0.02,
) -> OddsCalibration:
    """Return the calibration of held-out predictions.

    A logistic stack with non-negative weights, held near their mean, joins the networks; a monotone
    piecewise-linear map through quantiles of the joined score corrects what a line cannot.

    Args:
        observed: variables that were known.
        log_odds: (N, M) held-out log-odds of M networks.
        labels: (N,) 0 or 1.
        weights: (N,) of the rows.
        knots: number of quantile bins of the monotone map.
        ridge: pull of the weights towards their common mean.

    Raises:
        ValueError: if only one label occurs.
    """
    if len(np.unique(labels)) < 2:
        raise ValueError("expected both labels among the held-out rows")
    clipped = np.clip(log_odds, -_LARGEST, _LARGEST)
    stack = _stack(clipped, labels, weights, ridge)
    score = clipped @ stack
    order = np.argsort(score)
    # Bins of equal total weight.
    place = np.cumsum(weights[order]) / weights.sum() * knots
    bins = [order[np.minimum(place.astype(np.int64), knots - 1) == k] for k in range(knots)]
    bins = [b for b in bins if len(b)]
    sizes = np.array([weights[b].sum() for b in bins])
    centres = np.array([np.average(score[b], weights=weights[b]) for b in bins])
    rates = np.array([(weights[b] @ labels[b] + 0.5) / (weights[b].sum() + 1.0) for b in bins])
    rates = _monotone(rates, sizes)
    levels = np.log(rates / (1.0 - rates)) + 1e-3 * np.arange(len(bins))
    keep = np.concatenate([[True], np.diff(centres) > 1e-9])
    return OddsCalibration(tuple(observed), stack, centres[keep], levels[keep])


def _stack(log_odds: Array, labels: Array, importance: Array, ridge: float) -> Array:
    """Return non-negative weights of a ridge-held logistic regression (projected Newton)."""
    rows, members = log_odds.shape
    weights = np.full(members, 1.0 / members)
    bias = 0.0
    design = np.concatenate([log_odds, np.ones((rows, 1))], axis=1)
    for _ in range(_ROUNDS):
        chance = sigmoid(log_odds @ weights + bias)
        spread = weights - weights.mean()
        gradient = design.T @ (importance * (chance - labels)) / rows
        gradient[:members] += ridge * spread
        spread_of = importance * chance * (1.0 - chance)
        curvature = (design * spread_of[:, None]).T @ design / rows
        curvature[:members, :members] += ridge * (np.eye(members) - 1.0 / members)
        curvature += 1e-6 * np.eye(members + 1)
        step = np.linalg.solve(curvature, gradient)
        weights = np.maximum(weights - step[:members], 0.0)
        bias -= float(step[members])
        if np.abs(step).max() < 1e-6:
            break
    return weights if weights.sum() > 0.0 else np.full(members, 1.0 / members)


def _monotone(rates: Array, sizes: Array) -> Array:
    """Return the nearest increasing rates (pool adjacent violators)."""
    level: list[float] = []
    weight: list[float] = []
    length: list[int] = []
    for rate, size in zip(rates, sizes, strict=True):
        level.append(float(rate))
        weight.append(float(size))
        length.append(1)
        while len(level) > 1 and level[-2] > level[-1]:
            total = weight[-2] + weight[-1]
            level[-2] = (level[-2] * weight[-2] + level[-1] * weight[-1]) / total
            weight[-2] = total
            length[-2] += length[-1]
            del level[-1], weight[-1], length[-1]
    return np.repeat(np.array(level), length)
