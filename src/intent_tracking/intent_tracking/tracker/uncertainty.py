"""Standard deviation of every value of the state, estimated from the fit's own residual.

The refinement takes every pixel's residual as independent with the same deviation sigma. Then
its normal matrix N, in units of one pixel, gives the covariance of the state, and what remains
of the fit tells sigma. The rendered cost C per hand pixel (see `objective`) is the mean absolute
residual in units of 4 cm, with pixels that one of hand and model lacks counted as well:

    sigma   = sqrt(pi / 2) 4 cm C                  deviation of a normal residual of that mean
    var x_i = sigma^2 [N^-1]_ii + sigma^2 / 6 + floor^2      i = position of the hand
    var x_i = sigma^2 [N^-1]_ii + floor^2                    any other value

The term sigma^2 / 6: a hand that is shaped differently errs alike over the whole of a palm or a
finger, so its place is no better than the mean of six such errors, however many pixels they have.
A good fit is so sure of itself and a poor one is not; hidden fingers are known as well as the
refinement's priors tell, which N contains.
"""

import math

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE
from intent_tracking.tracker.problem import Fit

COST_DEPTH = 0.04
"""Mean absolute residual of a hand pixel at a cost of 1 [m]."""
PARTS = 6
"""Palm and fingers: parts of a hand whose surface errs alike."""
HAND_FLOOR = 0.0005, 0.01
"""No position [m] and no angle [rad] of a hand is known better than this."""
OBJECT_FLOOR = 0.001, 0.03
"""The same of an object: the recognised mesh need not be the very object."""
REST_PLACE, REST_ANGLE = 0.002, 0.03
"""Deviation of an object at rest [m], [rad]."""


def point_deviation(cost: float) -> float:
    """Return sigma [m] of one pixel's residual in a fit of this cost per hand pixel."""
    return math.sqrt(0.5 * math.pi) * COST_DEPTH * cost


def state_deviation(fit: Fit | None, active: tuple[int, ...], objects: int) -> Array:
    """Return the deviations (26 + 6 N,).

    Args:
        fit: last fit of hand and active objects, None without a hand.
        active: objects that took part in it.
        objects: number N of objects.
    """
    deviation = np.tile([REST_PLACE] * 3 + [REST_ANGLE] * 3, 5 + objects)
    deviation = np.concatenate([np.full(HAND_SIZE, np.nan), deviation[: OBJECT_SIZE * objects]])
    if fit is None:
        return deviation
    lower = np.tril(fit.normal.astype(np.float64))
    matrix = lower + lower.T
    diagonal = np.einsum("ii->i", matrix)  # a view
    diagonal *= 0.5
    diagonal += 1e-5
    sigma = point_deviation(fit.cost)
    variance = sigma**2 * np.abs(np.diag(np.linalg.inv(matrix)))
    variance[:3] += sigma**2 / PARTS
    spread = np.sqrt(variance + _floor(len(active)) ** 2)
    deviation[:HAND_SIZE] = spread[:HAND_SIZE]
    for row, k in enumerate(active):
        source = slice(HAND_SIZE + OBJECT_SIZE * row, HAND_SIZE + OBJECT_SIZE * (row + 1))
        target = slice(HAND_SIZE + OBJECT_SIZE * k, HAND_SIZE + OBJECT_SIZE * (k + 1))
        deviation[target] = spread[source]
    return deviation


def _floor(active: int) -> Array:
    """Return the least deviations (26 + 6 K,) of a hand and K active objects."""
    hand = [HAND_FLOOR[0]] * 3 + [HAND_FLOOR[1]] * (HAND_SIZE - 3)
    return np.array(hand + ([OBJECT_FLOOR[0]] * 3 + [OBJECT_FLOOR[1]] * 3) * active)
