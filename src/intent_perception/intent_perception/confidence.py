"""How sure is it? The probability that a detection is right, from what speaks for it."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from intent_perception.conflict import quality_of
from intent_perception.explanation import (
    DRAWN,
    HIDDEN,
    MATCH,
    RESIDUAL,
)

if TYPE_CHECKING:
    from intent_perception.candidates import Drawing

Floats = NDArray[np.float32]

FEATURES = {
    "quality": 2.0,
    "goes on": -16.0,
    "hidden": -3.5,
    "off the table": -4.0,
    "newly explained": 1.0,
    "rival": -1.8,
    "contour": 0.7,
    "colour mismatch": -0.5,
    "residual": -0.4,
    "size": 0.2,
    "alike": 0.0,
}
"""What each feature is and its weight relative to the others.

A free fit to rendered scenes puts more on heights and contours than real depth images bear, whose
planes bend and whose edges are lost; so only the scale of all weights and the bias are fitted.
"""
_WEIGHTS = np.array(list(FEATURES.values()))
# Set by hand on development scenes; colour weighs little, since the demonstration room has darker
# and warmer lamps. `python -m intent_perception.fit_confidence` is still to be run on the whole.
_SCALE, _BIAS = 1.17, 1.0


def features_of(
    drawing: "Drawing",
    contour: tuple[int, int],
    lowest: float,
    alike: float,
    worth: float,
    rival: float,
) -> Floats:
    """Return what the confidence is computed from (11,).

    Args:
        drawing: the object in the scene.
        contour: pixels where the scene ends with the object, and where it goes on.
        lowest: height of the lowest point above the table around the object [m].
        alike: share of the turns that look alike.
        worth: what the object newly explains [pixel].
        rival: what the best other model would explain, relative to this one.
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
            min(drawing.mismatch, 3.0),
            min(counts[RESIDUAL] / match * 1000.0, 5.0),
            np.log(max(worth, 20.0) / 100.0),
            alike,
        ],
        np.float32,
    )


def confidence(features: Floats) -> float:
    """Return the probability that a detection with these features is right."""
    return float(1.0 / (1.0 + np.exp(-(_SCALE * evidence_for(features) + _BIAS))))


def evidence_for(features: Floats) -> float:
    """Return the weighted sum of features (11,), the log-odds up to scale and bias."""
    return float(features @ _WEIGHTS)
