"""How sure is it? The probability that a detection is right, from what speaks for it."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from intent_perception.conflict import quality_of
from intent_perception.explanation import (
    DISAGREE,
    DRAWN,
    FRONT,
    HIDDEN,
    MATCH,
    RESIDUAL,
    TABLE,
    UNKNOWN,
)

if TYPE_CHECKING:
    from intent_perception.candidates import Drawing

Floats = NDArray[np.float32]

FEATURES = {
    "quality": (2.15, 1),
    "goes on": (-3.05, -1),
    "hidden": (-1.38, -1),
    "off the table": (-0.67, -1),
    "newly explained": (1.58, 1),
    "rival": (-1.15, -1),
    "contour": (0.84, 1),
    "colour mismatch": (-1.00, -1),
    "residual": (-0.08, -1),
    "size": (0.21, 1),
    "alike": (-7.24, -1),
    "in front": (-2.01, -1),
    "unknown": (-1.61, -1),
    "on the table": (0.00, -1),
    "disagree": (0.00, -1),
    "patch residual": (-0.42, -1),
    "beyond": (-1.91, -1),
    "shape 1": (0.00, 1),
    "shape 2": (0.91, 1),
}
"""What each feature is: its weight, and the sign that its meaning allows (0: either)."""
SIGNS = tuple(sign for _, sign in FEATURES.values())
_WEIGHTS = np.array([weight for weight, _ in FEATURES.values()])
_BIAS = -0.56
_LARGEST_MISMATCH = 4.0


def features_of(
    drawing: "Drawing",
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
            *measures,
        ],
        np.float32,
    )


def confidence(features: Floats) -> float:
    """Return the probability that a detection with these features is right."""
    return float(1.0 / (1.0 + np.exp(-(features @ _WEIGHTS + _BIAS))))
