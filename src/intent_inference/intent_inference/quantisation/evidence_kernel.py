"""Compiled evidence: values to coordinates to likelihoods, one pass for all variables.

`variables.coordinates_of` and `GaussianMixture.log_likelihoods` say the same in numpy; tests hold
the two together. A grasp's evidence must not cost a millisecond of small numpy calls.
"""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Mask
from intent_perception.basics.kernels import summing_kernel

Index = NDArray[np.int64]

PLAIN, LOGARITHM, ROTATION, DIRECTION = 0, 1, 2, 3
LARGEST_DIMENSION = 24
SHORTEST = 1e-3
NEGLIGIBLE = -25.0
"""Log likelihood ratio to the best state below which a state is ruled out: networks skip it."""


@summing_kernel
def standardised(
    raw: Array,
    deviation: Array,
    known: Mask,
    layout: Index,
    means: Array,
    axes: Array,
    values: Array,
    widening: Array,
    widened: bool,
) -> None:
    """Fill the standardised values and, if widened, their measurement covariances.

    Args:
        raw: (N, R) values of all variables side by side.
        deviation: (N, R) their standard deviations; not read unless widened.
        known: (N, V).
        layout: (V, 8) kind, first raw column, raw columns, coordinates E, dimensions D, start in
            means, start in axes, first column of the standardised values.
        means: centres of the coordinates.
        axes: (D, E) maps, one after the other.
        values: (N, W) to fill.
        widening: (N, V, D, D) to fill.
        widened: whether to fill it.
    """
    point = np.empty(LARGEST_DIMENSION)
    noise = np.zeros((LARGEST_DIMENSION, LARGEST_DIMENSION))
    moved = np.empty((LARGEST_DIMENSION, LARGEST_DIMENSION))
    for n in range(raw.shape[0]):
        for v in range(layout.shape[0]):
            if not known[n, v]:
                continue
            kind, first, columns, count, dimension, mean, start, out = layout[v]
            given = raw[n, first : first + columns]
            spread = deviation[n, first : first + columns]
            noises = _embed(kind, given, spread, point, noise)
            own = axes[start : start + dimension * count].reshape(dimension, count)
            for d in range(dimension):
                total = 0.0
                for e in range(count):
                    total += own[d, e] * (point[e] - means[mean + e])
                values[n, out + d] = total
            if widened:
                _carry(own, noise[:count, :noises], moved, widening[n, v])


@summing_kernel
def _carry(axes: Array, noise: Array, moved: Array, covariance: Array) -> None:
    """Fill the lower triangle of (axes noise) (axes noise)^T."""
    dimension, count = axes.shape
    noises = noise.shape[1]
    for d in range(dimension):
        for r in range(noises):
            total = 0.0
            for e in range(count):
                total += axes[d, e] * noise[e, r]
            moved[d, r] = total
        for f in range(d + 1):
            total = 0.0
            for r in range(noises):
                total += moved[d, r] * moved[f, r]
            covariance[d, f] = total


@summing_kernel
def _embed(kind: int, given: Array, spread: Array, point: Array, noise: Array) -> int:
    """Fill one value's coordinates and its noises (columns); return the number of noises."""
    count = len(given)
    if kind == ROTATION:
        _embed_rotation(given, spread, point, noise)
        return 3
    if kind == DIRECTION:
        length = np.sqrt(given[0] ** 2 + given[1] ** 2 + given[2] ** 2)
        for i in range(3):
            point[i] = given[i] / length
        for i in range(3):
            for j in range(3):
                noise[i, j] = ((1.0 if i == j else 0.0) - point[i] * point[j]) * spread[j]
        return 3
    for i in range(count):
        for j in range(count):
            noise[i, j] = 0.0
        if kind == LOGARITHM:
            edge = max(given[i], SHORTEST)
            point[i] = np.log(edge)
            noise[i, i] = spread[i] / edge
        else:
            point[i] = given[i]
            noise[i, i] = spread[i]
    return count


