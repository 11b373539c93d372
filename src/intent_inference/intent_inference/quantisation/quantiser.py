"""Soft vector quantisation: a variable's values to the states of a mixture (Sec. II-B)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_inference.quantisation.mixture import GaussianMixture, fit_mixture
from intent_inference.quantisation.som import (
    SelfOrganisingMap,
    cluster_prototypes,
    davies_bouldin,
    fit_map,
)
from intent_inference.quantisation.variables import coordinates_of
from intent_perception.basics.arrays import Array, Mask
from intent_perception.basics.parameters import Checked

_FLAT = 1e-6  # a coordinate that varies less is constant


@dataclass(frozen=True)
class QuantisationConfig(Checked):
    """How continuous variables are turned into states."""

    states: tuple[int, ...] = (4, 6, 8, 12, 16, 24)
    """Numbers of states K that are tried, 2..100."""
    kept_variance: float = 0.95
    """Share of a variable's variance kept by its principal axes (more than `full_dimensions`),
    0.01..1."""
    full_dimensions: int = 6
    """Variables with more coordinates are reduced: full covariances in 20 dimensions over-fit;
    1..100."""
    floor: float = 1e-2
    """Least variance of a component [standard deviations squared], 1e-6..1."""
    most_samples: int = 4000
    """Samples that maps and mixtures are fitted to; a random subset of more; 10..10000000."""


@dataclass(frozen=True, eq=False)
class Standardisation:
    """Affine map from a variable's coordinates to the space of its mixture."""

    mean: Array
    """(E,) mean of the coordinates."""
    axes: Array
    """(D, E): rows map centred coordinates to standardised dimensions."""
    back: Array
    """(E, D): the way back (pseudo-inverse)."""

    def apply(self, coordinates: Array) -> Array:
        """Return the standardised values (N, D) of coordinates (N, E)."""
        return np.asarray((coordinates - self.mean) @ self.axes.T)

    def invert(self, values: Array) -> Array:
        """Return the coordinates (N, E) of standardised values (N, D)."""
        return np.asarray(values @ self.back.T + self.mean)


@dataclass(frozen=True, eq=False)
class Quantiser:
    """One variable's states: coordinates, standardisation and mixture."""

    variable: str
    standardisation: Standardisation
    mixture: GaussianMixture

    @property
    def states(self) -> int:
        """Number of states K."""
        return self.mixture.components

    def standardise(self, values: Array) -> Array:
        """Return the values (N, D) in the mixture's space."""
        return self.standardisation.apply(coordinates_of(self.variable).embed(values))

    def widening(self, values: Array, deviation: Array) -> Array:
        """Return the measurement covariance (N, D, D) in the mixture's space."""
        noise = coordinates_of(self.variable).jacobian(values, deviation)
        moved = np.einsum("de,ner->ndr", self.standardisation.axes, noise)
        covariance: Array = np.einsum("ndr,nfr->ndf", moved, moved)
        return covariance

    def responsibilities(self, values: Array, known: Mask) -> Array:
        """Return p(k | x), (N, K); rows of zeros where the value is not known."""
        result = np.zeros((len(values), self.states))
        if known.any():
            result[known] = self.mixture.responsibilities(self.standardise(values[known]))
        return result

    def log_likelihoods(self, values: Array, deviation: Array | None = None) -> Array:
        """Return log p(x | k), (N, K), of known values, widened by their standard deviations."""
        extra = None if deviation is None else self.widening(values, deviation)
        return self.mixture.log_likelihoods(self.standardise(values), extra)

    def values_of(self, standardised: Array) -> Array:
        """Return valid values (N, D), on the manifold, of points in the mixture's space."""
        coordinates = self.standardisation.invert(standardised)
        return coordinates_of(self.variable).project(coordinates)


@dataclass(frozen=True, eq=False)
class Quantisation:
    """What Fig. 2 shows for one variable, and the quantiser of every K that was tried."""

    variable: str
    sheet: SelfOrganisingMap | None
    """The map; None for scalars."""
    criterion: dict[int, float]
    """Davies-Bouldin index (vectors) or BIC (scalars) of each K; the paper takes the least."""
    labels: dict[int, NDArray[np.int64]]
    """Cluster of each map unit for each K (vectors)."""
    quantisers: dict[int, Quantiser]

    def chosen_by_paper(self) -> Quantiser:
        """Return the quantiser with the least Davies-Bouldin index or BIC (Sec. IV-B.1)."""
        return self.quantisers[min(self.criterion, key=lambda k: self.criterion[k])]


