"""Parametric knives: z from handle to tip, spine at +x, edge at -x, flat of the blade across y.

Each maker is one real kind of knife; sizes are those of common products [m].
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.objects.families.designed_object import DesignedObject
from intent_perception.objects.families.solids import (
    grip_rows,
)
from intent_perception.objects.families.tool_drafts import Outline, knife_draft


def _line(*points: tuple[float, float]) -> Outline:
    """Return an outline through (share, x)."""
    shares, xs = np.array(points).T
    return lambda share: np.interp(share, shares, xs)


def _belly(straight: float, end: float, level: float, power: float = 2.0) -> Outline:
    """Return an edge at a level that rises from a share on to x = end at the tip."""

    def outline(share: Array) -> Array:
        rise = np.clip((share - straight) / (1.0 - straight), 0.0, 1.0) ** power
        x: Array = level + (end - level) * rise
        return x

    return outline


def chef_knife() -> DesignedObject:
    """Return a chef's knife: tall blade with a belly."""
    grip = grip_rows(
        [
            (0.0, 0.013, 0.009, -0.003),
            (0.006, 0.0165, 0.011, -0.003),
            (0.030, 0.013, 0.011),
            (0.080, 0.0125, 0.0105),
            (0.120, 0.0135, 0.0095),
        ]
    )
    return knife_draft(
        grip,
        0.124,
        0.200,
        _line((0, 0.013), (0.5, 0.012), (1, 0.0)),
        _belly(0.25, -0.002, -0.034),
        0.0026,
        (0.013, 0.0085, 0.016),
        0.22,
        (0.15, 0.15, 0.17),
    )


def paring_knife() -> DesignedObject:
    """Return a short vegetable knife."""
    grip = grip_rows(
        [
            (0.0, 0.009, 0.007),
            (0.008, 0.0115, 0.009),
            (0.050, 0.0095, 0.008),
            (0.098, 0.0110, 0.0075),
        ]
    )
    return knife_draft(
        grip,
        0.100,
        0.085,
        _line((0, 0.009), (0.6, 0.0075), (1, 0.001)),
        _belly(0.35, -0.0005, -0.011),
        0.0018,
        None,
        0.06,
        (0.85, 0.75, 0.10),
    )


def bread_knife() -> DesignedObject:
    """Return a long knife with a wavy edge."""
    grip = grip_rows(
        [
            (0.0, 0.0125, 0.009),
            (0.010, 0.0150, 0.011),
            (0.060, 0.0130, 0.011),
            (0.122, 0.0145, 0.0095),
        ],
        3.0,
    )

    def edge(share: Array) -> Array:
        wave: Array = -0.0185 + 0.0012 * np.abs(np.sin(share * 16.0 * np.pi))
        rising: Array = wave + 0.012 * np.clip((share - 0.93) / 0.07, 0, 1) ** 1.5
        return rising

    return knife_draft(
        grip,
        0.126,
        0.205,
        _line((0, 0.013), (0.85, 0.012), (1, 0.000)),
        edge,
        0.0022,
        None,
        0.17,
        (0.55, 0.33, 0.16),
    )


def santoku() -> DesignedObject:
    """Return a santoku: straight edge, spine that drops to the tip."""
    grip = grip_rows(
        [
            (0.0, 0.0110, 0.0100),
            (0.005, 0.0130, 0.0115),
            (0.070, 0.0120, 0.0110),
            (0.118, 0.0130, 0.0105),
        ],
        2.0,
    )

    def spine(share: Array) -> Array:
        drop: Array = 0.016 - 0.036 * np.clip((share - 0.70) / 0.30, 0.0, 1.0) ** 2.2
        return drop

    return knife_draft(
        grip,
        0.122,
        0.165,
        spine,
        _belly(0.6, -0.0235, -0.030),
        0.0024,
        (0.0135, 0.0100, 0.014),
        0.18,
        (0.70, 0.25, 0.20),
    )


def cleaver() -> DesignedObject:
    """Return a rectangular kitchen cleaver."""
    grip = grip_rows(
        [
            (0.0, 0.0140, 0.0105),
            (0.006, 0.0165, 0.0125),
            (0.060, 0.0140, 0.0120),
            (0.108, 0.0150, 0.0110),
        ]
    )
    return knife_draft(
        grip,
        0.112,
        0.172,
        _line((0, 0.018), (1, 0.018)),
        _line((0, -0.060), (0.9, -0.063), (1, -0.058)),
        0.0032,
        (0.016, 0.0095, 0.018),
        0.46,
        (0.30, 0.22, 0.16),
    )


def table_knife() -> DesignedObject:
    """Return a round-ended table knife with a slim metal handle."""
    grip = grip_rows(
        [
            (0.0, 0.0085, 0.0042),
            (0.010, 0.0110, 0.0050),
            (0.060, 0.0085, 0.0042),
            (0.105, 0.0070, 0.0036),
        ]
    )

    def edge(share: Array) -> Array:
        bow = 0.0095 + 0.0015 * np.sin(share * np.pi)
        rounded_end: Array = -bow * np.sqrt(
            np.clip(1.0 - ((share - 0.9) / 0.1).clip(0) ** 2, 0.02, 1)
        )
        return rounded_end

    def spine(share: Array) -> Array:
        rounded_end: Array = 0.0085 * np.sqrt(
            np.clip(1.0 - ((share - 0.9) / 0.1).clip(0) ** 2, 0.02, 1)
        )
        return rounded_end

    return knife_draft(grip, 0.108, 0.112, spine, edge, 0.0022, None, 0.075, (0.70, 0.72, 0.75))


def steak_knife() -> DesignedObject:
    """Return a steak knife: thick wooden handle, blade with an upswept point."""
    grip = grip_rows(
        [
            (0.0, 0.0120, 0.0085, -0.004),
            (0.012, 0.0145, 0.0105, -0.003),
            (0.045, 0.0115, 0.0095),
            (0.085, 0.0105, 0.0090),
            (0.106, 0.0120, 0.0085),
        ],
        3.0,
    )

    def spine(share: Array) -> Array:
        upswept: Array = 0.009 - 0.005 * np.sin(share * np.pi * 0.8) + 0.004 * share**3
        return upswept

    return knife_draft(
        grip,
        0.110,
        0.118,
        spine,
        _belly(0.3, 0.0065, -0.0125, 2.4),
        0.0016,
        (0.0105, 0.0075, 0.012),
        0.085,
        (0.45, 0.15, 0.10),
    )


def carving_knife() -> DesignedObject:
    """Return a long slender slicing knife with a curved handle."""
    grip = grip_rows(
        [
            (0.0, 0.0120, 0.0085, -0.008),
            (0.008, 0.0145, 0.0100, -0.007),
            (0.040, 0.0110, 0.0105, 0.001),
            (0.090, 0.0110, 0.0100, 0.002),
            (0.126, 0.0125, 0.0090, 0.000),
        ]
    )
    return knife_draft(
        grip,
        0.130,
        0.225,
        _line((0, 0.0115), (0.7, 0.011), (1, 0.002)),
        _belly(0.55, 0.000, -0.0145, 2.2),
        0.0018,
        (0.0125, 0.0085, 0.014),
        0.15,
        (0.10, 0.30, 0.32),
    )


KNIVES = (
    chef_knife,
    paring_knife,
    bread_knife,
    santoku,
    cleaver,
    table_knife,
    steak_knife,
    carving_knife,
)
