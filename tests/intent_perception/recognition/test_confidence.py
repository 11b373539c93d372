"""The confidence is a probability: its fit recovers one, and it falls with what speaks against."""

import numpy as np
import pytest

from intent_perception.recognition.confidence import FEATURES, SIGNS, confidence
from intent_perception.workshop.figures.confidence_fit import fit
from intent_perception.workshop.figures.scoring import expected_calibration_error


def typical() -> np.ndarray:
    """Return the features of an object in plain view."""
    values = dict.fromkeys(FEATURES, 0.0)
    values |= {"quality": 0.93, "newly explained": 1.0, "contour": 1.0, "residual": 1.0}
    values |= {"size": 3.0, "rival": 0.3, "shape 1": 0.02, "shape 2": 0.2}
    return np.array(list(values.values()), np.float32)


def test_the_fit_recovers_a_probability() -> None:
    rng = np.random.default_rng(3)
    features = rng.random((4000, len(FEATURES)))
    truth = np.array(SIGNS) * 3.0
    chance = 1.0 / (1.0 + np.exp(-(features @ truth - truth.sum() / 2.0)))
    values = fit(features, rng.random(4000) < chance)
    said = 1.0 / (1.0 + np.exp(-(features @ values[:-1] + values[-1])))
    right = (rng.random(4000) < chance).tolist()
    gap = expected_calibration_error(said.tolist(), right)
    assert gap is not None
    assert gap < 0.03
    assert np.corrcoef(said, chance)[0, 1] > 0.97


def test_no_weight_contradicts_the_meaning_of_its_feature() -> None:
    rng = np.random.default_rng(4)
    features = rng.random((500, len(FEATURES)))
    backwards = features @ -np.array(SIGNS) > -np.sum(SIGNS) / 2.0
    values = fit(features, backwards)
    assert (values[:-1] * SIGNS >= 0.0).all()


def test_an_object_in_plain_view_is_nearly_certain() -> None:
    assert confidence(typical()) > 0.9


@pytest.mark.parametrize("name", [n for n, s in zip(FEATURES, SIGNS, strict=True) if s < 0])
def test_what_speaks_against_lowers_the_confidence(name: str) -> None:
    features = typical()
    features[list(FEATURES).index(name)] += 0.3
    assert confidence(features) <= confidence(typical())
