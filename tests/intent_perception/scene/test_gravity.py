"""An accelerometer at rest tells the vertical; in motion it says nothing."""

import numpy as np
import pytest

from intent_perception.scene.gravity import Gravity


def test_the_vertical_is_what_is_felt_at_rest() -> None:
    gravity, rng = Gravity(), np.random.default_rng(0)
    for _ in range(200):
        gravity.add(np.array([0.0, -9.81, 0.0]) + rng.normal(0.0, 0.05, 3))
    assert gravity.up is not None
    assert gravity.up @ [0.0, -1.0, 0.0] == pytest.approx(1.0, abs=1e-4)


def test_motion_is_left_out() -> None:
    gravity = Gravity()
    gravity.add(np.array([8.0, -9.81, 3.0]))
    assert gravity.up is None
