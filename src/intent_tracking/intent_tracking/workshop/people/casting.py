"""Who plays in film number n: every property in turn, in a random order, so that none is rare."""

from dataclasses import dataclass, fields

import numpy as np

from intent_tracking.workshop.person.filming.cover import COVERS
from intent_tracking.workshop.person.filming.exposure import EXPOSURES
from intent_tracking.workshop.person.filming.viewpoint import PLACEMENTS

_DRESSES = ("bare arm", "shirt", "sleeve", "glove", "watch", "ring")
_CHOICES: dict[str, tuple[str, ...]] = {
    "tone": tuple(str(tone) for tone in range(1, 11)),
    "dress": _DRESSES,
    "exposure": EXPOSURES,
    "cover": COVERS,
    "placement": PLACEMENTS,
    "company": ("alone", "alone", "second hand", "bystander"),
    "build": ("usual", "other", "usual"),
    "objects": ("known", "known", "known", "none"),
    "hidden": ("never", "once", "never"),
    "side": ("right", "left", "right"),
    "sensor": ("structured", "stereo"),
}
_TONES = ("light", "light", "light", "middle", "middle", "middle", "dark", "dark", "dark", "dark")


@dataclass(frozen=True)
class Cast:
    """What is special about one film; each value is a group of films."""

    tone: str
    """Monk tone, "1" to "10"."""
    dress: str
    exposure: str
    cover: str
    """Of the table."""
    placement: str
    """Of the camera."""
    company: str
    build: str
    objects: str
    """Whether the tracker is told of objects: "known"; "none": there is none."""
    hidden: str
    """Whether the hand disappears for a while."""
    side: str
    sensor: str

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that the film belongs to."""
        tone = f"tone {_TONES[int(self.tone) - 1]}"
        others = [(f.name, getattr(self, f.name)) for f in fields(self) if f.name != "tone"]
        return (tone, *(f"{name} {value}" for name, value in others))


def cast(seed: int, number: int) -> Cast:
    """Return the cast of film `number` of a seed; neighbours differ in everything they can."""
    chosen = {}
    for row, (name, values) in enumerate(_CHOICES.items()):
        turn, place = divmod(number, len(values))
        order = np.random.default_rng([seed, 11, row, turn]).permutation(len(values))
        chosen[name] = values[order[place]]
    if chosen["exposure"] == "over" and chosen["cover"] == "plain":
        chosen["cover"] = "black cloth"  # what makes cameras over-expose hands
    return Cast(**chosen)
