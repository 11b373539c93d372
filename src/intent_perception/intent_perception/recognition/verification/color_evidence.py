"""Does the colour fit? It settles which of two siblings of one shape an object is."""

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import exact_kernel

_CHROMA_SPREAD = 0.05  # lamps and white balance shift r/(r+g+b) about this much
_LIGHT_SPREAD = 1.0  # shading changes the logarithm of the brightness about this much
_PALEST, _STRONGEST = 0.5, 1.1  # gloss and white light take this share of a colour's saturation
_PALENESS_SPREAD = 0.5
_LEAST_PIXELS = 20
_ENOUGH = 150  # more pixels do not make the median better


def color_mismatch(seen: Floats, color: Floats) -> float:
    """Return how unlikely the colour seen is for a model: half its squared distance in spreads.

    The hue counts for much, how pale or bright it is for little: gloss, shade and lamps change it.

    Args:
        seen: (N, 3) RGB in 0..1 of the pixels that match the model.
        color: (3,) RGB of the model; NaN if it has none, which fits everything.
    """
    if len(seen) < _LEAST_PIXELS or not np.isfinite(color).all():
        return 0.0
    middle = _middle(np.ascontiguousarray(seen[:: len(seen) // _ENOUGH + 1])) + 0.01
    expected = color + 0.01
    # differences from grey of the same brightness
    tint, model_tint = middle / middle.sum() - 1.0 / 3.0, expected / expected.sum() - 1.0 / 3.0
    share = float(tint @ model_tint) / (float(model_tint @ model_tint) + 1e-6)
    share = min(max(share, _PALEST), _STRONGEST)
    chroma = tint - share * model_tint
    light = np.log(middle.sum() / expected.sum())
    squares = (chroma @ chroma) / _CHROMA_SPREAD**2 + (light / _LIGHT_SPREAD) ** 2
    return float(0.5 * squares + 0.5 * ((1.0 - share) / _PALENESS_SPREAD) ** 2)


@exact_kernel
def _middle(colors: Floats) -> Floats:
    """Return the median (3,) of colours (N, 3)."""
    middle = np.empty(3, np.float32)
    for k in range(3):
        middle[k] = np.median(colors[:, k])
    return middle
