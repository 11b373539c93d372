"""Which class a thing is of, from what is measured of it: small networks fitted to renderings."""

from functools import cache

import numpy as np

from intent_perception import SHARE
from intent_perception.basics.array_files import read_arrays, require_finite
from intent_perception.basics.arrays import Array
from intent_perception.objects.model import OBJECT_CLASSES

FITTED = SHARE / "class_odds.npz"
"""The weights; `python -m intent_perception.fit_classes` fits them anew."""
CLASSES = ("", *OBJECT_CLASSES)
"""In the order of the odds; "" = none of them."""
_FARTHEST = 4.0
"""Measures are cut at so many standard deviations: single odd ones shall not decide."""


def class_odds(features: Array) -> Array:
    """Return the probability (7,) of each of CLASSES, from the features of an outline (F,).

    Raises:
        ValueError: if the fitted weights are of other features.
    """
    fitted = _weights()
    if len(features) != len(fitted["mean"]):
        raise ValueError(
            f"{FITTED} is for {len(fitted['mean'])} measures, got {len(features)}: fit it anew"
        )
    values = np.clip((features - fitted["mean"]) / fitted["spread"], -_FARTHEST, _FARTHEST)
    odds = np.zeros(len(CLASSES))
    for k in range(len(fitted["first"])):
        hidden = np.maximum(values @ fitted["first"][k] + fitted["first_bias"][k], 0.0)
        scores = (hidden @ fitted["second"][k] + fitted["second_bias"][k]) * fitted["sharpness"]
        likely = np.exp(scores - scores.max())
        odds += likely / likely.sum()
    return np.asarray(odds / odds.sum())


@cache
def _weights() -> dict[str, Array]:
    arrays = read_arrays(FITTED, "weights of the class odds")
    require_finite(arrays)
    return {name: array.astype(np.float64) for name, array in arrays.items()}
