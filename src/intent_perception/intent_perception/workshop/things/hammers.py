"""Parametric hammers: z from handle to head, the face strikes towards +x.

Each maker is one real kind of hammer; sizes are those of common products [m].
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.objects.families.designed_object import (
    DesignedObject,
    turns_about_z,
)
from intent_perception.objects.families.solids import (
    Piece,
    grip_rows,
    row,
)
from intent_perception.objects.families.tool_drafts import hammer_draft, hammer_head


def _claw(z: float, reach: float, drop: float, half: float, start: float = -0.010) -> list[Piece]:
    """Return the two prongs of a claw towards -x, bent down by drop [m] at its end."""
    share = np.linspace(0.0, 1.0, 9)
    prongs = []
    for side in (-1.0, 1.0):
        # From one root the prongs part into a V.
        y = side * (0.0042 + 0.0045 * share)
        width = 0.0042 + 0.0010 * share
        rows = [
            row(start - reach * s, half * (1 - 0.75 * s), w, 3.0, drop * s**2.0, b)
            for s, w, b in zip(share, width, y, strict=True)
        ][::-1]
        prongs.append(hammer_head(rows, z, 0))
    return prongs


def _poll(reach: float, radius: float, neck: float, eye: float) -> list[Array]:
    """Return the striking half of a claw hammer's head, from behind the eye to the face."""
    return [
        row(-0.018, eye, 0.8 * eye, 3.5),
        row(0.014, eye, 0.9 * eye, 3.5),
        row(0.018, neck, neck),
        row(reach - 0.022, neck, neck),
        row(reach - 0.016, radius, radius),
        row(reach - 0.002, radius, radius),
        row(reach, 0.9 * radius, 0.9 * radius),
    ]


def claw_hammer() -> DesignedObject:
    """Return a carpenter's hammer: wooden handle, curved claw."""
    grip = grip_rows(
        [
            (0.0, 0.0150, 0.0110),
            (0.006, 0.0170, 0.0130),
            (0.080, 0.0145, 0.0115),
            (0.130, 0.0165, 0.0125),
            (0.220, 0.0115, 0.0090),
            (0.315, 0.0120, 0.0085),
        ]
    )
    z = 0.300
    head = [hammer_head(_poll(0.062, 0.0140, 0.0105, 0.0145), z, 1), *_claw(z, 0.062, 0.034, 0.012)]
    return hammer_draft(grip, head, (0.062, z), 0.62, (0.72, 0.52, 0.30))


def framing_hammer() -> DesignedObject:
    """Return a long framing hammer with a straight ripping claw and a rubber grip."""
    grip = grip_rows(
        [
            (0.0, 0.0170, 0.0135),
            (0.008, 0.0190, 0.0150),
            (0.060, 0.0155, 0.0135),
            (0.140, 0.0175, 0.0145),
            (0.150, 0.0110, 0.0085),
            (0.360, 0.0110, 0.0080),
        ]
    )
    z = 0.345
    head = [hammer_head(_poll(0.070, 0.0155, 0.0120, 0.0155), z, 1), *_claw(z, 0.078, 0.012, 0.012)]
    return hammer_draft(grip, head, (0.070, z), 0.86, (0.90, 0.45, 0.08))


def ball_peen_hammer() -> DesignedObject:
    """Return a machinist's hammer with a ball behind the eye."""
    grip = grip_rows(
        [
            (0.0, 0.0140, 0.0110),
            (0.006, 0.0160, 0.0130),
            (0.110, 0.0150, 0.0120),
            (0.200, 0.0100, 0.0080),
            (0.305, 0.0115, 0.0085),
        ]
    )
    z = 0.290
    ball = 0.0155
    rows = [
        row(-0.052 + ball * (1 - np.cos(a)), ball * np.sin(a) + 1e-4)
        for a in np.linspace(0.02, 2.3, 10)
    ]
    rows += [
        row(-0.020, 0.0095),
        row(-0.015, 0.0150),
        row(0.015, 0.0150),
        row(0.019, 0.0110),
        row(0.026, 0.0110),
        row(0.032, 0.0160),
        row(0.052, 0.0160),
        row(0.054, 0.0145),
    ]
    return hammer_draft(grip, [hammer_head(rows, z, 1)], (0.054, z), 0.55, (0.60, 0.30, 0.15))


