"""Light as cameras meet it: too much, too little, warm, cold."""

from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.workshop.person.filming.picture import Light, sample_light

EXPOSURES = ("even", "over", "under", "warm", "cold")
_TINTS = {"warm": np.array([1.16, 0.98, 0.72]), "cold": np.array([0.90, 1.00, 1.12])}
_LAMP_AND_ROOM = 1.05
"""About what lamp and room send to a surface that faces both."""


def sample_exposure(kind: str, skin: Array, rng: np.random.Generator) -> Light:
    """Return light and exposure together: the picture clips what is brighter than white.

    Args:
        kind: one of `EXPOSURES`; over: a hand of that skin is mostly white, as before a dark cloth
            with automatic exposure; under: it has some quarter of the usual light.
        skin: (3,) reflectance of the hand.
        rng: source of the rest.

    Raises:
        ValueError: if there is no such kind.
    """
    if kind not in EXPOSURES:
        raise ValueError(f"expected one of {', '.join(EXPOSURES)}, got {kind!r}")
    light = sample_light(rng)
    if kind == "over":
        gain = min(rng.uniform(1.3, 2.4) / (_LAMP_AND_ROOM * float(skin.mean())), 3.5)
    elif kind == "under":
        gain = rng.uniform(0.20, 0.36)
    else:
        gain = rng.uniform(0.75, 0.95)
    tint = _TINTS.get(kind, np.ones(3))
    return replace(light, color=gain * tint * light.color, ambient=gain * tint * light.ambient)
