"""Things that are in no database: each draw is a new shape of one of the six classes, or of none.

Outlines, proportions and sizes are drawn anew, in the ranges of common products; none of the 48
shipped objects is among them. They stand for what users own in benchmarks and in fits.
"""

from collections.abc import Callable

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import convex_hull
from intent_perception.objects.families.designed_object import (
    AXIS,
    NOTHING,
    Color,
    DesignedObject,
    finish,
)
from intent_perception.objects.families.solids import (
    Piece,
    grip_rows,
    loft,
    loft_parts,
    parts_of_pieces,
    rod,
    rounded,
    row,
    sweep,
    vessel,
)
from intent_perception.objects.families.tool_drafts import (
    hammer_draft,
    hammer_head,
    knife_draft,
    screwdriver_draft,
)
from intent_perception.objects.families.vessel_drafts import bottle_draft, glass_draft, mug_draft
from intent_perception.objects.model import Functions, ObjectModel, Part

Maker = Callable[[np.random.Generator], DesignedObject]


def _color(rng: np.random.Generator) -> Color:
    red, green, blue = rng.uniform(0.08, 0.95, 3)
    return float(red), float(green), float(blue)


def any_bottle(rng: np.random.Generator) -> DesignedObject:
    """Return a bottle: round, oval or square, long or short in the neck."""
    height, wide = rng.uniform(0.13, 0.31), rng.uniform(0.025, 0.044)
    neck = wide * rng.uniform(0.28, 0.58)
    shoulder = height * rng.uniform(0.45, 0.74)
    start = min(shoulder + rng.uniform(0.02, 0.07), 0.90 * height)
    waist = wide * (1.0 - rng.choice([0.0, 0.0, rng.uniform(0.05, 0.25)]))
    flat, power = 1.0, 2.0
    kind = rng.random()
    if kind > 0.85:
        power = rng.uniform(3.5, 5.0)
    elif kind > 0.6:
        flat, power = rng.uniform(0.55, 0.85), rng.uniform(2.0, 2.8)

    def across(z: float, r: float) -> Array:
        share = float(np.clip((r - neck) / max(wide - neck, 1e-3), 0.0, 1.0))
        return row(z, r, r * (1.0 + share * (flat - 1.0)), 2.0 + share * (power - 2.0))

    profile = [
        (0.0, 0.9 * wide), (0.003, wide), (0.35 * shoulder, wide), (0.6 * shoulder, waist),
        (0.9 * shoulder, wide), (shoulder, 0.97 * wide), (start, neck * rng.uniform(1.0, 1.15)),
        (height - 0.018, neck), (height - 0.017, neck * rng.uniform(1.0, 1.25)), (height, neck),
    ]  # fmt: skip
    rows = [across(z, r) for z, r in sorted(profile)]
    symmetry = AXIS if flat == 1.0 and power == 2.0 else NOTHING
    return bottle_draft(rows, start, shoulder, 0.4, _color(rng), symmetry)


def _cup(rng: np.random.Generator, height: float, wide: float) -> list[Array]:
    base, belly = wide * rng.uniform(0.6, 1.05), rng.uniform(-0.08, 0.16)
    shares = np.linspace(0.0, 1.0, 7)
    radii = base + (wide - base) * shares + belly * wide * np.sin(np.pi * shares)
    power = 2.0 if rng.random() < 0.85 else rng.uniform(3.0, 4.5)
    rows = [row(0.0, 0.92 * radii[0], None, power)]
    heights = 0.003 + (height - 0.003) * shares
    return rows + [row(z, r, None, power) for z, r in zip(heights, radii, strict=True)]


