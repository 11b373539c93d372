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
    "quality": (3.88, 1),
    "goes on": (-3.37, -1),
    "hidden": (-1.57, -1),
    "off the table": (-0.57, -1),
    "newly explained": (1.98, 1),
    "rival": (-1.49, -1),
    "contour": (0.97, 1),
    "colour mismatch": (-0.40, -1),
    "residual": (-0.24, -1),
    "size": (0.29, 1),
    "alike": (-6.72, -1),
    "in front": (-3.50, -1),
    "unknown": (-2.17, -1),
    "on the table": (0.00, -1),
    "disagree": (0.00, -1),
    "patch residual": (-0.50, -1),
    "beyond": (-2.13, -1),
    "shape 1": (0.00, 1),
    "shape 2": (1.85, 1),
}
"""What each feature is: its weight, and the sign that its meaning allows (0: either).

Fitted to 256 detections in 46 development scenes; `python -m intent_perception.fit_confidence` fits
them anew.
"""
SIGNS = tuple(sign for _, sign in FEATURES.values())
_WEIGHTS = np.array([weight for weight, _ in FEATURES.values()])
_BIAS = -2.88
_LARGEST_MISMATCH = 8.0


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
