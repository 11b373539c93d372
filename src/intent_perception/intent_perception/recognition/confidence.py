"""How sure is it? The probability that a detection is right, from what speaks for it."""

import numpy as np
from numpy.typing import NDArray

from intent_perception import SHARE
from intent_perception.basics.arrays import Floats
from intent_perception.basics.checked_files import read_yaml
from intent_perception.recognition.conflict import quality_of
from intent_perception.recognition.verification.drawing import Drawing
from intent_perception.recognition.verification.explanation import (
    DISAGREE,
    DRAWN,
    FRONT,
    HIDDEN,
    MATCH,
    RESIDUAL,
    TABLE,
    UNKNOWN,
)

FEATURES = {
    "quality": 1,
    "goes on": -1,
    "hidden": -1,
    "off the table": -1,
    "newly explained": 1,
    "rival": -1,
    "contour": 1,
    "colour mismatch": -1,
    "residual": -1,
    "size": 1,
    "alike": -1,
    "in front": -1,
    "unknown": -1,
    "on the table": -1,
    "disagree": -1,
    "patch residual": -1,
    "beyond": -1,
    "shape 1": 1,
    "shape 2": 1,
}
"""What each feature is: the sign that its meaning allows its weight (0: either)."""
SIGNS = tuple(FEATURES.values())
FITTED = SHARE / "confidence.yaml"
"""Their weights; `python -m intent_perception.fit_confidence` fits them anew."""
_LARGEST_MISMATCH = 8.0
_HIGHEST = np.array([4.0, 0.3, 1.0, 1.0])
"""Of `Drawing.measures`: a single odd value, as on an object of a few pixels, shall not decide."""


def features_of(
    drawing: Drawing,
    contour: tuple[int, int],
    lowest: float,
    alike: float,
    worth: float,
    rival: float,
    measures: Floats,
) -> Floats:
    """Return what the confidence is computed from (F,).

    Args:
        drawing: the object in the scene.
        contour: pixels where the scene ends with the object, and where it goes on.
        lowest: height of the lowest point above the table around the object [m].
        alike: share of the turns that look alike.
        worth: what the object newly explains [pixel].
        rival: what the best other model would explain, relative to this one.
        measures: of `Drawing.measures` (4,).
    """
    counts = drawing.counts
    ends, goes_on = contour
    drawn, match = max(float(counts[DRAWN]), 1.0), max(float(counts[MATCH]), 1.0)
    return np.array(
        [
            quality_of(counts[None])[0],
            min(goes_on / (ends + goes_on + 5.0), 0.4),
            counts[HIDDEN] / drawn,
            min(max(abs(lowest) - 0.008, 0.0), 0.02) / 0.02,
            min(max(worth, 0.0) / match, 1.0),
            min(rival, 1.2),
            min(ends, 40) / 40.0,
            min(drawing.mismatch, _LARGEST_MISMATCH),
            min(counts[RESIDUAL] / match * 1000.0, 5.0),
            np.log(max(worth, 20.0) / 100.0),
            alike,
            counts[FRONT] / drawn,
            counts[UNKNOWN] / drawn,
            counts[TABLE] / drawn,
            counts[DISAGREE] / drawn,
            *np.minimum(measures, _HIGHEST),
        ],
        np.float32,
    )


def _fitted() -> tuple[NDArray[np.float64], float]:
    """Return the weights (F,) and the bias.

    Raises:
        ValueError: if the file was made for other features.
    """
    kept = read_yaml(FITTED)
    if list(kept["weights"]) != list(FEATURES):
        raise ValueError(f"{FITTED} is for other features: fit it anew")
    return np.array(list(kept["weights"].values())), float(kept["bias"])


_WEIGHTS, _BIAS = _fitted()


def confidence(features: Floats) -> float:
    """Return the probability that a detection with these features is right."""
    return float(1.0 / (1.0 + np.exp(-(features @ _WEIGHTS + _BIAS))))
