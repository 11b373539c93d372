"""Grasps read off the networks lie on the manifolds of their variables."""

import numpy as np
import pytest

from intent_imitation.workshop.trials.network_grasps import METHODS, inferred_posture
from intent_inference.network.model_file import shipped_model
from intent_perception.objects.database import ObjectDatabase


@pytest.mark.parametrize("method", METHODS)
def test_an_inferred_posture_is_a_direction_an_orientation_and_a_posture(method: str) -> None:
    model = shipped_model("schunk")
    posture = inferred_posture(model, "pouring", ObjectDatabase.load()["mug_1"], method)
    assert np.linalg.norm(posture["npos"]) == pytest.approx(1.0)
    assert np.linalg.norm(posture["dir"]) == pytest.approx(1.0)
    assert posture["fcon"].shape == (7,)
