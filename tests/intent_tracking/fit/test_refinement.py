import numpy as np
import pytest
from tests.support.hand_points import WEIGHTS, F, hand_pose, observed, prior_of

from intent_tracking.fit.normal_equations import linearize
from intent_tracking.fit.refinement import refine
from intent_tracking.fit.wrenches import WRENCH
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand, turn
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.object_kernel import object_arrays
from intent_tracking.tracker.track_config import TrackConfig


def linearized(evidence, prior, state, rotation):
    normal, gradient = np.zeros((26, 26), F), np.zeros(26, F)
    cost = linearize(
        hand_arrays(HandModel()), object_arrays([]), evidence, WEIGHTS, prior, state, rotation,
        hand_buffers(), normal, gradient, np.zeros((24, WRENCH), F),
        np.zeros((2, evidence.hand_points.shape[1]), F), np.zeros(20, F), np.zeros(20, np.int64),
        np.zeros(3, F),
    )  # fmt: skip
    return float(cost), normal, gradient


def moved(state, rotation, index, step):
    new, turned = state.copy(), rotation.copy()
    if 3 <= index < 6:
        axis = np.zeros(3, F)
        axis[index - 3] = step
        turn(*axis, rotation[0], turned[0])
    else:
        new[index] += step
    return new, turned


def test_gradient_equals_finite_differences():
    truth = hand_pose(1)
    evidence = observed(*truth)
    state, rotation = truth[0].copy(), truth[1]
    state[:3] += F(0.004)
    prior = prior_of(*truth)
    gradient = linearized(evidence, prior, state, rotation)[2]
    numeric = np.zeros(26)
    for index in range(26):
        ahead = linearized(evidence, prior, *moved(state, rotation, index, F(1e-3)))[0]
        behind = linearized(evidence, prior, *moved(state, rotation, index, F(-1e-3)))[0]
        numeric[index] = (ahead - behind) / 2e-3
    # points matched to the far side of a bone count a tenth in the step, fully in the cost
    np.testing.assert_allclose(-2.0 * gradient, numeric, atol=0.1 * np.abs(numeric).max())


def refined_offsets(seed):
    """Return the joints' median distance to the truth before and after refining one start [m]."""
    truth = hand_pose(seed)
    evidence = observed(*truth)
    rng = np.random.default_rng(seed)
    states = (truth[0] + rng.normal(0, 0.006, 26)).astype(F)[None]
    states[0, 3:6] = 0
    states[0, 6:] = np.clip(truth[0][6:] + rng.normal(0, 0.08, 20), 0.0, 1.2)
    rotations = truth[1][None].copy()
    turn(F(0.05), F(-0.03), F(0.04), truth[1][0], rotations[0, 0])
    start = states[0].copy(), rotations[0, 0].copy()
    costs, normals = np.zeros(1, F), np.zeros((1, 26, 26), F)
    prior = prior_of(states[0], rotations[0])
    narrow = WEIGHTS._replace(scale=F(TrackConfig().fine_scale))
    refine(
        hand_arrays(HandModel()), object_arrays([]), evidence, narrow, prior, states, rotations,
        25, costs, normals,
    )  # fmt: skip
    joints = []
    for state, rotation in (start, (states[0], rotations[0, 0]), (truth[0], truth[1][0])):
        buffers = hand_buffers()
        place_hand(hand_arrays(HandModel()), state, rotation, buffers)
        joints.append(buffers.landmarks.copy())
    return [np.median(np.linalg.norm(points - joints[2], axis=1)) for points in joints[:2]]


@pytest.mark.parametrize("seed", range(6))
def test_refinement_brings_most_joints_back_to_the_truth(seed):
    before, after = refined_offsets(seed)
    assert before > 0.003
    assert after < 0.0015


def test_normal_matrix_is_the_sum_over_single_points():
    truth = hand_pose(4)
    evidence = observed(*truth, count=80)
    prior = prior_of(*truth)
    whole = linearized(evidence, prior, *truth)[1]
    base = linearized(evidence._replace(hand_points=np.zeros((3, 0), F)), prior, *truth)[1]
    total = np.zeros_like(whole)
    for n in range(evidence.hand_points.shape[1]):
        single = evidence._replace(hand_points=evidence.hand_points[:, n : n + 1].copy())
        total += linearized(single, prior, *truth)[1] - base
    np.testing.assert_allclose(total + base, whole, atol=1e-3 * np.abs(whole).max())
