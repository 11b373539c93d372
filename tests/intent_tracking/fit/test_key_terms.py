"""Key points off their lines of sight: their cost, its gradient, and where they draw a hand."""

import numpy as np
import pytest
from tests.support.hand_points import F, hand_pose, observed, prior_of

from intent_perception.geometry.transforms import rotation_from_vector
from intent_tracking.fit.key_terms import KEY_SCALE, key_cost, key_gap
from intent_tracking.fit.normal_equations import linearize
from intent_tracking.fit.refinement import refine
from intent_tracking.fit.wrenches import WRENCH
from intent_tracking.hands.key_point_start import key_point_offsets
from intent_tracking.image.frame_evidence import NO_KEYS, KeyEvidence, Weights
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand
from intent_tracking.scene.hand_model import LIMITS, HandModel
from intent_tracking.scene.object_kernel import object_arrays

HAND = hand_arrays(HandModel())
ONLY_KEYS = Weights(*map(F, (0.02, 0, 0, 0, 0, 0, 1e-6, 0, 0, 0, 1.0, 0)))
OFFSETS = key_point_offsets("right").astype(F)
NONE = np.zeros((21, 3), F)


def placed(state, rotation):
    buffers = hand_buffers()
    place_hand(HAND, state, rotation[0], buffers)
    return buffers


def keys_at(state, rotation, offsets=OFFSETS):
    """Return perfect key points of a posed hand."""
    points = placed(state, rotation).landmarks + offsets @ rotation[0].T
    return KeyEvidence(points[:, :2] / points[:, 2:], np.ones(21, F), offsets)


def moved(state, rotation, index, step):
    new, turned = state.copy(), rotation.copy()
    if 3 <= index < 6:
        turned[0] = rotation_from_vector(step * np.eye(3)[index - 3]) @ rotation[0]
    else:
        new[index] += F(step)
    return new, turned


def evidence_of(pose, keys):
    return observed(*pose, count=1)._replace(hand_points=np.zeros((3, 0), F), keys=keys)


def linearized(pose, keys, weights=ONLY_KEYS):
    """Return the cost of key points alone and the derivatives of it by the hand."""
    normal, gradient = np.zeros((26, 26), F), np.zeros(26, F)
    cost = linearize(
        HAND, object_arrays([]), evidence_of(pose, keys), weights, prior_of(*pose), *pose,
        hand_buffers(), normal, gradient, np.zeros((24, WRENCH), F), np.zeros((2, 0), F),
        np.zeros(20, F), np.zeros(20, np.int64), np.zeros(3, F),
    )  # fmt: skip
    return float(cost), -2.0 * gradient


@pytest.mark.parametrize(("offsets", "unknowns"), [(NONE, 26), (OFFSETS, 6)])
def test_the_gradient_is_the_finite_difference_of_the_cost(offsets, unknowns):
    # the skin over a joint turns with the palm, which a finger's own derivatives leave out
    keys, (state, rotation) = keys_at(*hand_pose(1), offsets), hand_pose(1)
    keys.weights[:] = np.random.default_rng(0).uniform(0.0, 2.0, 21)
    state[:3] += F(0.008)
    state[6:] += np.random.default_rng(1).uniform(-0.2, 0.2, 20).astype(F)
    weights = ONLY_KEYS._replace(angle=F(0.0))
    gradient = linearized((state, rotation), keys, weights)[1][:unknowns]
    numeric = np.zeros(unknowns)
    for index in range(unknowns):
        step = 3e-4 if index < 3 else 3e-3
        ahead = linearized(moved(state, rotation, index, step), keys, weights)[0]
        behind = linearized(moved(state, rotation, index, -step), keys, weights)[0]
        numeric[index] = (ahead - behind) / (2.0 * step)
    for part in (slice(0, 3), slice(3, 6), slice(6, unknowns)):
        largest = np.abs(numeric[part]).max(initial=0.0)
        np.testing.assert_allclose(gradient[part], numeric[part], atol=0.003 * largest)


def test_the_cost_that_is_linearised_is_that_of_the_key_points_in_square_metres():
    pose = hand_pose(2)
    keys = keys_at(*moved(*pose, 0, 0.01))
    expected = float(key_cost(placed(*pose), keys, pose[1][0])) * float(KEY_SCALE) ** 2
    assert linearized(pose, keys)[0] == pytest.approx(expected, rel=1e-3)


def test_key_points_on_their_rays_leave_no_gap():
    pose = hand_pose(3)
    assert key_gap(placed(*pose), keys_at(*pose), pose[1][0]) < 1e-6


def test_the_gap_of_a_hand_shifted_across_its_rays_is_the_shift():
    pose = hand_pose(3)
    shifted = placed(*moved(*pose, 0, 0.02))
    assert key_gap(shifted, keys_at(*pose), pose[1][0]) == pytest.approx(0.02, abs=1e-5)


def test_without_key_points_there_is_no_gap_and_no_cost():
    pose = hand_pose(3)
    assert key_gap(placed(*pose), NO_KEYS, pose[1][0]) == -1.0
    assert key_cost(placed(*pose), NO_KEYS, pose[1][0]) == 0.0


def refined(pose, keys):
    """Return the hand after a refinement on key points alone."""
    states, rotations = pose[0][None].copy(), pose[1][None].copy()
    refine(
        HAND, object_arrays([]), evidence_of(pose, keys), ONLY_KEYS, prior_of(*pose), states,
        rotations, 40, np.zeros(1, F), np.zeros((1, 26, 26), F),
    )  # fmt: skip
    return states[0], rotations[0]


@pytest.mark.parametrize("seed", range(4))
def test_key_points_alone_bring_a_displaced_hand_onto_their_rays(seed):
    truth = hand_pose(seed)
    truth[0][6:] = np.clip(truth[0][6:], *LIMITS.T)
    keys = keys_at(*truth)
    start = moved(*moved(*truth, 0, 0.012), 5, 0.1)
    start[0][6:] += np.random.default_rng(seed).uniform(-0.1, 0.1, 20).astype(F)
    found = refined(start, keys)
    assert key_gap(placed(*start), keys, start[1][0]) > 0.010
    assert key_gap(placed(*found), keys, found[1][0]) < 0.001


def test_a_key_point_that_is_read_far_off_pulls_hardly():
    pose = hand_pose(4)
    keys, wrong = keys_at(*pose), keys_at(*pose)
    wrong.rays[8, 0] += 0.25  # 15 cm beside the tip of the index finger
    found = refined(pose, wrong)
    assert key_gap(placed(*found), keys, found[1][0]) < 0.0005


def test_a_key_point_costs_at_most_its_weight():
    pose = hand_pose(4)
    keys = keys_at(*pose)
    keys.rays[:] += 10.0
    assert key_cost(placed(*pose), keys, pose[1][0]) == pytest.approx(21.0, rel=1e-3)
