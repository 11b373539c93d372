"""Soft evidence of many quantised variables at once, in compiled form (Sec. II-B.2)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from intent_inference.features import Features, count_rows, is_observed
from intent_inference.learning.quantisation import Quantiser
from intent_inference.variables import OBJECT_CLASS
from intent_perception.geometry import Array

_LARGEST_DIMENSION = 16


@dataclass(frozen=True, eq=False)
class Evidence:
    """What was observed, as likelihoods of every quantiser's states."""

    likelihoods: Array
    """(N, L) y_k = p(x | k) up to a factor per block; ones where nothing was observed."""
    log_scale: Array
    """(N, Q) logarithm of the factor taken out of each block (0 where not observed)."""
    observed: dict[str, NDArray[np.bool_]]
    """Variable to (N,): whether it was observed."""

    @property
    def rows(self) -> int:
        """Number of observations N."""
        return len(self.likelihoods)

    def without(self, bank: "EvidenceBank", variables: tuple[str, ...]) -> "Evidence":
        """Return the evidence as if some variables had not been observed."""
        likelihoods, log_scale = self.likelihoods.copy(), self.log_scale.copy()
        observed = dict(self.observed)
        for position, key in enumerate(bank.keys):
            if bank.variables[position] in variables:
                start = bank.starts[key]
                likelihoods[:, start : start + bank.sizes[key]] = 1.0
                log_scale[:, position] = 0.0
        for name in variables:
            if name in observed:
                observed[name] = np.zeros(self.rows, dtype=bool)
        return Evidence(likelihoods, log_scale, observed)


class EvidenceBank:
    """All quantisers of a model, laid out for one pass; the object class is one-hot."""

    def __init__(self, quantisers: Mapping[str, Quantiser], classes: tuple[str, ...]) -> None:
        """Lay out the blocks.

        Args:
            quantisers: key to quantiser; those of one variable share the standardisation.
            classes: names of the object classes, the states of `obcl`.
        """
        self.classes = classes
        self._class_index = {name: i for i, name in enumerate(classes)}
        self.keys: tuple[str, ...] = (OBJECT_CLASS, *quantisers)
        self.variables: tuple[str, ...] = (
            OBJECT_CLASS,
            *(quantiser.variable for quantiser in quantisers.values()),
        )
        self.sizes = {OBJECT_CLASS: max(len(classes), 1)}
        self.sizes.update({key: q.states for key, q in quantisers.items()})
        ends = np.cumsum([self.sizes[key] for key in self.keys])
        self.length = int(ends[-1])
        self.starts = {
            key: int(end - self.sizes[key]) for key, end in zip(self.keys, ends, strict=True)
        }
        self._first = {q.variable: q for q in reversed(list(quantisers.values()))}
        self._continuous = tuple(dict.fromkeys(q.variable for q in quantisers.values()))
        self._blocks, self._columns, self._width = _lay_out(
            quantisers, self._continuous, self.starts
        )
        self._means = _joined([q.mixture.means for q in quantisers.values()])
        self._covariances = _joined([q.mixture.covariances for q in quantisers.values()])
        whiteners = [
            np.linalg.inv(np.linalg.cholesky(q.mixture.covariances)) for q in quantisers.values()
        ]
        self._whiteners = _joined(whiteners)

    def evidence(self, features: Features, deviations: Features | None = None) -> Evidence:
        """Return the likelihoods of a feature table.

        Args:
            features: N rows; see `Features`. Classes that the model does not know count as unknown.
            deviations: standard deviations of the same shapes; NaN or absent: exact.

        Raises:
            ValueError: if a variable has another number of columns than in training.
        """
        rows = count_rows(features)
        likelihoods = np.ones((rows, self.length))
        log_scale = np.zeros((rows, len(self.keys)))
        observed = {OBJECT_CLASS: self._set_class(features, likelihoods)}
        values = np.zeros((rows, self._width))
        known = np.zeros((rows, len(self._continuous)), dtype=np.bool_)
        widening = np.zeros((rows, len(self._continuous), 1, 1))
        if deviations:
            shape = (rows, len(self._continuous), _LARGEST_DIMENSION, _LARGEST_DIMENSION)
            widening = np.zeros(shape)
        for position, name in enumerate(self._continuous):
            observed[name] = self._set_values(
                name, features, deviations, values, widening[:, position]
            )
            known[:, position] = observed[name]
        if self._continuous:
            _likelihoods(
                values, known, widening, bool(deviations), self._blocks, self._means,
                self._covariances, self._whiteners, likelihoods, log_scale,
            )  # fmt: skip
        return Evidence(likelihoods, log_scale, observed)

    def _set_class(self, features: Features, likelihoods: Array) -> NDArray[np.bool_]:
        known = np.zeros(len(likelihoods), dtype=bool)
        if OBJECT_CLASS in features:
            for row, name in enumerate(features[OBJECT_CLASS]):
                index = self._class_index.get(str(name), -1)
                if index >= 0:
                    likelihoods[row, : len(self.classes)] = 0.0
                    likelihoods[row, index] = 1.0
                    known[row] = True
        return known

    def _set_values(
        self, name: str, features: Features, deviations: Features | None, values: Array,
        widening: Array,
    ) -> NDArray[np.bool_]:  # fmt: skip
        if name not in features:
            return np.zeros(len(values), dtype=bool)
        quantiser = self._first[name]
        known = is_observed(features, name)
        given = features[name][known]
        dimension = quantiser.standardisation.back.shape[1]
        columns = self._columns[name]
        try:
            standard = quantiser.standardise(given)
        except ValueError as error:
            raise ValueError(
                f"{name}: expected the columns of the training data: {error}"
            ) from error
        values[known, columns : columns + dimension] = standard
        if deviations and name in deviations:
            spread = np.nan_to_num(deviations[name][known], nan=0.0)
            widening[known, :dimension, :dimension] = quantiser.widening(given, spread)
        return known


