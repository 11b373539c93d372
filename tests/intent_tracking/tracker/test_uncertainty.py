from dataclasses import replace

import numpy as np
import pytest

from intent_tracking.scene.body_state import start_state
from intent_tracking.scene.state_layout import HAND_SIZE
from intent_tracking.tracker.problem import Fit
from intent_tracking.tracker.uncertainty import COST_DEPTH, HAND_FLOOR, PARTS, state_deviation


def fitted(cost, normal=None, objects=0):
    size = HAND_SIZE + 6 * objects
    if normal is None:
        normal = np.eye(size) * 1e4
    state = start_state([np.eye(4)] * objects)
    return Fit(state, np.tril(normal).astype(np.float32), cost, 0.0)


def least_squares_problem(rng, pixels=4000):
    """Return a Jacobian (pixels, 26) whose columns are in the units of the state."""
    return rng.normal(size=(pixels, HAND_SIZE)) * np.r_[np.ones(6), np.full(20, 0.05)]


def test_deviation_is_that_of_least_squares_with_the_residuals_of_the_fit():
    rng, sigma = np.random.default_rng(0), 0.05
    jacobian = least_squares_problem(rng)
    residuals = rng.normal(0.0, sigma, len(jacobian))
    fit = fitted(np.abs(residuals).mean() / COST_DEPTH, jacobian.T @ jacobian)
    expected = sigma * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    angles = np.hypot(expected[3:], HAND_FLOOR[1])
    np.testing.assert_allclose(state_deviation(fit, (), 0)[3:], angles, rtol=0.03)


def test_two_deviations_cover_the_estimates_of_repeated_fits():
    rng, sigma, covered = np.random.default_rng(1), 0.1, []
    for _ in range(60):
        jacobian = least_squares_problem(rng, 300)
        residuals = rng.normal(0.0, sigma, len(jacobian))
        error = np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
        left = residuals - jacobian @ error
        fit = fitted(np.abs(left).mean() / COST_DEPTH, jacobian.T @ jacobian)
        covered.append(np.abs(error[6:]) <= 2.0 * state_deviation(fit, (), 0)[6:])
    assert 0.90 < np.mean(covered) < 0.99


def test_a_fit_twice_as_poor_is_half_as_sure():
    good, poor = (state_deviation(fitted(cost, np.eye(26)), (), 0) for cost in (50.0, 100.0))
    np.testing.assert_allclose(poor, 2.0 * good, rtol=1e-3)


def test_more_pixels_do_not_place_a_hand_of_another_shape_better_than_its_parts():
    few, many = fitted(0.1, np.eye(26) * 1e3), fitted(0.1, np.eye(26) * 1e9)
    sure, surer = (state_deviation(fit, (), 0)[:3] for fit in (few, many))
    sigma = np.sqrt(0.5 * np.pi) * COST_DEPTH * 0.1
    assert np.all(surer < sure)
    np.testing.assert_allclose(surer, np.hypot(sigma / np.sqrt(PARTS), HAND_FLOOR[0]), rtol=1e-3)


def test_an_active_object_gets_its_own_share_and_one_at_rest_none():
    normal = np.diag(np.r_[np.full(HAND_SIZE, 1e4), np.full(6, 4.0)])
    fit = fitted(0.2, normal, objects=1)
    deviation = state_deviation(fit, (1,), 2)
    assert np.all(deviation[HAND_SIZE + 6 :] > deviation[HAND_SIZE : HAND_SIZE + 6])
    hidden = state_deviation(replace(fit, normal=normal.astype(np.float32) / 4.0), (1,), 2)
    np.testing.assert_array_equal(hidden[HAND_SIZE:][:6], deviation[HAND_SIZE:][:6])
    assert np.all(hidden[HAND_SIZE + 6 :] > deviation[HAND_SIZE + 6 :])


@pytest.mark.parametrize("objects", [0, 2])
def test_without_a_hand_its_deviations_are_nan(objects):
    deviation = state_deviation(None, (), objects)
    assert np.isnan(deviation[:HAND_SIZE]).all()
    assert np.isfinite(deviation[HAND_SIZE:]).all()