def any_glass(rng: np.random.Generator) -> DesignedObject:
    """Return a glass: straight, conical or bellied; one in five on a stem."""
    height, wide = rng.uniform(0.075, 0.170), rng.uniform(0.028, 0.045)
    rows = _cup(rng, max(height, 1.9 * wide), wide)
    if rng.random() < 0.2:
        stem, foot = rng.uniform(0.04, 0.09), rng.uniform(0.028, 0.038)
        thin = rng.uniform(0.004, 0.007)
        profile = [(0.0, foot), (0.003, foot), (0.008, thin), (stem, thin)]
        bowl = np.array([(0.0, thin), (0.2, 0.8), (0.5, 1.0), (1.0, rng.uniform(0.75, 1.0))])
        tall = rng.uniform(0.07, 0.11)
        profile += [(stem + 0.004 + tall * s, max(r * wide, thin)) for s, r in bowl]
        rows = [row(z, r) for z, r in profile]
        return glass_draft(rows, 0.0022, stem + 0.012, 0.2, _color(rng))
    return glass_draft(rows, rng.uniform(0.002, 0.004), rng.uniform(0.006, 0.014), 0.2, _color(rng))


def any_mug(rng: np.random.Generator) -> DesignedObject:
    """Return a mug with any handle."""
    height, wide = rng.uniform(0.062, 0.128), rng.uniform(0.033, 0.050)
    height = max(height, 1.5 * wide)
    rows = _cup(rng, height, wide)
    low, high = height * rng.uniform(0.12, 0.32), height * rng.uniform(0.72, 0.92)
    return mug_draft(
        rows, rng.uniform(0.003, 0.005), 0.33, _color(rng), low, high, rng.uniform(0.024, 0.040),
        rng.uniform(0.0032, 0.006), rng.uniform(0.006, 0.010), rng.uniform(0.5, 1.0),
    )  # fmt: skip


def any_knife(rng: np.random.Generator) -> DesignedObject:
    """Return a knife with a blade of any outline."""
    grip_length, half = rng.uniform(0.085, 0.125), rng.uniform(0.008, 0.015)
    side = half * rng.uniform(0.5, 0.85)
    grip = grip_rows(
        [
            (0.0, 0.9 * half, 0.9 * side),
            (0.3 * grip_length, half, side),
            (0.7 * grip_length, half * rng.uniform(0.85, 1.05), side * rng.uniform(0.85, 1.0)),
            (grip_length, half, 0.9 * side),
        ]
    )
    top = half * rng.uniform(0.6, 1.0)
    low = -half * rng.uniform(0.8, 2.4)
    length = rng.uniform(0.09, 0.21)
    start, rise = rng.uniform(0.4, 0.8), rng.uniform(1.4, 2.6)
    drop = rng.uniform(0.0, 0.7)

    def spine(share: Array) -> Array:
        fallen: Array = top + (low - top) * drop * np.clip((share - start) / (1 - start), 0, 1) ** 2
        return fallen

    def edge(share: Array) -> Array:
        end = top + (low - top) * drop - 0.001
        way = np.clip((share - start) / (1.0 - start), 0.0, 1.0) ** rise
        raised: Array = np.minimum(low + (end - low) * way, spine(share) - 0.0008)
        return raised

    thick = rng.uniform(0.0014, 0.003)
    return knife_draft(grip, grip_length, length, spine, edge, thick, None, 0.15, _color(rng))


def any_hammer(rng: np.random.Generator) -> DesignedObject:
    """Return a hammer: block, round or peen head."""
    long, half = rng.uniform(0.21, 0.35), rng.uniform(0.010, 0.016)
    grip = grip_rows(
        [
            (0.0, 1.1 * half, 0.9 * half),
            (0.3 * long, half * rng.uniform(0.9, 1.15), 0.8 * half),
            (0.7 * long, 0.75 * half, 0.6 * half),
            (long, 0.8 * half, 0.6 * half),
        ]
    )
    z, front, back = long - 0.012, rng.uniform(0.040, 0.065), rng.uniform(0.035, 0.065)
    thick, power = rng.uniform(0.010, 0.026), float(rng.choice([2.0, 4.0]))
    thin = thick * float(rng.choice([1.0, rng.uniform(0.15, 0.6)]))
    rows = [
        row(-back, 0.9 * thin, 0.9 * thick, power), row(-0.8 * back, thin, thick, power),
        row(-0.012, 0.9 * thick, 0.9 * thick, power), row(0.012, 0.9 * thick, 0.9 * thick, power),
        row(0.6 * front, thick, thick, power), row(front, 0.95 * thick, 0.95 * thick, power),
    ]  # fmt: skip
    return hammer_draft(grip, [hammer_head(rows, z, 1)], (front, z), 0.5, _color(rng))