def _joined(arrays: list[Array]) -> Array:
    return np.concatenate([a.ravel() for a in arrays]) if arrays else np.zeros(0)


def _lay_out(
    quantisers: Mapping[str, Quantiser], variables: tuple[str, ...], starts: dict[str, int]
) -> tuple[NDArray[np.int64], dict[str, int], int]:
    """Return the block table, each variable's first column and the number of columns."""
    columns: dict[str, int] = {}
    width = 0
    blocks = []
    mean_start = covariance_start = 0
    for position, (key, quantiser) in enumerate(quantisers.items()):
        states, dimension = quantiser.mixture.means.shape
        if dimension > _LARGEST_DIMENSION:
            raise ValueError(f"{key}: expected at most {_LARGEST_DIMENSION} dimensions")
        if quantiser.variable not in columns:
            columns[quantiser.variable] = width
            width += dimension
        blocks.append([
            variables.index(quantiser.variable), columns[quantiser.variable], dimension, states,
            mean_start, covariance_start, starts[key], position + 1,
        ])  # fmt: skip
        mean_start += states * dimension
        covariance_start += states * dimension * dimension
    return np.array(blocks, dtype=np.int64).reshape(-1, 8), columns, width


@njit(cache=True, error_model="numpy")
def _likelihoods(  # noqa: C901
    values: Array,
    known: NDArray[np.bool_],
    widening: Array,
    widened: bool,
    blocks: NDArray[np.int64],
    means: Array,
    covariances: Array,
    whiteners: Array,
    likelihoods: Array,
    log_scale: Array,
) -> None:
    factor = np.empty((16, 16))
    offset = np.empty(16)
    half_log_two_pi = 0.5 * np.log(2.0 * np.pi)
    for n in range(values.shape[0]):
        for b in range(blocks.shape[0]):
            variable, column, dimension, states = (
                blocks[b, 0], blocks[b, 1], blocks[b, 2], blocks[b, 3],
            )  # fmt: skip
            if not known[n, variable]:
                continue
            start, top = blocks[b, 6], -np.inf
            for k in range(states):
                mean = blocks[b, 4] + k * dimension
                base = blocks[b, 5] + k * dimension * dimension
                squared = 0.0
                log_volume = 0.0
                for i in range(dimension):
                    offset[i] = values[n, column + i] - means[mean + i]
                if widened:
                    for i in range(dimension):
                        for j in range(i + 1):
                            total = covariances[base + i * dimension + j]
                            total += widening[n, variable, i, j]
                            for m in range(j):
                                total -= factor[i, m] * factor[j, m]
                            if i == j:
                                factor[i, i] = np.sqrt(total)
                            else:
                                factor[i, j] = total / factor[j, j]
                        value = offset[i]
                        for m in range(i):
                            value -= factor[i, m] * offset[m]
                        offset[i] = value / factor[i, i]
                        squared += offset[i] * offset[i]
                        log_volume += np.log(factor[i, i])
                else:
                    for i in range(dimension):
                        value = 0.0
                        for j in range(i + 1):
                            value += whiteners[base + i * dimension + j] * offset[j]
                        squared += value * value
                        log_volume -= np.log(whiteners[base + i * dimension + i])
                density = -0.5 * squared - log_volume - dimension * half_log_two_pi
                likelihoods[n, start + k] = density
                top = max(top, density)
            for k in range(states):
                likelihoods[n, start + k] = np.exp(likelihoods[n, start + k] - top)
            log_scale[n, blocks[b, 7]] = top
