import numpy as np
from tests.support.hand_films import HANDS
from tests.support.read_hands import random_hand, read_hand

from intent_tracking.hands.key_point_kernel import (
    KeyPointTarget,
    KeyPointWeights,
    key_points_of,
    linearize_key_points,
)
from intent_tracking.hands.key_point_start import key_point_offsets
from intent_tracking.hands.skin_depth import with_bones
from intent_tracking.scene.hand_kernel import hand_buffers, turn
from intent_tracking.scene.hand_model import FITTED_LIMITS
from intent_tracking.scene.posture_prior import shipped_posture

ARRAYS = HANDS["right"][1]
OFFSETS = key_point_offsets("right")


def state_of(seed):
    hand = random_hand(seed)
    return np.append(hand.values, np.float32(0.05)), hand.rotations[0].copy()


def moved(state, rotation, index, step):
    new, turned = state.copy(), rotation.copy()
    if 3 <= index < 6:
        axis = np.zeros(3, np.float32)
        axis[index - 3] = step
        turn(*axis, rotation, turned)
    else:
        new[index] += step
    return new, turned


def points_at(state, rotation):
    points, jacobian = np.zeros((21, 3)), np.zeros((21, 3, 27))
    key_points_of(ARRAYS, OFFSETS, state, rotation, hand_buffers(), points, jacobian)
    return points, jacobian


def cost_at(target, state, rotation):
    weights = KeyPointWeights(0.01, 0.05, 0.01, 2.3, 0.05, 2.8, -0.1, 0.05)
    normal, gradient = np.zeros((27, 27)), np.zeros(27)
    cost = linearize_key_points(
        ARRAYS, target, weights, state, rotation, hand_buffers(), np.zeros((21, 3)),
        np.zeros((21, 3, 27)), normal, gradient,
    )  # fmt: skip
    return cost, gradient


def test_key_points_are_joints_and_their_offsets():
    hand = random_hand(3)
    points, _ = points_at(np.append(hand.values, np.float32(0)), hand.rotations[0])
    np.testing.assert_allclose(points, read_hand("right", hand)[0], atol=1e-6)


def test_derivatives_equal_finite_differences():
    state, rotation = state_of(1)
    jacobian = points_at(state, rotation)[1]
    for index in range(27):
        ahead = points_at(*moved(state, rotation, index, np.float32(2e-3)))[0]
        behind = points_at(*moved(state, rotation, index, np.float32(-2e-3)))[0]
        np.testing.assert_allclose(
            jacobian[:, :, index], (ahead - behind) / 4e-3, atol=3e-4, err_msg=str(index)
        )


def test_gradient_of_the_cost_equals_finite_differences():
    state, rotation = state_of(2)
    truth, _ = read_hand("right", random_hand(5))
    near = points_at(state, rotation)[0] + 0.01 * np.sin(np.arange(63)).reshape(21, 3)
    target = KeyPointTarget(
        near[:, :2] / near[:, 2:], np.linspace(0.1, 1, 21), truth - truth.mean(axis=0),
        with_bones(near)[:, 2], np.full(41, 0.01), OFFSETS, FITTED_LIMITS - 0.3,
        shipped_posture(),
    )  # fmt: skip
    gradient = cost_at(target, state, rotation)[1]
    for index in range(27):
        step = np.float32(1e-3)
        ahead = cost_at(target, *moved(state, rotation, index, step))[0]
        behind = cost_at(target, *moved(state, rotation, index, -step))[0]
        np.testing.assert_allclose(
            -2 * gradient[index], (ahead - behind) / 2e-3, rtol=0.02, atol=2.0, err_msg=str(index)
        )
