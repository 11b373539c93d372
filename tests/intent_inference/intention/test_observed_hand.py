"""Our hand on joints that others measured."""

import numpy as np
import pytest

from intent_inference.intention.observed_hand import hands_of_joints, shape_of_joints
from intent_perception.geometry.transforms import pose_from_vector
from intent_tracking.scene.hand_model import HandModel, Side

LARGER = HandModel(scale=1.1)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_joints_of_a_larger_hand_are_met(side: Side) -> None:
    rng = np.random.default_rng(2)
    angles = np.radians([20, 0, 20, 20, *[0, 30, 30, 20] * 4]) + rng.normal(0.0, 0.1, (3, 20))
    pose = pose_from_vector(np.array([0.3, -0.2, 0.1, 0.4, -0.8, 0.3]))
    local = HandModel(side, 1.1).joint_positions(angles)
    joints = local @ pose[:3, :3].T + pose[:3, 3]
    shape = shape_of_joints(joints)
    states, errors = hands_of_joints(joints, side, shape)
    assert errors.max() < 0.002
    own = HandModel.from_shape(side, shape)
    for state, true in zip(states, joints, strict=True):
        placed = pose_from_vector(state[:6])
        again = own.joint_positions(state[6:]) @ placed[:3, :3].T + placed[:3, 3]
        assert np.abs(again - true).max() < 0.005


def test_a_frame_without_joints_gives_no_hand() -> None:
    joints = np.repeat(LARGER.joint_positions(np.zeros(20))[None], 2, axis=0)
    joints[1] = np.nan
    states, _ = hands_of_joints(joints, "right", shape_of_joints(joints))
    assert np.isnan(states[1]).all()
    assert np.isfinite(states[0]).all()
