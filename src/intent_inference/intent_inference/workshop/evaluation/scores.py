"""Scores of predicted probabilities: ROC, AUC overall and within classes, calibration error."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array

ROC_GRID: Array = np.linspace(0.0, 1.0, 101)
"""False positive rates at which ROC curves are averaged."""


def auc(labels: Array, score: Array) -> float:
    """Return the area under the ROC curve; ties count half; NaN if a label is absent.

    Args:
        labels: (N,) 0 or 1.
        score: (N,) higher means more likely 1.
    """
    wins, pairs = _wins(labels, score)
    return wins / pairs if pairs else float("nan")


def auc_within(labels: Array, score: Array, groups: NDArray[np.str_]) -> float:
    """Return the AUC over pairs of the same group: how well equals are told apart.

    Knowing the group alone gives 0.5. NaN if no group has both labels.
    """
    total_wins = total_pairs = 0.0
    for group in np.unique(groups):
        wins, pairs = _wins(labels[groups == group], score[groups == group])
        total_wins += wins
        total_pairs += pairs
    return total_wins / total_pairs if total_pairs else float("nan")


def _wins(labels: Array, score: Array) -> tuple[float, float]:
    """Return how many (positive, negative) pairs are in order, and how many there are."""
    positive = labels == 1.0
    count = int(positive.sum())
    others = len(labels) - count
    if count == 0 or others == 0:
        return 0.0, 0.0
    _, place, sizes = np.unique(score, return_inverse=True, return_counts=True)
    rank = (np.cumsum(sizes) - (sizes - 1) / 2.0)[place]
    wins = float(rank[positive].sum()) - count * (count + 1) / 2.0
    return wins, float(count * others)


def roc(labels: Array, score: Array) -> Array:
    """Return the true positive rate at each rate of `ROC_GRID`, (101,)."""
    order = np.argsort(-score, kind="stable")
    hit = labels[order] == 1.0
    last = np.concatenate([np.diff(score[order]) != 0.0, [True]])
    true = np.concatenate([[0.0], np.cumsum(hit)[last] / max(hit.sum(), 1)])
    false = np.concatenate([[0.0], np.cumsum(~hit)[last] / max((~hit).sum(), 1)])
    curve: Array = np.interp(ROC_GRID, false, true)
    return curve


def calibration_error(
    labels: Array, probability: Array, weights: Array | None = None, bins: int = 10
) -> float:
    """Return the expected calibration error over bins of equal width.

    Args:
        labels: (N,) 0 or 1.
        probability: (N,) of 1.
        weights: (N,) of the rows; default: all the same.
        bins: number of bins.
    """
    if weights is None:
        weights = np.ones(len(labels))
    place = np.minimum((probability * bins).astype(np.int64), bins - 1)
    total = 0.0
    for b in np.unique(place):
        chosen = place == b
        mass = float(weights[chosen].sum())
        gap = abs(float(weights[chosen] @ (labels[chosen] - probability[chosen])) / mass)
        total += gap * mass / float(weights.sum())
    return total


def share_interval(hits: NDArray[np.bool_]) -> list[float]:
    """Return the 95 % interval of the share of hits (Wilson's)."""
    count, z = max(len(hits), 1), 1.96
    share = float(hits.mean()) if len(hits) else 0.5
    middle = share + z * z / (2.0 * count)
    half = z * float(np.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count**2)))
    scale = 1.0 + z * z / count
    low, high = (middle - half) / scale, (middle + half) / scale
    return [max(0.0, min(share, low)), min(1.0, max(share, high))]  # rounding must not cut it off
