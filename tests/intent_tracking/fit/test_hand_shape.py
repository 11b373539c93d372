import numpy as np
import pytest
from tests.support.hand_points import WEIGHTS, F, hand_pose, observed, prior_of

from intent_tracking.fit.hand_shape import (
    AVERAGE,
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

SHAPE = np.r_[1.06, 1.04, np.random.default_rng(0).uniform(0.95, 1.05, 20)]


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
    true, estimate = HandModel.from_shape("right", shape), HandShapeEstimate(config)
    model = HandModel.from_shape("right", estimate.shape)
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
    np.testing.assert_array_equal(estimate.shape, AVERAGE)
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


def sized(*sizes, config=None):
    """Return the estimate after the sizes of single frames were noted."""
    estimate = HandShapeEstimate(config or HandShapeConfig())
    for size in sizes:
        estimate.note_size(size)
    return estimate


def test_one_size_moves_the_start_less_than_many_equal_ones():
    one, many = sized(1.2).shape, sized(*[1.2] * 10).shape
    assert 1.0 < one[0] < many[0]
    np.testing.assert_array_equal(many[1:], AVERAGE[1:])


def test_one_wrong_size_among_many_does_not_matter():
    assert sized(*[1.1] * 4, 3.0, *[1.1] * 4).shape[0] == sized(*[1.1] * 9).shape[0]


def test_after_enough_sizes_it_is_known_and_further_ones_are_refused():
    estimate = HandShapeEstimate(HandShapeConfig())
    taken = [estimate.note_size(1.1) for _ in range(15)]
    assert taken == [True] * 12 + [False] * 3
    assert estimate.known
    np.testing.assert_array_equal(estimate.shape, sized(*[1.1] * 12).shape)


def test_a_hand_of_a_file_is_known_at_once(tmp_path):
    save_shape(tmp_path / "hand.npz", "right", SHAPE)
    estimate = HandShapeEstimate(HandShapeConfig(file=str(tmp_path / "hand.npz")))
    assert estimate.known
    assert not estimate.note_size(1.3)
    np.testing.assert_array_equal(estimate.shape, SHAPE)


def test_sizes_are_not_asked_for_once_whole_frames_have_been_learnt():
    estimate = calibrated(SHAPE, 1, HandShapeConfig())
    assert estimate.known
    assert not estimate.note_size(1.3)
