"""Does the colour fit? It settles which of two siblings of one shape an object is."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_CHROMA_SPREAD = 0.05  # lamps and white balance shift r/(r+g+b) about this much
_LIGHT_SPREAD = 1.0  # shading changes the logarithm of the brightness about this much
_LEAST_PIXELS = 20


def color_mismatch(seen: Floats, color: Floats) -> float:
    """Return how unlikely the colour seen is for a model: half its squared distance in spreads.

    Chromaticity counts for much, brightness for little.

    Args:
        seen: (N, 3) RGB in 0..1 of the pixels that match the model.
        color: (3,) RGB of the model; NaN if it has none, which fits everything.
    """
    if len(seen) < _LEAST_PIXELS or not np.isfinite(color).all():
        return 0.0
    middle = np.median(seen, axis=0) + 0.01
    expected = color + 0.01
    chroma = middle / middle.sum() - expected / expected.sum()
    light = np.log(middle.sum() / expected.sum())
    return float(0.5 * (chroma @ chroma) / _CHROMA_SPREAD**2 + 0.5 * (light / _LIGHT_SPREAD) ** 2)