def any_screwdriver(rng: np.random.Generator) -> DesignedObject:
    """Return a screwdriver with a round handle."""
    long, r = rng.uniform(0.065, 0.125), rng.uniform(0.010, 0.018)
    grip = [
        row(0.0, 0.7 * r), row(0.005, r), row(0.5 * long, r * rng.uniform(0.85, 1.0)),
        row(0.8 * long, r * rng.uniform(0.6, 0.9)), row(0.92 * long, r * rng.uniform(0.7, 0.95)),
        row(long, 0.6 * r),
    ]  # fmt: skip
    radius = float(np.clip(r * rng.uniform(0.18, 0.32), 0.0018, 0.0048))
    tip = str(rng.choice(["flat", "cross"]))
    return screwdriver_draft(grip, long, rng.uniform(0.06, 0.20), radius, tip, 0.1, _color(rng))


def _plain(
    piece: Piece, rng: np.random.Generator, upright: bool = True, rests: int = 4
) -> DesignedObject:
    parts = parts_of_pieces([piece])
    return DesignedObject(
        piece[0], parts, Functions(), NOTHING, 0.3, 0.5, _color(rng), upright, rests
    )


def _box(rng: np.random.Generator, low: Array, high: Array) -> DesignedObject:
    size = rng.uniform(low, high)
    corners = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [0.0, 1.0])).reshape(3, 8).T * size
    mesh = convex_hull(corners)
    return _plain((mesh, lambda: [Part("body", mesh)]), rng, upright=False, rests=6)


def any_carton(rng: np.random.Generator) -> DesignedObject:
    """Return a box such as food comes in."""
    return _box(rng, np.array([0.04, 0.06, 0.08]), np.array([0.09, 0.17, 0.24]))


def any_flat_box(rng: np.random.Generator) -> DesignedObject:
    """Return something flat and angular: a book, a phone, a remote control."""
    return _box(rng, np.array([0.045, 0.11, 0.010]), np.array([0.16, 0.24, 0.035]))


def any_can(rng: np.random.Generator) -> DesignedObject:
    """Return a closed can, jar or candle."""
    height, r = rng.uniform(0.035, 0.17), rng.uniform(0.025, 0.052)
    rim = 1.0 - rng.choice([0.0, 0.06])
    rows = [row(0.0, 0.97 * r), row(0.003, r), row(0.92 * height, r), row(height, rim * r)]
    return _plain(rod("body", rows, 1), rng)


def any_bowl(rng: np.random.Generator) -> DesignedObject:
    """Return a bowl or a deep plate."""
    r = rng.uniform(0.058, 0.085)
    height = r * rng.uniform(0.45, 1.05)
    base, bulge = r * rng.uniform(0.4, 0.7), rng.uniform(0.6, 1.4)
    shares = np.linspace(0.0, 1.0, 6)
    rows = [row(0.004 + height * s, base + (r - base) * s**bulge) for s in shares]
    made = vessel(rounded([row(0.0, base), *rows]), 0.004, 0.008)
    return _plain((made.mesh, lambda: list(made.parts)), rng, rests=1)


def any_ball(rng: np.random.Generator) -> DesignedObject:
    """Return a ball or a fruit: an ellipsoid."""
    r, squeeze = rng.uniform(0.022, 0.048), rng.uniform(0.8, 1.25)
    angle = np.linspace(0.05, np.pi - 0.05, 14)
    rows = [row(r * squeeze * (1 - np.cos(a)), r * np.sin(a)) for a in angle]
    return _plain(rod("body", rows, 0), rng, rests=1)


