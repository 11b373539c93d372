"""Parametric screwdrivers: the shaft along z, the tip at the top.

Each maker is one real kind of screwdriver; sizes are those of common products [m].
"""

from intent_perception.basics.arrays import Array
from intent_perception.objects.families.designed_object import (
    DesignedObject,
    turns_about_z,
)
from intent_perception.objects.families.solids import (
    along_x,
    rod,
    row,
)
from intent_perception.objects.families.tool_drafts import screwdriver_draft
from intent_perception.objects.model import Part


def _turned(sizes: list[tuple[float, float, float]], power: float = 2.0) -> list[Array]:
    """Return rows of a turned handle from (z, radius, depth of the grooves)."""
    return [row(z, r, r, power, flute=depth) for z, r, depth in sizes]


def slotted_screwdriver() -> DesignedObject:
    """Return a common flat screwdriver with a fluted plastic handle."""
    grip = _turned(
        [
            (0.0, 0.0110, 0.0),
            (0.004, 0.0155, 0.0),
            (0.012, 0.0160, 0.0014),
            (0.065, 0.0160, 0.0014),
            (0.074, 0.0105, 0.0),
            (0.086, 0.0105, 0.0),
            (0.096, 0.0135, 0.0),
            (0.100, 0.0100, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.100, 0.100, 0.0030, "flat", 0.09, (0.90, 0.80, 0.10))


def cross_screwdriver() -> DesignedObject:
    """Return a cross-head screwdriver with a pear-shaped two-part grip."""
    grip = _turned(
        [
            (0.0, 0.0130, 0.0),
            (0.003, 0.0165, 0.0),
            (0.025, 0.0180, 0.0010),
            (0.060, 0.0150, 0.0010),
            (0.085, 0.0110, 0.0),
            (0.102, 0.0130, 0.0),
            (0.108, 0.0085, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.108, 0.125, 0.0035, "cross", 0.12, (0.80, 0.10, 0.12), lobes=3)


def long_screwdriver() -> DesignedObject:
    """Return a long mechanic's screwdriver."""
    grip = _turned(
        [
            (0.0, 0.0140, 0.0),
            (0.004, 0.0175, 0.0),
            (0.014, 0.0180, 0.0015),
            (0.085, 0.0175, 0.0015),
            (0.096, 0.0120, 0.0),
            (0.110, 0.0150, 0.0),
            (0.118, 0.0110, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.118, 0.200, 0.0040, "flat", 0.19, (0.10, 0.35, 0.75), lobes=8)


def stubby_screwdriver() -> DesignedObject:
    """Return a short thick screwdriver."""
    grip = _turned(
        [
            (0.0, 0.0150, 0.0),
            (0.004, 0.0185, 0.0),
            (0.012, 0.0195, 0.0014),
            (0.040, 0.0190, 0.0014),
            (0.050, 0.0130, 0.0),
            (0.058, 0.0110, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.058, 0.040, 0.0032, "cross", 0.07, (0.95, 0.50, 0.10))


def precision_screwdriver() -> DesignedObject:
    """Return a slim screwdriver with a turning cap."""
    grip = _turned(
        [
            (0.0, 0.0080, 0.0),
            (0.003, 0.0085, 0.0),
            (0.008, 0.0085, 0.0),
            (0.010, 0.0050, 0.0),
            (0.014, 0.0058, 0.0),
            (0.070, 0.0062, 0.0),
            (0.086, 0.0040, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.086, 0.060, 0.0018, "flat", 0.035, (0.62, 0.65, 0.70))


def t_handle_screwdriver() -> DesignedObject:
    """Return a screwdriver with a bar across the shaft."""
    bar, parts = rod(
        "handle",
        [
            row(-0.046, 0.0070, 0.0070),
            row(-0.043, 0.0100, 0.0095),
            row(0.0, 0.0115, 0.0110),
            row(0.043, 0.0100, 0.0095),
            row(0.046, 0.0070, 0.0070),
        ],
    )
    across = (along_x(bar, 0.012), lambda: [Part(p.name, along_x(p.mesh, 0.012)) for p in parts()])
    grip = _turned([(0.006, 0.0095, 0.0), (0.020, 0.0095, 0.0), (0.040, 0.0065, 0.0)])
    return screwdriver_draft(
        grip,
        0.040,
        0.120,
        0.0032,
        "cross",
        0.11,
        (0.25, 0.60, 0.30),
        turns_about_z(2),
        extra=[across],
    )


def ratchet_screwdriver() -> DesignedObject:
    """Return a bit driver with a bulb grip and a collar."""
    grip = _turned(
        [
            (0.0, 0.0120, 0.0),
            (0.003, 0.0175, 0.0),
            (0.022, 0.0215, 0.0012),
            (0.048, 0.0185, 0.0012),
            (0.072, 0.0120, 0.0),
            (0.082, 0.0120, 0.0),
            (0.084, 0.0150, 0.0),
            (0.104, 0.0150, 0.0),
            (0.106, 0.0080, 0.0),
            (0.112, 0.0075, 0.0),
        ]
    )
    return screwdriver_draft(grip, 0.112, 0.085, 0.0045, "cross", 0.21, (0.45, 0.20, 0.60))


def heavy_screwdriver() -> DesignedObject:
    """Return a square-shafted screwdriver with a wooden handle and steel cap."""
    grip = [
        row(0.0, 0.0120, 0.0120),
        row(0.002, 0.0145, 0.0145),
        row(0.010, 0.0145, 0.0145),
        row(0.012, 0.0165, 0.0135, 2.4),
        row(0.050, 0.0195, 0.0150, 2.4),
        row(0.090, 0.0150, 0.0125, 2.4),
        row(0.110, 0.0120, 0.0110),
        row(0.122, 0.0120, 0.0120),
        row(0.124, 0.0095, 0.0095),
    ]
    return screwdriver_draft(
        grip, 0.124, 0.155, 0.0042, "flat", 0.24, (0.65, 0.40, 0.18), turns_about_z(2), square=True
    )


SCREWDRIVERS = (
    slotted_screwdriver,
    cross_screwdriver,
    long_screwdriver,
    stubby_screwdriver,
    precision_screwdriver,
    t_handle_screwdriver,
    ratchet_screwdriver,
    heavy_screwdriver,
)