def standardisation_of(coordinates: Array, config: QuantisationConfig) -> Standardisation:
    """Return the affine map that makes coordinates (N, E) unit-variance, fewer if they are many."""
    mean = coordinates.mean(axis=0)
    scale = coordinates.std(axis=0)
    scale = np.where(scale < _FLAT, 1.0, scale)
    axes = np.diag(1.0 / scale)
    if len(mean) > config.full_dimensions:
        standard = (coordinates - mean) / scale
        values, vectors = np.linalg.eigh(np.cov(standard.T))
        order = np.argsort(values)[::-1]
        share = np.cumsum(values[order]) / values.sum()
        kept = min(
            int(np.searchsorted(share, config.kept_variance)) + 1, 2 * config.full_dimensions
        )
        principal = vectors[:, order[:kept]]
        # Not whitened: a faint axis must not weigh as much as the main one.
        axes = (principal / np.sqrt(values[order[0]] / 2.0)).T @ axes
    return Standardisation(mean, axes, np.linalg.pinv(axes))


def quantise(
    variable: str,
    values: Array,
    rng: np.random.Generator,
    config: QuantisationConfig | None = None,
) -> Quantisation:
    """Return the quantisers of one continuous variable for every number of states tried.

    Vectors: map, K-means on its prototypes, each sample to its prototype's cluster, EM.
    Scalars: K bins of equal width, EM.

    Args:
        variable: name in Table I.
        values: (N, D) known values.
        rng: for the subset and the K-means starts.
        config: see there.

    Raises:
        ValueError: if there are fewer than ten values.
    """
    config = config or QuantisationConfig()
    if len(values) < 10:
        raise ValueError(f"{variable}: expected at least 10 known values, got {len(values)}")
    coordinates = coordinates_of(variable).embed(values)
    if len(coordinates) > config.most_samples:
        coordinates = coordinates[rng.permutation(len(coordinates))[: config.most_samples]]
    standardisation = standardisation_of(coordinates, config)
    samples = standardisation.apply(coordinates)
    counts = [k for k in config.states if k <= len(samples) // 5] or [2]
    if samples.shape[1] == 1:
        return _quantise_scalar(variable, standardisation, samples, counts, config)
    sheet = fit_map(samples)
    unit = sheet.assign(samples)
    criterion, labels, quantisers = {}, {}, {}
    for count in counts:
        cluster = cluster_prototypes(sheet.prototypes, count, rng)
        criterion[count] = davies_bouldin(sheet.prototypes, cluster)
        labels[count] = cluster
        first = np.eye(int(cluster.max()) + 1)[cluster[unit]]
        mixture = fit_mixture(samples, first, config.floor)
        quantisers[count] = Quantiser(variable, standardisation, mixture)
    return Quantisation(variable, sheet, criterion, labels, quantisers)


def _quantise_scalar(
    variable: str,
    standardisation: Standardisation,
    samples: Array,
    counts: Sequence[int],
    config: QuantisationConfig,
) -> Quantisation:
    criterion, quantisers = {}, {}
    low, high = float(samples.min()), float(samples.max())
    for count in counts:
        edges = np.linspace(low, high, count + 1)[1:-1]
        first = np.eye(count)[np.digitize(samples[:, 0], edges)]
        mixture = fit_mixture(samples, first, config.floor)
        quantisers[count] = Quantiser(variable, standardisation, mixture)
        criterion[count] = mixture.bic(samples)
    return Quantisation(variable, None, criterion, {}, quantisers)


def mutual_information(first: Array, second: Array) -> float:
    """Return the mutual information [nat] of two soft assignments (N, K) and (N, L).

    Rows of zeros (unknown) count for nothing.
    """
    return information_of(first.T @ second)


def information_of(joint: Array) -> float:
    """Return the mutual information [nat] of two variables with joint counts (K, L)."""
    total = joint.sum()
    if total <= 0.0:
        return 0.0
    joint = joint / total
    product = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    used = (joint > 0.0) & (product > 0.0)
    return float(np.sum(joint[used] * np.log(joint[used] / product[used])))


def chosen_by_information(
    responsibilities: dict[int, Array], task: Array, penalty: float = 0.5
) -> int:
    """Return the K whose states tell most about the task, penalised as in BIC.

    Args:
        responsibilities: K to (N, K) soft assignment of the training rows.
        task: (N, 2) one-hot task label.
        penalty: factor of log(N) / N per additional state.
    """
    count = float(task.sum())
    free = task.shape[1] - 1

    def score(states: int) -> float:
        shares = responsibilities[states]
        cost = penalty * np.log(count) / count * (shares.shape[1] - 1) * free
        return mutual_information(shares, task) - float(cost)

    return max(responsibilities, key=score)
