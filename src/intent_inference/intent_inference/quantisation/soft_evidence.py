"""Soft evidence of many quantised variables at once, in compiled form (Sec. II-B.2)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_inference.quantisation.evidence_kernel import (
    DIRECTION,
    LARGEST_DIMENSION,
    LOGARITHM,
    PLAIN,
    ROTATION,
    block_likelihoods,
    standardised,
)
from intent_inference.quantisation.feature_table import Features, count_rows
from intent_inference.quantisation.quantiser import Quantiser
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_perception.basics.arrays import Array

_KINDS = {"size": LOGARITHM, "gbvl": LOGARITHM, "dir": ROTATION, "npos": DIRECTION}


@dataclass(frozen=True, eq=False)
class SoftEvidence:
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

    def patterns(self) -> list[tuple[frozenset[str], NDArray[np.int64]]]:
        """Return the sets of observed variables that occur, and the rows of each."""
        if self.rows == 1:
            seen = frozenset(name for name, known in self.observed.items() if known[0])
            return [(seen, np.zeros(1, dtype=np.int64))]
        names = list(self.observed)
        table = np.stack([self.observed[name] for name in names], axis=1)
        found, place = np.unique(table, axis=0, return_inverse=True)
        return [
            (
                frozenset(n for n, seen in zip(names, pattern, strict=True) if seen),
                np.flatnonzero(place == i),
            )
            for i, pattern in enumerate(found)
        ]

    def without(self, bank: "EvidenceBank", variables: tuple[str, ...]) -> "SoftEvidence":
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
        return SoftEvidence(likelihoods, log_scale, observed)


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
        first = {q.variable: q for q in reversed(list(quantisers.values()))}
        self._continuous = tuple(dict.fromkeys(q.variable for q in quantisers.values()))
        used = [first[name] for name in self._continuous]
        self._layout, self._columns = _variable_layout(used)
        self._raw_width = int(self._layout[:, 2].sum())
        self._width = int(self._layout[:, 4].sum())
        self._centres = _joined([q.standardisation.mean for q in used])
        self._axes = _joined([q.standardisation.axes for q in used])
        mixtures = [q.mixture for q in quantisers.values()]
        self._blocks = _block_layout(quantisers, self._continuous, self._layout, self.starts)
        self._means = _joined([m.means for m in mixtures])
        self._covariances = _joined([m.covariances for m in mixtures])
        factors = [np.linalg.cholesky(m.covariances) for m in mixtures]
        self._whiteners = _joined([np.linalg.inv(factor) for factor in factors])
        diagonals = [np.diagonal(factor, axis1=1, axis2=2) for factor in factors]
        self._log_volumes = _joined([np.log(d).sum(axis=1) for d in diagonals])

    def evidence(self, features: Features, deviations: Features | None = None) -> SoftEvidence:
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
        count = len(self._continuous)
        raw = np.zeros((rows, self._raw_width))
        spread = np.zeros((rows, self._raw_width) if deviations else (1, self._raw_width))
        known = np.zeros((rows, count), dtype=np.bool_)
        for position, name in enumerate(self._continuous):
            observed[name] = known[:, position]
            if name in features:
                place = self._columns[name]
                raw[:, place] = _checked(name, features[name], place)
                known[:, position] = np.isfinite(raw[:, place]).all(axis=1)
                if deviations and name in deviations:
                    given = _checked(name, deviations[name], place)
                    spread[:, place] = np.where(np.isfinite(given), given, 0.0)
        if not deviations:
            spread = np.broadcast_to(spread, raw.shape).copy() if rows > 1 else spread
        widened = bool(deviations)
        size = LARGEST_DIMENSION if widened else 1
        values = np.zeros((rows, self._width))
        widening = np.empty((rows, count, size, size))
        standardised(
            raw, spread, known, self._layout, self._centres, self._axes, values, widening, widened
        )
        block_likelihoods(
            values, known, widening, widened, self._blocks, self._means, self._covariances,
            self._whiteners, self._log_volumes, likelihoods, log_scale,
        )  # fmt: skip
        return SoftEvidence(likelihoods, log_scale, observed)

    def _set_class(self, features: Features, likelihoods: Array) -> NDArray[np.bool_]:
        known = np.zeros(len(likelihoods), dtype=np.bool_)
        if OBJECT_CLASS in features:
            for row, name in enumerate(features[OBJECT_CLASS].tolist()):
                index = self._class_index.get(name, -1)
                if index >= 0:
                    likelihoods[row, : len(self.classes)] = 0.0
                    likelihoods[row, index] = 1.0
                    known[row] = True
        return known


def _checked(name: str, values: NDArray[np.float64], place: slice) -> Array:
    if values.ndim != 2 or values.shape[1] != place.stop - place.start:
        raise ValueError(
            f"{name}: expected {place.stop - place.start} columns as in training, got shape "
            f"{values.shape}"
        )
    return values


def _joined(arrays: list[Array]) -> Array:
    return np.concatenate([a.ravel() for a in arrays]) if arrays else np.zeros(0)


def _variable_layout(used: list[Quantiser]) -> tuple[NDArray[np.int64], dict[str, slice]]:
    """Return the kernel's table of variables and each variable's raw columns."""
    rows, columns = [], {}
    raw = mean = axes = out = 0
    for quantiser in used:
        name = quantiser.variable
        dimension, coordinates = quantiser.standardisation.axes.shape
        kind = _KINDS.get(name, PLAIN)
        width = 4 if kind == ROTATION else coordinates
        if max(coordinates, dimension) > LARGEST_DIMENSION:
            raise ValueError(f"{name}: expected at most {LARGEST_DIMENSION} columns")
        rows.append([kind, raw, width, coordinates, dimension, mean, axes, out])
        columns[name] = slice(raw, raw + width)
        raw, mean = raw + width, mean + coordinates
        axes, out = axes + dimension * coordinates, out + dimension
    return np.array(rows, dtype=np.int64).reshape(-1, 8), columns


def _block_layout(
    quantisers: Mapping[str, Quantiser],
    variables: tuple[str, ...],
    layout: NDArray[np.int64],
    starts: dict[str, int],
) -> NDArray[np.int64]:
    blocks = []
    mean = covariance = volume = 0
    for key, quantiser in quantisers.items():
        states, dimension = quantiser.mixture.means.shape
        variable = variables.index(quantiser.variable)
        column = int(layout[variable, 7])
        blocks.append([variable, column, dimension, states, mean, covariance, starts[key], volume])
        mean, volume = mean + states * dimension, volume + states
        covariance += states * dimension * dimension
    return np.array(blocks, dtype=np.int64).reshape(-1, 8)