def any_stick(rng: np.random.Generator) -> DesignedObject:
    """Return a pen, a stick, a rolling pin or a torch: one thickness, no shaft."""
    long, r = rng.uniform(0.11, 0.28), rng.uniform(0.006, 0.022)
    end = rng.uniform(0.7, 1.0)
    rows = [row(0.0, 0.9 * r), row(0.003, r), row(0.85 * long, r), row(long, end * r)]
    return _plain(rod("body", rows, 1), rng, upright=False, rests=1)


def any_banana(rng: np.random.Generator) -> DesignedObject:
    """Return something long and bent."""
    reach, r = rng.uniform(0.07, 0.12), rng.uniform(0.012, 0.02)
    angle = np.linspace(-0.8, 0.8, 17) * rng.uniform(0.6, 1.2)
    path = reach * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = sweep(path, r, r, 2.0)
    shrink = np.clip(1.2 * np.cos(np.linspace(-1.35, 1.35, 17)), 0.25, 1.0)[:, None, None]
    middle = rings.mean(axis=1, keepdims=True)
    rings = middle + (rings - middle) * shrink
    return _plain(
        (loft(rings), lambda: loft_parts("body", rings, 0.1)), rng, upright=False, rests=1
    )


def any_spoon(rng: np.random.Generator) -> DesignedObject:
    """Return cutlery that does not cut: a flat handle with a wide end."""
    long, wide = rng.uniform(0.14, 0.26), rng.uniform(0.016, 0.03)
    thick, thin = rng.uniform(0.006, 0.011), rng.uniform(0.004, 0.006)
    rows = [
        row(0.0, 0.3 * wide, 0.5 * thin), row(0.02, 0.32 * wide, 0.5 * thin),
        row(0.6 * long, 0.2 * wide, 0.5 * thin), row(0.72 * long, 0.3 * wide, 0.5 * thin),
        row(0.86 * long, wide, thick), row(0.95 * long, 0.8 * wide, thick),
        row(long, 0.2 * wide, thin),
    ]  # fmt: skip
    return _plain(rod("body", rows, 1), rng, upright=False, rests=1)


def any_toy(rng: np.random.Generator) -> DesignedObject:
    """Return two blocks on each other, as a toy car or a stapler."""
    long, wide, high = rng.uniform([0.07, 0.035, 0.025], [0.15, 0.07, 0.05])
    part, share = rng.uniform(0.35, 0.7), rng.uniform(0.5, 0.9)
    rows = [
        row(0.0, 0.5 * long, 0.5 * wide, 5.0), row(high, 0.5 * long, 0.5 * wide, 5.0),
        row(high + 0.002, 0.5 * long * part, 0.5 * wide * share, 5.0),
        row(1.7 * high, 0.5 * long * part * 0.9, 0.5 * wide * share, 5.0),
    ]  # fmt: skip
    return _plain(rod("body", rows, 0), rng, rests=2)


OF_CLASS: dict[str, Maker] = {
    "bottle": any_bottle,
    "glass": any_glass,
    "mug": any_mug,
    "knife": any_knife,
    "hammer": any_hammer,
    "screwdriver": any_screwdriver,
}
"""A maker of each class."""
OF_NONE: tuple[Maker, ...] = (
    any_carton, any_flat_box, any_can, any_can, any_bowl, any_bowl, any_ball, any_stick,
    any_banana, any_spoon, any_toy,
)  # fmt: skip
"""Makers of what belongs to none of them."""


def unseen_thing(object_class: str, rng: np.random.Generator, name: str) -> ObjectModel:
    """Return a new thing of a class, "" = of none."""
    maker = OF_CLASS.get(object_class) or OF_NONE[rng.integers(len(OF_NONE))]
    for _ in range(4):
        try:
            return finish(maker(rng), name, object_class)
        except ValueError:
            continue  # a union of pieces that hardly touch fails now and then
    raise ValueError(f"expected to make a {object_class or 'thing'} with one of four draws")
