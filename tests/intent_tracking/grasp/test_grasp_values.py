"""A stable grasp of impossible values is refused by name, before any network sees it."""

from dataclasses import replace

import numpy as np
import pytest

from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures

FEATURES = GraspFeatures(
    "mug", size=np.full(3, 0.1), conv=np.array([0.5]), dir=np.array([0.0, 0.0, 0.0, 1.0]),
    npos=np.array([0.0, 0.0, 1.0]), fcon=np.full(20, 0.3), fvol=np.array([0.7]),
    coc=np.zeros(3), gbvl=np.full(3, 0.05),
)  # fmt: skip
NONE_KNOWN = GraspFeatures(None, *[None] * 8)


def grasp(features: GraspFeatures, std: GraspFeatures = NONE_KNOWN) -> StableGrasp:
    return StableGrasp(1, "mug_0", "mug_0", "mug", "right", features, std, np.eye(4))


def test_ordinary_values_pass() -> None:
    assert grasp(FEATURES)
    assert grasp(NONE_KNOWN)


@pytest.mark.parametrize("name", ["size", "conv", "dir", "npos", "fvol", "gbvl"])
def test_every_value_minus_one_is_no_grasp(name: str) -> None:
    value = np.full_like(getattr(FEATURES, name), -1.0)
    with pytest.raises(ValueError, match=f"expected {name} "):
        grasp(replace(FEATURES, **{name: value}))


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300, 57.0])
def test_angles_in_degrees_or_none_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="expected fcon"):
        grasp(replace(FEATURES, fcon=np.full(20, value)))


def test_a_negative_deviation_is_refused() -> None:
    with pytest.raises(ValueError, match="standard deviations of fvol"):
        grasp(FEATURES, replace(NONE_KNOWN, fvol=np.array([-0.1])))


def test_a_pose_that_scales_is_refused() -> None:
    with pytest.raises(ValueError, match="T_object_hand"):
        replace(grasp(FEATURES), T_object_hand=1000.0 * np.eye(4))
