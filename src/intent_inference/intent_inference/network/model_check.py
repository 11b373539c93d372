"""Whether a model that was read can answer: compiled queries trust shapes and numbers blindly."""

import numpy as np

from intent_inference.network.structure import TASK
from intent_inference.network.task_model import Member, TaskModel, TaskNetworks
from intent_inference.quantisation.quantiser import Quantiser
from intent_inference.quantisation.variables import OBJECT_CLASS, VARIABLES
from intent_perception.basics.arrays import Array

_LARGEST = 1e9
"""Counts, coordinates and log-odds are far below."""


def check_model(model: TaskModel) -> None:
    """Refuse a model whose parts do not fit each other or hold impossible numbers.

    Raises:
        ValueError: that names the part.
    """
    unknown = sorted(set(model.variables) - set(VARIABLES))
    _require(not unknown, f"unknown variables {unknown}")
    _require(len(set(model.classes)) == len(model.classes), "a class that stands there twice")
    _require(len(set(model.tasks)) == len(model.tasks) > 0, "no task, or one twice")
    for key, quantiser in model.quantisers.items():
        _check_quantiser(key, quantiser)
    states = {key: len(q.mixture.weights) for key, q in model.quantisers.items()}
    states[OBJECT_CLASS] = len(model.classes)
    for networks in model.networks:
        _require(len(networks.members) > 0, f"no network of {networks.task}")
        for member in networks.members:
            _check_member(f"{networks.task}, {member.recipe}", member, model, states)
        _check_calibrations(networks)


def _require(fits: bool, problem: str) -> None:
    if not fits:
        raise ValueError(problem)


def _finite(name: str, values: Array, shape: tuple[int, ...]) -> None:
    _require(values.shape == shape, f"{name} has the shape {values.shape}, expected {shape}")
    _require(
        values.dtype.kind in "fiu" and bool(np.all(np.abs(values) < _LARGEST)),
        f"{name} holds NaN, infinity or values beyond {_LARGEST:g}",
    )


def _check_quantiser(key: str, quantiser: Quantiser) -> None:
    mixture, own = quantiser.mixture, quantiser.standardisation
    _require(quantiser.variable in VARIABLES, f"{key} is of an unknown variable")
    _require(mixture.means.ndim == 2 and own.axes.ndim == 2, f"{key}: arrays of other dimensions")
    components, dimension = mixture.means.shape
    coordinates = own.axes.shape[1]
    _finite(f"{key}:weights", mixture.weights, (components,))
    _finite(f"{key}:means", mixture.means, (components, dimension))
    _finite(f"{key}:covariances", mixture.covariances, (components, dimension, dimension))
    _finite(f"{quantiser.variable}:mean", own.mean, (coordinates,))
    _finite(f"{quantiser.variable}:axes", own.axes, (dimension, coordinates))
    _finite(f"{quantiser.variable}:back", own.back, (coordinates, dimension))
    total = float(mixture.weights.sum())
    _require(
        bool(np.all(mixture.weights > 0.0)) and abs(total - 1.0) < 1e-3,
        f"{key}:weights are no shares of one",
    )
    flipped = np.swapaxes(mixture.covariances, 1, 2)
    positive = np.linalg.eigvalsh(mixture.covariances).min() > 0.0
    _require(
        bool(positive) and np.allclose(mixture.covariances, flipped, atol=1e-6),
        f"{key}:covariances are no covariances",
    )


def _check_member(name: str, member: Member, model: TaskModel, states: dict[str, int]) -> None:
    own = {TASK: 2}
    for variable in member.parents:
        if variable == TASK:
            continue
        key = member.keys.get(variable, "")
        right = key == OBJECT_CLASS if variable == OBJECT_CLASS else key in model.quantisers
        _require(right, f"{name}: {variable} has no states")
        _require(
            variable == OBJECT_CLASS or model.quantisers[key].variable == variable,
            f"{name}: {variable} has the states of another variable",
        )
        own[variable] = states[key]
    _require(TASK in member.parents, f"{name}: it lacks the task")
    for variable, parents in member.parents.items():
        _require(set(parents) <= set(member.parents), f"{name}: {variable} has unknown parents")
        shape = tuple(own[v] for v in (*parents, variable))
        _finite(f"{name}: counts of {variable}", member.counts[variable], shape)
        _require(bool(np.all(member.counts[variable] >= 0.0)), f"{name}: negative counts")
    _require(0.0 < member.prior.strength < _LARGEST, f"{name}: a prior without strength")
    _require_no_circle(name, dict(member.parents))


def _require_no_circle(name: str, parents: dict[str, tuple[str, ...]]) -> None:
    while parents:
        roots = [v for v, above in parents.items() if not set(above) & set(parents)]
        _require(len(roots) > 0, f"{name}: variables depend on each other in a circle")
        for root in roots:
            del parents[root]


def _check_calibrations(networks: TaskNetworks) -> None:
    for calibration in networks.calibrations:
        name = f"{networks.task}: calibration"
        _require(set(calibration.observed) <= set(VARIABLES), f"{name} of unknown variables")
        _finite(f"{name} weights", calibration.weights, (len(networks.members),))
        count = calibration.knots.size
        _require(count > 0, f"{name} without knots")
        _finite(f"{name} knots", calibration.knots, (count,))
        _finite(f"{name} levels", calibration.levels, (count,))
        rising = np.all(np.diff(calibration.knots) > 0.0) and np.all(
            np.diff(calibration.levels) >= 0.0
        )
        _require(
            bool(rising) and bool(np.all(calibration.weights >= 0.0)),
            f"{name} does not increase",
        )
