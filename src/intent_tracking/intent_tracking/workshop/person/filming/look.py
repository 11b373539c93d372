"""What a hand looks like: skin from Monk tone 1 to 10, and what is worn on it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_tracking.workshop.person.body.limb import bare_arm
from intent_tracking.workshop.person.body.person_hand import FOREARM, DemonstratorHand
from intent_tracking.workshop.person.filming.room import Piece, tube

MONK = ("f6ede4", "f3e7db", "f7ead0", "eadaba", "d7bd96",
        "a07e56", "825c43", "604134", "3a312a", "292420")  # fmt: skip
"""sRGB of the ten tones: E. Monk, "The Monk Skin Tone Scale" (2019), skintone.google, CC BY 4.0."""

_DISPLAY = 1.5
"""Exponent from a display value to the reflectance that `picture` shows as that value."""
_FLESH = np.array([0.80, 0.55, 0.46])
"""Display RGB of blood under thin skin: palms of all people tend to it."""
_BLUSH = (0.30, 0.60)
"""Share of blood in the colour, from person to person."""


@dataclass(frozen=True, eq=False)
class Worn:
    """Something stiff on one link of the right hand."""

    link: int
    """Number of the link, see `DemonstratorHand.link_poses`."""
    piece: Piece
    """In the link's frame."""


@dataclass(frozen=True, eq=False)
class Look:
    """How one hand is dressed and coloured."""

    palette: tuple[Array, ...]
    """Per tone of the skin (SKIN, PALMAR, NAIL, CREASE, GLOVE) its RGB in 0..1."""
    things: tuple[Worn, ...] = ()
    bare: bool = False
    """Whether forearm and elbow are seen."""

    def worn(self, T_table_hand: Array, hand: DemonstratorHand, angles: Array, wrist: Array
             ) -> list[Piece]:  # fmt: skip
        """Return watch and ring (table frame) on a hand at a pose (4, 4), in a posture (20,)."""
        if not self.things:
            return []
        poses = hand.link_poses(angles, wrist)

        def placed(thing: Worn) -> Piece:
            pose = poses[thing.link]
            local = thing.piece.mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
            points = (local * hand.mirror) @ T_table_hand[:3, :3].T + T_table_hand[:3, 3]
            faces = thing.piece.mesh.faces[:, :: -1 if hand.side == "left" else 1]
            return Piece(Mesh.of(points, faces), thing.piece.color, thing.piece.grain)

        return [placed(thing) for thing in self.things]

    def bare_arm(
        self, T_table_hand: Array, elbow: Array, shoulder: Array, thickness: float
    ) -> list[Piece]:
        """Return the naked arm behind the hand's own skin; nothing under a long sleeve."""
        if not self.bare:
            return []
        return [Piece(bare_arm(T_table_hand, elbow, shoulder, thickness), self.palette[0], 0.05)]


def plain_look(complexion: Array) -> Look:
    """Return a bare hand: one colour (3,), its palm a little lighter, its nails more."""
    return Look((complexion, 0.97 * complexion + 0.03, 0.75 * complexion + 0.22))


def monk_display(tone: int) -> Array:
    """Return the display RGB (3,) in 0..1 of a Monk tone.

    Raises:
        ValueError: if there is no such tone.
    """
    if not 1 <= tone <= len(MONK):
        raise ValueError(f"expected a Monk tone from 1 to {len(MONK)}, got {tone}")
    code = MONK[tone - 1]
    return np.array([int(code[i : i + 2], 16) for i in (0, 2, 4)]) / 255.0


def skin_palette(tone: int, rng: np.random.Generator) -> tuple[Array, ...]:
    """Return the reflectances (3,) of back, palm, nails and folds of a hand of a Monk tone.

    The scale's swatches are of faces in even light; hands are a little redder, and the palms of
    dark hands are much lighter than their backs.
    """
    back = monk_display(tone) * (1.0 + rng.uniform(-0.03, 0.03, 3))
    glow = _FLESH * back.mean() / _FLESH.mean()
    blush = rng.uniform(*_BLUSH)
    back = (1.0 - blush) * back + blush * np.clip(glow, 0.0, 1.0)
    pale = rng.uniform(0.30, 0.50) if back.mean() < 0.55 else rng.uniform(0.08, 0.22)
    palm = (1.0 - pale) * back + pale * _FLESH
    nail = 0.70 * palm + 0.30 * np.array([0.88, 0.70, 0.66])
    fold = back * np.array([0.90, 0.82, 0.79])
    shades = (back, palm, nail, fold)
    return tuple(np.clip(shade, 0.0, 1.0) ** _DISPLAY for shade in shades)


def watch(hand: DemonstratorHand, rng: np.random.Generator) -> tuple[Worn, ...]:
    """Return a watch: a strap behind the wrist and a dial on the back of the arm."""
    strap = np.full(3, 0.03) if rng.random() < 0.6 else rng.uniform(0.1, 0.5, 3)
    dial = np.full(3, float(rng.choice([0.02, 0.75, 0.9])))
    x, t = rng.uniform(-0.050, -0.036), hand.thickness
    height, width = 0.0210 * t, 0.0345 * t
    ends = np.array([[x - 0.011, 0, 0.0025], [x, 0, 0.0025], [x + 0.011, 0, 0.0025]])
    band = _band(ends, width, height / width)
    face = np.array([[x, 0, 0.0025 - height + 0.003], [x, 0, 0.0025 - height - 0.006]])
    glass = _band(face, 0.016, 1.0)
    return Worn(FOREARM, Piece(band, strap)), Worn(FOREARM, Piece(glass, dial))


def ring(hand: DemonstratorHand, rng: np.random.Generator) -> tuple[Worn, ...]:
    """Return a gold or silver ring on the ring finger."""
    metal = np.array([0.85, 0.62, 0.22]) if rng.random() < 0.5 else np.full(3, 0.7)
    x = rng.uniform(0.45, 0.60) * hand.bones[3, 0]
    path = np.array([[x - 0.003, 0, 0.0018], [x, 0, 0.0018], [x + 0.003, 0, 0.0018]])
    return (Worn(10, Piece(_band(path, 0.0120 * hand.thickness, 1.0), metal)),)


def _band(path: Array, radius: float, flat: float) -> Mesh:
    count = len(path)
    across = np.array([0.0, 1.0, 0.0])
    folds = np.zeros((count, 28))
    return tube(path, np.full(count, radius), np.full(count, flat), folds, 28, across)


Wear = Callable[[DemonstratorHand, np.random.Generator], tuple[Worn, ...]]
WORN: dict[str, Wear] = {"watch": watch, "ring": ring}
"""Makers of what is worn, by name."""