@summing_kernel
def _embed_rotation(given: Array, spread: Array, point: Array, noise: Array) -> None:
    squared = given[0] ** 2 + given[1] ** 2 + given[2] ** 2 + given[3] ** 2
    x, y, z, w = given[0], given[1], given[2], given[3]
    scale = 2.0 / squared
    point[0] = 1.0 - scale * (y * y + z * z)
    point[1] = scale * (x * y + z * w)
    point[2] = scale * (x * z - y * w)
    point[3] = scale * (x * z + y * w)
    point[4] = scale * (y * z - x * w)
    point[5] = 1.0 - scale * (x * x + y * y)
    total = spread[0] ** 2 + spread[1] ** 2 + spread[2] ** 2 + spread[3] ** 2
    angle = 2.0 * np.sqrt(total / 3.0)
    for part in range(0, 6, 3):
        a, b, c = point[part] * angle, point[part + 1] * angle, point[part + 2] * angle
        # w x r, column by column of w.
        noise[part, 0], noise[part + 1, 0], noise[part + 2, 0] = 0.0, -c, b
        noise[part, 1], noise[part + 1, 1], noise[part + 2, 1] = c, 0.0, -a
        noise[part, 2], noise[part + 1, 2], noise[part + 2, 2] = -b, a, 0.0


@summing_kernel
def block_likelihoods(
    values: Array,
    known: Mask,
    widening: Array,
    widened: bool,
    blocks: Index,
    means: Array,
    covariances: Array,
    whiteners: Array,
    log_volumes: Array,
    likelihoods: Array,
    log_scale: Array,
) -> None:
    """Fill p(x | k) of every component of every block, each block scaled to a maximum of one.

    Args:
        values: (N, W) standardised.
        known: (N, V).
        widening: (N, V, D, D) lower triangles; not read unless widened.
        widened: whether covariances are widened.
        blocks: (B, 8) variable, first column, dimensions, states, start in means, start in
            covariances, start in likelihoods, start in log_volumes.
        means: of all components.
        covariances: of all components.
        whiteners: inverses of their Cholesky factors.
        log_volumes: log determinants of the Cholesky factors.
        likelihoods: (N, L) to fill.
        log_scale: (N, 1 + B) to fill: what was taken out of each block.
    """
    factor = np.empty((LARGEST_DIMENSION, LARGEST_DIMENSION))
    offset = np.empty(LARGEST_DIMENSION)
    half_log_two_pi = 0.5 * np.log(2.0 * np.pi)
    for n in range(values.shape[0]):
        for b in range(blocks.shape[0]):
            variable, column, dimension, states, mean, base, start, volume = blocks[b]
            if not known[n, variable]:
                continue
            top = -np.inf
            for k in range(states):
                for i in range(dimension):
                    offset[i] = values[n, column + i] - means[mean + k * dimension + i]
                place = base + k * dimension * dimension
                if widened:
                    density = _widened_density(
                        offset, covariances[place:], widening[n, variable], factor, dimension
                    )
                else:
                    squared = 0.0
                    for i in range(dimension):
                        value = 0.0
                        for j in range(i + 1):
                            value += whiteners[place + i * dimension + j] * offset[j]
                        squared += value * value
                    density = -0.5 * squared - log_volumes[volume + k]
                density -= dimension * half_log_two_pi
                likelihoods[n, start + k] = density
                top = max(top, density)
            for k in range(states):
                relative = likelihoods[n, start + k] - top
                likelihoods[n, start + k] = np.exp(relative) if relative > NEGLIGIBLE else 0.0
            log_scale[n, b + 1] = top


@summing_kernel
def _widened_density(
    offset: Array, covariance: Array, widening: Array, factor: Array, dimension: int
) -> float:
    """Return the log density, less its constant, under covariance + widening (Cholesky)."""
    squared = 0.0
    determinant = 1.0
    log_volume = 0.0
    for i in range(dimension):
        for j in range(i + 1):
            total = covariance[i * dimension + j] + widening[i, j]
            for m in range(j):
                total -= factor[i, m] * factor[j, m]
            factor[i, j] = np.sqrt(total) if i == j else total / factor[j, j]
        value = offset[i]
        for m in range(i):
            value -= factor[i, m] * offset[m]
        offset[i] = value / factor[i, i]
        squared += offset[i] * offset[i]
        determinant *= factor[i, i]
        if determinant < 1e-150:
            log_volume += np.log(determinant)
            determinant = 1.0
    density: float = -0.5 * squared - log_volume - np.log(determinant)
    return density
