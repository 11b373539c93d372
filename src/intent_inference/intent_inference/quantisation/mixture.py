"""Gaussian mixtures (Eq. 1) and the way back from states to values (Eqs. 2 and 3).

Eq. (1) prints a product over k and calls the inverse covariance the covariance; a mixture is a sum,
p(x) = sum_k lambda_k N(x | u_k, Sigma_k), and that is what stands here.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array

_LOG_TWO_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class GaussianMixture:
    """K Gaussian components over D standardised dimensions."""

    weights: Array
    """(K,) mixing weights lambda_k, sum 1."""
    means: Array
    """(K, D) centres u_k."""
    covariances: Array
    """(K, D, D) covariances Sigma_k."""

    @property
    def components(self) -> int:
        """Number of components K: the states of the quantised variable."""
        return len(self.weights)

    def log_likelihoods(self, samples: Array, widening: Array | None = None) -> Array:
        """Return log p(x | k) of the samples (N, D), (N, K).

        Args:
            samples: (N, D).
            widening: (N, D, D) covariance of the measurement noise, added to every component's
                covariance: the density of a noisy reading of x.
        """
        if samples.ndim != 2 or samples.shape[1] != self.means.shape[1]:
            raise ValueError(f"expected samples (N, {self.means.shape[1]}), got {samples.shape}")
        covariances = self.covariances[None] if widening is None else (
            self.covariances[None] + widening[:, None]
        )  # fmt: skip
        factor = np.linalg.cholesky(covariances)
        offset = samples[:, None] - self.means
        if widening is None:
            inverse = np.linalg.inv(factor[0])
            whitened = np.einsum("kij,nkj->nki", inverse, offset)
        else:
            whitened = np.linalg.solve(factor, offset[..., None])[..., 0]
        log_volume = np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
        dimension = self.means.shape[1]
        squared = np.sum(whitened**2, axis=2)
        result: Array = -0.5 * (dimension * _LOG_TWO_PI + squared) - log_volume
        return result

    def responsibilities(self, samples: Array) -> Array:
        """Return p(k | x), (N, K): lambda_k p(x | k) normalised; the soft counts of learning."""
        return normalised_exp(self.log_likelihoods(samples) + np.log(self.weights))

    def log_density(self, samples: Array) -> Array:
        """Return log p(x) of the samples (N, D), (N,)."""
        joint = self.log_likelihoods(samples) + np.log(self.weights)
        top = joint.max(axis=1)
        density: Array = top + np.log(np.exp(joint - top[:, None]).sum(axis=1))
        return density

    def bic(self, samples: Array) -> float:
        """Return the Bayesian information criterion on the samples (N, D); lower is better."""
        components, dimension = self.means.shape
        free = components * (dimension + dimension * (dimension + 1) // 2) + components - 1
        return float(free * np.log(len(samples)) - 2.0 * self.log_density(samples).sum())

    def expected(self, states: Array) -> Array:
        """Return E(Z) = sum_k p_k u_k (Eq. 3) for the state probabilities (K,), (D,)."""
        return np.asarray(states @ self.means)

    def likeliest(self, states: Array) -> Array:
        """Return the centre (D,) with the highest density of Eq. (2) for the probabilities (K,)."""
        log_density = self.log_likelihoods(self.means) + np.log(np.maximum(states, 1e-300))
        top = log_density.max(axis=1)
        mixture = top + np.log(np.exp(log_density - top[:, None]).sum(axis=1))
        # A centre is a candidate through its own component: weigh by p_k, not by neighbours alone.
        return np.asarray(self.means[int(np.argmax(np.where(states > 0.0, mixture, -np.inf)))])

    def sample(self, states: Array, count: int, rng: np.random.Generator) -> Array:
        """Return draws (count, D) from Eq. (2), p(x | e) = sum_k p_k N(x | u_k, Sigma_k)."""
        chosen = rng.choice(self.components, size=count, p=states / states.sum())
        factor = np.linalg.cholesky(self.covariances)
        noise = rng.standard_normal((count, self.means.shape[1]))
        return np.asarray(self.means[chosen] + np.einsum("nij,nj->ni", factor[chosen], noise))


def normalised_exp(log_values: Array) -> Array:
    """Return exp of each row of (N, K), scaled to sum one, without underflow."""
    values = np.exp(log_values - log_values.max(axis=1, keepdims=True))
    result: Array = values / values.sum(axis=1, keepdims=True)
    return result


def fit_mixture(
    samples: Array,
    responsibilities: Array,
    floor: float = 1e-2,
    iterations: int = 40,
    tolerance: float = 1e-3,
) -> GaussianMixture:
    """Return the mixture found by EM from a first assignment (Eq. 1).

    Args:
        samples: (N, D) standardised.
        responsibilities: (N, K) first assignment of samples to components; rows sum to one.
        floor: variance added to every direction [standard deviations squared]: components never
            shrink below what a tracker can resolve.
        iterations: most rounds of EM.
        tolerance: stop when the mean log density grows by less.

    Raises:
        ValueError: if shapes differ or a value is not finite.
    """
    if len(samples) != len(responsibilities) or not np.all(np.isfinite(samples)):
        raise ValueError("expected finite samples (N, D) and responsibilities (N, K)")
    used = responsibilities.sum(axis=0) > 0.5
    moments = _moments(samples)
    mixture = _maximised(moments, responsibilities[:, used], samples.shape[1], floor)
    previous = -np.inf
    for _ in range(iterations):
        joint = moments @ _log_polynomial(mixture)
        top = joint.max(axis=1, keepdims=True)
        joint -= top
        shares = np.exp(joint, out=joint)
        total = shares.sum(axis=1, keepdims=True)
        level = float((top + np.log(total)).mean())
        if level - previous < tolerance:
            break
        previous = level
        shares /= total
        kept = shares.sum(axis=0) > 0.5
        shares = shares if kept.all() else shares[:, kept]
        mixture = _maximised(moments, shares, samples.shape[1], floor)
    return mixture


def _moments(samples: Array) -> Array:
    """Return 1, x_i and x_i x_j (i <= j) of each sample, (N, 1 + D + D (D + 1) / 2).

    A component's log density is linear in these, and its next parameters are their weighted means:
    both steps of EM are one matrix product each.
    """
    first, second = np.triu_indices(samples.shape[1])
    products = samples[:, first] * samples[:, second]
    return np.concatenate([np.ones((len(samples), 1)), samples, products], axis=1)


def _log_polynomial(mixture: GaussianMixture) -> Array:
    """Return the coefficients (F, K) of log lambda_k p(x | k) over the moments of x."""
    dimension = mixture.means.shape[1]
    precisions = np.linalg.inv(mixture.covariances)
    slopes = np.einsum("kij,kj->ki", precisions, mixture.means)
    constant = np.log(mixture.weights) - 0.5 * (
        dimension * _LOG_TWO_PI
        + np.linalg.slogdet(mixture.covariances)[1]
        + np.einsum("ki,ki->k", slopes, mixture.means)
    )
    first, second = np.triu_indices(dimension)
    twice = np.where(first == second, 0.5, 1.0)
    products = -twice * precisions[:, first, second]
    return np.concatenate([constant[:, None], slopes, products], axis=1).T


def _maximised(
    moments: Array, responsibilities: Array, dimension: int, floor: float
) -> GaussianMixture:
    """Return the M step: weights, means and covariances of the soft assignment."""
    sums = responsibilities.T @ moments
    mass = sums[:, 0]
    means = sums[:, 1 : 1 + dimension] / mass[:, None]
    first, second = np.triu_indices(dimension)
    covariances = np.empty((len(mass), dimension, dimension))
    covariances[:, first, second] = covariances[:, second, first] = sums[:, 1 + dimension :]
    covariances -= mass[:, None, None] * means[:, :, None] * means[:, None, :]
    # Small components lean on the pooled within-component covariance: 2 D samples' worth.
    pooled = covariances.sum(axis=0) / len(moments)
    lean = 2.0 * dimension if dimension > 1 else 0.0
    covariances = (covariances + lean * pooled) / (mass + lean)[:, None, None]
    covariances += floor * np.eye(dimension)
    return GaussianMixture(mass / mass.sum(), means, covariances)
