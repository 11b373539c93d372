import numpy as np
import pytest
from tests.support.hand_points import WEIGHTS, F, hand_pose, observed, prior_of

from intent_tracking.fit.hand_shape import (
    HandShapeConfig,
    HandShapeEstimate,
    load_shape,
    save_shape,
    shape_directions,
    shaped_hand,
)
from intent_tracking.fit.refinement import refine
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_kernel import hand_arrays
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.object_kernel import object_arrays

SHAPE = np.r_[1.06, 0.93, np.random.default_rng(0).uniform(0.95, 1.05, 20)]


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_affine_hand_is_that_of_the_joint_table(side):
    expected = hand_arrays(HandModel.from_shape(side, SHAPE))
    for fast, slow in zip(shaped_hand(side, SHAPE), expected, strict=True):
        np.testing.assert_allclose(fast, slow, atol=1e-7)


def test_directions_are_the_derivatives_of_the_hand():
    step = 1e-3
    directions = shape_directions("right", SHAPE)
    for number in range(22):
        moved = SHAPE.copy()
        moved[number] += step
        change = (hand_arrays(HandModel.from_shape("right", moved)).ends
                  - hand_arrays(HandModel.from_shape("right", SHAPE)).ends) / step  # fmt: skip
        np.testing.assert_allclose(directions.ends[number], change, atol=1e-4)


def calibrated(shape, frames, config):
    """Return the estimate after frames of a hand of some shape were fitted."""
    true, model, estimate = HandModel.from_shape("right", shape), HandModel(), None
    estimate = HandShapeEstimate(config)
    for seed in range(frames):
        state, rotation = hand_pose(seed)
        evidence = observed(state, rotation, 1500, true)
        arrays = shaped_hand("right", model.shape)
        states, rotations = state[None].copy(), rotation[None].copy()
        costs, normals = np.zeros(1, F), np.zeros((1, 26, 26), F)
        refine(
            arrays, object_arrays([]), evidence, WEIGHTS, prior_of(state, rotation), states,
            rotations, 15, costs, normals,
        )  # fmt: skip
        fitted = BodyState(states[0], rotations[0])
        if estimate.learn(model, arrays, evidence, WEIGHTS, fitted):
            model = HandModel.from_shape("right", estimate.shape)
    return estimate


def lengths(shape):
    return shape[0] * shape[2:]


def test_calibration_halves_the_error_of_the_bones():
    config = HandShapeConfig(frames=60, period=6)
    estimate = calibrated(SHAPE, 60, config)
    assert estimate.complete
    before = np.abs(1.0 - lengths(SHAPE)).mean()
    assert np.abs(lengths(estimate.shape) - lengths(SHAPE)).mean() < 0.5 * before
    assert estimate.shape[0] * estimate.shape[1] == pytest.approx(SHAPE[0] * SHAPE[1], abs=0.03)


def test_a_calibrated_shape_changes_no_more():
    config = HandShapeConfig(frames=4, period=2)
    np.testing.assert_array_equal(
        calibrated(SHAPE, 4, config).shape, calibrated(SHAPE, 7, config).shape
    )


def test_nothing_is_calibrated_where_it_is_switched_off():
    estimate = calibrated(SHAPE, 3, HandShapeConfig(calibrate=False))
    np.testing.assert_array_equal(estimate.shape, 1.0)
    assert not estimate.complete


def test_a_kept_shape_is_loaded_again(tmp_path):
    save_shape(tmp_path / "hand.npz", "left", SHAPE)
    np.testing.assert_array_equal(load_shape(tmp_path / "hand.npz"), SHAPE)
    start = HandShapeEstimate(HandShapeConfig(file=str(tmp_path / "hand.npz")))
    np.testing.assert_array_equal(start.shape, SHAPE)


def test_a_file_without_a_shape_is_refused(tmp_path):
    (tmp_path / "hand.npz").write_bytes(b"no archive")
    with pytest.raises(ValueError, match="hand shape"):
        load_shape(tmp_path / "hand.npz")