def cross_peen_hammer() -> DesignedObject:
    """Return a locksmith's hammer: square face, wedge across behind."""
    grip = grip_rows(
        [
            (0.0, 0.0125, 0.0100),
            (0.005, 0.0150, 0.0120),
            (0.120, 0.0135, 0.0110),
            (0.200, 0.0105, 0.0085),
            (0.290, 0.0115, 0.0085),
        ]
    )
    z = 0.278
    rows = [
        row(-0.058, 0.0020, 0.0115, 4.0),
        row(-0.056, 0.0030, 0.0115, 4.0),
        row(-0.016, 0.0130, 0.0125, 4.5),
        row(0.040, 0.0125, 0.0125, 4.5),
        row(0.042, 0.0110, 0.0110, 4.5),
    ]
    return hammer_draft(grip, [hammer_head(rows, z, 1)], (0.042, z), 0.42, (0.35, 0.38, 0.42))


def rubber_mallet() -> DesignedObject:
    """Return a mallet with a thick round head."""
    grip = grip_rows(
        [
            (0.0, 0.0145, 0.0145),
            (0.006, 0.0160, 0.0160),
            (0.090, 0.0140, 0.0140),
            (0.150, 0.0150, 0.0150),
            (0.300, 0.0125, 0.0125),
        ],
        2.0,
    )
    z = 0.285
    rows = [
        row(-0.050, 0.0270),
        row(-0.046, 0.0300),
        row(0.0, 0.0285),
        row(0.046, 0.0300),
        row(0.050, 0.0270),
    ]
    return hammer_draft(
        grip, [hammer_head(rows, z)], (0.050, z), 0.58, (0.18, 0.18, 0.20), turns_about_z(2)
    )


def club_hammer() -> DesignedObject:
    """Return a short heavy hammer with a square block."""
    grip = grip_rows(
        [
            (0.0, 0.0160, 0.0120),
            (0.008, 0.0190, 0.0145),
            (0.080, 0.0160, 0.0130),
            (0.150, 0.0185, 0.0140),
            (0.255, 0.0150, 0.0110),
        ]
    )
    z = 0.235
    rows = [
        row(-0.050, 0.0175, 0.0175, 5.0),
        row(-0.046, 0.0205, 0.0205, 5.0),
        row(0.046, 0.0205, 0.0205, 5.0),
        row(0.050, 0.0175, 0.0175, 5.0),
    ]
    return hammer_draft(
        grip, [hammer_head(rows, z, 1)], (0.050, z), 1.25, (0.80, 0.65, 0.15), turns_about_z(2)
    )


def wooden_mallet() -> DesignedObject:
    """Return a joiner's mallet: wedge-shaped wooden block."""
    grip = grip_rows(
        [
            (0.0, 0.0130, 0.0100),
            (0.006, 0.0155, 0.0125),
            (0.100, 0.0140, 0.0110),
            (0.330, 0.0155, 0.0110),
        ],
        3.5,
    )
    z = 0.275
    rows = [
        row(-0.062, 0.0390, 0.0260, 7.0),
        row(-0.059, 0.0415, 0.0285, 7.0),
        row(0.0, 0.0440, 0.0290, 7.0),
        row(0.059, 0.0415, 0.0285, 7.0),
        row(0.062, 0.0390, 0.0260, 7.0),
    ]
    return hammer_draft(
        grip, [hammer_head(rows, z, 1)], (0.062, z), 0.72, (0.86, 0.70, 0.48), turns_about_z(2)
    )


def tack_hammer() -> DesignedObject:
    """Return a small upholsterer's hammer: thin long head, slim handle."""
    grip = grip_rows(
        [
            (0.0, 0.0110, 0.0090),
            (0.005, 0.0135, 0.0110),
            (0.080, 0.0120, 0.0095),
            (0.140, 0.0080, 0.0065),
            (0.250, 0.0085, 0.0065),
        ]
    )
    z = 0.242
    rows = [
        row(-0.030, 0.0060, 0.0060),
        row(-0.012, 0.0090, 0.0085, 3.0),
        row(0.012, 0.0090, 0.0085, 3.0),
        row(0.018, 0.0062, 0.0062),
        row(0.050, 0.0060, 0.0060),
        row(0.052, 0.0085, 0.0085),
        row(0.060, 0.0085, 0.0085),
    ]
    head = [hammer_head(rows, z, 1), *_claw(z, 0.040, 0.018, 0.0070, -0.022)]
    return hammer_draft(grip, head, (0.060, z), 0.26, (0.55, 0.15, 0.25))


HAMMERS = (
    claw_hammer,
    framing_hammer,
    ball_peen_hammer,
    cross_peen_hammer,
    rubber_mallet,
    club_hammer,
    wooden_mallet,
    tack_hammer,
)
