"""Conditional probability tables from soft counts with a Dirichlet prior (Sec. II-B.2, IV-B.2).

Counts, not tables, are what is kept: they add, so that demonstrations that come later give the
same tables as all the data at once. A row counts p(k | x), i.e. lambda_k p(x | k) normalised; the
paper's y_k = p(x | k) is right as evidence only.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array


@dataclass(frozen=True)
class DirichletPrior:
    """What a table says before any data."""

    strength: float = 10.0
    """Equivalent sample size: of the table (uniform) or of each parent combination (back-off)."""
    back_off: bool = True
    """Prior mean: the table without the last parent, and so on down to uniform, instead of uniform.
    Tables with two parents have more cells than grasps; smoothing towards uniform would forget what
    the coarser table knows."""

    def __post_init__(self) -> None:
        if self.strength <= 0.0:
            raise ValueError(f"strength: expected more than 0, got {self.strength}")


def joint_assignment(assignments: Sequence[Array], rows: int) -> Array:
    """Return the soft assignment (N, product of states) to all combinations, the last fastest."""
    joint = np.ones((rows, 1))
    for shares in assignments:
        joint = (joint[:, :, None] * shares[:, None, :]).reshape(rows, -1)
    return joint


def soft_counts(
    assignments: dict[str, Array],
    variable: str,
    parents: Sequence[str],
    weights: Array | None = None,
) -> Array:
    """Return the expected counts of a variable with its parents.

    A row in which one of them is unknown (zeros) counts nothing here and still counts elsewhere.

    Args:
        assignments: variable to (N, K) soft assignment.
        variable: the child.
        parents: its parents, in the order of the table's axes.
        weights: (N,) weight of each row; default 1.

    Returns:
        Counts of shape (states of each parent..., states of the variable).
    """
    shares = assignments[variable]
    crisp = [p for p in parents if _is_crisp(assignments[p])]
    soft = [p for p in parents if p not in crisp]
    states = [assignments[p].shape[1] for p in (*crisp, *soft)]
    # Task and class are known for sure: a row belongs to one of their combinations only.
    context, weight = _combination([assignments[p] for p in crisp], len(shares))
    weight = weight if weights is None else weight * weights
    if not soft and _is_crisp(shares):
        cell = context * shares.shape[1] + shares.argmax(axis=1)
        cells = int(np.prod(states, dtype=np.int64)) * shares.shape[1]
        counts = np.bincount(cell, weight * shares.max(axis=1), cells)
    else:
        counts = np.zeros(
            (
                int(np.prod(states[: len(crisp)], dtype=np.int64)),
                int(np.prod(states[len(crisp) :], dtype=np.int64)),
                shares.shape[1],
            )
        )
        order = np.argsort(context, kind="stable")
        starts = np.flatnonzero(np.diff(context[order], prepend=-1))
        for rows in np.split(order, starts[1:]):
            joint = joint_assignment([assignments[p][rows] for p in soft], len(rows))
            counts[context[rows[0]]] = (joint * weight[rows, None]).T @ shares[rows]
    counts = counts.reshape(*states, shares.shape[1])
    places = [(*crisp, *soft).index(p) for p in parents]
    return np.ascontiguousarray(counts.transpose(*places, len(parents)))


def _combination(assignments: Sequence[Array], rows: int) -> tuple[NDArray[np.int64], Array]:
    """Return the combination of states (N,) that each row is in, the last fastest, and its weight.

    Args:
        assignments: crisp ones, (N, K) each.
        rows: number of rows N.
    """
    place, weight = np.zeros(rows, dtype=np.int64), np.ones(rows)
    for shares in assignments:
        place = place * shares.shape[1] + shares.argmax(axis=1)
        weight = weight * shares.max(axis=1)
    return place, weight


def _is_crisp(shares: Array) -> bool:
    """Return whether each row is in one state at most."""
    return bool(np.all(np.count_nonzero(shares, axis=1) <= 1))


def table_from_counts(counts: Array, prior: DirichletPrior) -> Array:
    """Return P(variable | parents), the posterior mean under the Dirichlet prior.

    Args:
        counts: (states of each parent..., states of the variable).
        prior: see there.
    """
    if not prior.back_off:
        smoothed = counts + prior.strength / counts.size
        uniform: Array = smoothed / smoothed.sum(axis=-1, keepdims=True)
        return uniform
    mean = np.full(counts.shape[-1], 1.0 / counts.shape[-1])
    parents = counts.ndim - 1
    for used in range(parents + 1):
        coarse = counts.sum(axis=tuple(range(used, parents)))
        if used > 0:
            mean = mean[..., None, :]
        mean = (coarse + prior.strength * mean) / (
            coarse.sum(axis=-1, keepdims=True) + prior.strength
        )
    return mean
