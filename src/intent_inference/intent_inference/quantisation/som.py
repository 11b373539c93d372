"""Self-organising map and the clustering of its prototypes (Sec. II-B.1, Fig. 2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array

Labels = NDArray[np.int64]

_EPOCHS = 24
_MARGIN = 1.5  # the initial sheet spans this many standard deviations
_NARROWEST = 0.7  # map units: final width of the neighbourhood
_EMPTY = 1e-12


@dataclass(frozen=True, eq=False)
class SelfOrganisingMap:
    """A sheet of prototypes that keeps the topology of the samples."""

    prototypes: Array
    """(M, D) prototype w_j of each map unit, row by row of the sheet."""
    shape: tuple[int, int]
    """Rows and columns of the sheet."""

    def assign(self, samples: Array) -> Labels:
        """Return the map unit nearest to each of the samples (N, D)."""
        return nearest(samples, self.prototypes)

    def hits(self, samples: Array) -> Labels:
        """Return how many samples each unit wins, (rows, columns) (Fig. 2a)."""
        count = np.bincount(self.assign(samples), minlength=len(self.prototypes))
        return count.reshape(self.shape)

    def u_matrix(self) -> Array:
        """Return each unit's mean distance to its sheet neighbours, (rows, columns) (Fig. 2b)."""
        rows, columns = self.shape
        sheet = self.prototypes.reshape(rows, columns, -1)
        total, count = np.zeros(self.shape), np.zeros(self.shape)
        for axis in (0, 1):
            distance = np.linalg.norm(np.diff(sheet, axis=axis), axis=2)
            near = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
            far = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
            for side in (near, far):
                total[side] += distance
                count[side] += 1
        return total / np.maximum(count, 1)

    def quantisation_error(self, samples: Array) -> float:
        """Return the mean distance from the samples (N, D) to their prototypes."""
        offset = samples - self.prototypes[self.assign(samples)]
        return float(np.linalg.norm(offset, axis=1).mean())


def nearest(samples: Array, centers: Array) -> Labels:
    """Return the index of the nearest of centers (M, D) for each of the samples (N, D)."""
    distance = np.sum(centers**2, axis=1) - 2.0 * samples @ centers.T
    return np.argmin(distance, axis=1)


def fit_map(samples: Array, units: int | None = None) -> SelfOrganisingMap:
    """Return a batch-trained map of the samples; it starts from their two main directions.

    Args:
        samples: (N, D) with N >= 2, standardised.
        units: number of prototypes; default 5 sqrt(N), much more than the expected clusters.

    Raises:
        ValueError: if there are fewer than two samples.
    """
    if samples.ndim != 2 or len(samples) < 2:
        raise ValueError(f"expected samples of shape (N >= 2, D), got {samples.shape}")
    count, dimension = samples.shape
    units = units or max(4, int(5 * np.sqrt(count)))
    centre = samples.mean(axis=0)
    _, singular, axes = np.linalg.svd(samples - centre, full_matrices=False)
    spread = singular / np.sqrt(count)
    second = spread[1] if len(spread) > 1 else spread[0] / 3.0
    ratio = np.clip(spread[0] / max(second, 1e-9), 1.0, 5.0)
    columns = max(2, round(np.sqrt(units / ratio)))
    rows = max(2, round(units / columns))
    grid = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
    grid = grid.reshape(-1, 2).astype(np.float64)
    sheet = (grid / (np.array([rows, columns]) - 1.0) * 2.0 - 1.0) * _MARGIN
    prototypes = centre + np.outer(sheet[:, 0] * spread[0], axes[0])
    if dimension > 1 and len(axes) > 1:
        prototypes = prototypes + np.outer(sheet[:, 1] * second, axes[1])
    apart = np.sum((grid[:, None] - grid[None]) ** 2, axis=2)
    widths = np.geomspace(max(rows, columns) / 4.0, _NARROWEST, _EPOCHS)
    for width in widths:
        winner = nearest(samples, prototypes)
        won = np.bincount(winner, minlength=len(prototypes)).astype(np.float64)
        sums = np.stack(
            [np.bincount(winner, samples[:, d], len(prototypes)) for d in range(dimension)], axis=1
        )
        reach = np.exp(-apart / (2.0 * width**2))
        prototypes = (reach @ sums) / (reach @ won + _EMPTY)[:, None]
    return SelfOrganisingMap(prototypes, (rows, columns))


def cluster_prototypes(
    prototypes: Array, clusters: int, rng: np.random.Generator, restarts: int = 3
) -> Labels:
    """Return the K-means cluster of each of the prototypes (M, D), best of some restarts."""
    best_cost, best = np.inf, np.zeros(len(prototypes), dtype=np.int64)
    for _ in range(restarts):
        centers = _spread_out(prototypes, clusters, rng)
        labels = nearest(prototypes, centers)
        for _ in range(50):
            for k in np.unique(labels):
                centers[k] = prototypes[labels == k].mean(axis=0)
            updated = nearest(prototypes, centers)
            if np.array_equal(updated, labels):
                break
            labels = updated
        cost = float(np.sum((prototypes - centers[labels]) ** 2))
        if cost < best_cost:
            best_cost, best = cost, labels
    return np.unique(best, return_inverse=True)[1].astype(np.int64)


def _spread_out(points: Array, clusters: int, rng: np.random.Generator) -> Array:
    """Return K-means++ starts: each new centre far from those already chosen."""
    chosen = [int(rng.integers(len(points)))]
    distance = np.sum((points - points[chosen[0]]) ** 2, axis=1)
    while len(chosen) < min(clusters, len(points)):
        total = distance.sum()
        weights = distance / total if total > 0 else None
        chosen.append(int(rng.choice(len(points), p=weights)))
        distance = np.minimum(distance, np.sum((points - points[chosen[-1]]) ** 2, axis=1))
    return points[chosen].copy()


def davies_bouldin(points: Array, labels: Labels) -> float:
    """Return the index I_db of Sec. II-B.1: half the mean over clusters of the worst overlap.

    Args:
        points: (M, D) prototypes.
        labels: (M,) clusters 0..K-1, each with a point, K >= 2.
    """
    clusters = int(labels.max()) + 1
    centers = np.stack([points[labels == k].mean(axis=0) for k in range(clusters)])
    within = np.array(
        [np.linalg.norm(points[labels == k] - centers[k], axis=1).mean() for k in range(clusters)]
    )
    between = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    np.fill_diagonal(between, np.inf)
    overlap = (within[:, None] + within[None]) / np.maximum(between, _EMPTY)
    return float(0.5 * overlap.max(axis=1).mean())
