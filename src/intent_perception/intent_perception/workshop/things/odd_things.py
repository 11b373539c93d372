"""Household things of no class in great variety, for fits alone: no benchmark shows any of them.

What a fit has seen of "none of the classes" it tells apart; these are to surround the six classes
on all sides: tools that are no hammer, vessels that are no mug, sticks, plates, tubs and oddments.
"""

from collections.abc import Callable

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh, convex_hull, merge_meshes
from intent_perception.geometry.transforms import rotation_from_vector
from intent_perception.objects.families.designed_object import NOTHING, DesignedObject, finish
from intent_perception.objects.families.solids import (
    loft,
    rings_of,
    rounded,
    row,
    sweep,
    vessel,
)
from intent_perception.objects.model import Functions, ObjectModel

Maker = Callable[[np.random.Generator], list[Mesh]]
_TILT = np.radians(90.0)


def _turned(rows: list[Array], times: int = 1) -> Mesh:
    return loft(rings_of(rounded(rows, times), 24))


def _block(size: Array, power: float = 6.0) -> Mesh:
    """Return a block of rounded section, centred above the origin."""
    x, y, z = (float(value) for value in size)
    return _turned(
        [row(0.0, 0.48 * x, 0.48 * y, power), row(0.1 * z, 0.5 * x, 0.5 * y, power),
         row(0.9 * z, 0.5 * x, 0.5 * y, power), row(z, 0.48 * x, 0.48 * y, power)]
    )  # fmt: skip


def _moved(mesh: Mesh, turn: Array, shift: Array) -> Mesh:
    """Return a mesh turned by a rotation vector [rad] and shifted [m]."""
    return Mesh(mesh.vertices @ rotation_from_vector(turn).T + shift, mesh.faces)


def _level(mesh: Mesh, heading: float, shift: Array) -> Mesh:
    """Return a mesh whose z is laid level, in a direction [rad], and shifted [m]."""
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    return _moved(mesh, _TILT * across, shift)


def _stick(long: float, first: float, last: float, flat: float = 1.0) -> Mesh:
    rows = [row(long * s, r, flat * r) for s, r in ((0.0, first), (0.4, first), (1.0, last))]
    return _turned(rows)


def _ring(radius: float, thick: float) -> Mesh:
    """Return a ring in the plane y = 0 about the origin."""
    angle = np.linspace(0.0, 1.97 * np.pi, 21)
    path = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return loft(sweep(path, thick, thick, 2.0))


def _pan(rng: np.random.Generator) -> list[Mesh]:
    """Return a pan, pot, ladle or measuring cup: a tub with a level stick."""
    r = rng.uniform(0.03, 0.11)
    height = r * rng.uniform(0.3, 1.0)
    base = r * rng.uniform(0.6, 1.0)
    tub = vessel(rounded([row(0.0, base), row(0.004, base), row(height, r)]), 0.003, 0.005).mesh
    half = rng.uniform(0.005, 0.012)
    handle = _stick(rng.uniform(0.09, 0.20), half, half * rng.uniform(0.8, 1.3), 0.7)
    return [tub, _level(handle, 0.0, np.array([r - 0.004, 0.0, height * rng.uniform(0.6, 0.95)]))]


def _pot(rng: np.random.Generator) -> list[Mesh]:
    """Return a closed or open pot with a spout, and with a handle behind or over it."""
    r, height = rng.uniform(0.045, 0.085), rng.uniform(0.07, 0.20)
    rim = r * rng.uniform(0.35, 0.95)
    rows = [row(0.0, 0.7 * r), row(0.35 * height, r), row(0.75 * height, 0.9 * r), row(height, rim)]
    if rng.random() < 0.5:
        body = _turned([*rows, row(1.1 * height, 0.3 * rim), row(1.2 * height, 0.2 * rim)])
    else:
        body = vessel(rounded(rows), 0.004, 0.008).mesh
    thin = rng.uniform(0.006, 0.012)
    spout = _stick(rng.uniform(0.6, 1.0) * r, 1.4 * thin, thin)
    spout = _moved(spout, np.array([0.0, rng.uniform(0.5, 1.1), 0.0]), np.zeros(3))
    spout = _moved(spout, np.zeros(3), np.array([0.85 * r, 0.0, rng.uniform(0.3, 0.6) * height]))
    pieces = [body, spout]
    if rng.random() < 0.7:
        ring = _ring(rng.uniform(0.3, 0.45) * height, rng.uniform(0.004, 0.008))
        pieces.append(_moved(ring, np.zeros(3), np.array([-0.95 * r, 0.0, 0.55 * height])))
    return pieces


def _turnery(rng: np.random.Generator) -> list[Mesh]:
    """Return something turned that is widest above: a bulb, candlestick, egg cup, chess piece."""
    height, wide = rng.uniform(0.05, 0.20), rng.uniform(0.015, 0.045)
    knots = int(rng.integers(3, 7))
    radii = wide * rng.uniform(0.25, 1.0, knots)
    radii[-2 if rng.random() < 0.6 else 0] = wide
    radii[: knots // 2] *= rng.uniform(0.35, 1.0)
    heights = height * np.linspace(0.0, 1.0, knots)
    return [_turned([row(z, r) for z, r in zip(heights, radii, strict=True)], 2)]


def _jar(rng: np.random.Generator) -> list[Mesh]:
    """Return a jar, tin or tub with a lid, of round or angular section."""
    height, r = rng.uniform(0.03, 0.20), rng.uniform(0.02, 0.06)
    flat, power = rng.uniform(0.6, 1.0), float(rng.choice([2.0, 2.0, 4.5]))
    lid, start = r * rng.uniform(0.7, 1.1), height * rng.uniform(0.7, 0.95)
    rows = [
        row(0.0, 0.95 * r, 0.95 * flat * r, power), row(0.004, r, flat * r, power),
        row(start - 0.004, r, flat * r, power), row(start, lid, flat * lid, power),
        row(height, lid, flat * lid, power),
    ]  # fmt: skip
    return [_turned(rows)]


def _torch(rng: np.random.Generator) -> list[Mesh]:
    """Return a stick with one thicker end: a torch, brush, whisk, rattle or razor."""
    long, r = rng.uniform(0.10, 0.26), rng.uniform(0.006, 0.018)
    head, share = r * rng.uniform(1.2, 2.6), rng.uniform(0.6, 0.9)
    flat = rng.uniform(0.5, 1.0)
    rows = [
        row(0.0, 0.9 * r), row(0.01, r), row(share * long, r),
        row(min(share + 0.1, 0.97) * long, head, flat * head), row(long, head, flat * head),
    ]  # fmt: skip
    return [_turned(rows)]


def _flatware(rng: np.random.Generator) -> list[Mesh]:
    """Return a spatula, fork, comb, ruler, key or toothbrush: flat, with another end."""
    long, half = rng.uniform(0.12, 0.30), rng.uniform(0.004, 0.011)
    handle = _stick(long, half, half * rng.uniform(0.6, 1.1), rng.uniform(0.3, 0.9))
    wide, tall = rng.uniform(0.010, 0.09), rng.uniform(0.02, 0.10)
    thick = rng.uniform(0.002, 0.015)
    if rng.random() < 0.4:  # tines
        teeth = int(rng.integers(2, 6))
        places = np.linspace(-0.5, 0.5, teeth) * min(wide, 0.03)
        tooth = _block(np.array([0.004, thick, tall]))
        head = [_moved(tooth, np.zeros(3), np.array([x, 0.0, long])) for x in places]
        head.append(_moved(_block(np.array([min(wide, 0.03), thick, 0.02])), np.zeros(3),
                           np.array([0.0, 0.0, long - 0.01])))  # fmt: skip
        return [handle, *head]
    bent = np.array([rng.uniform(-0.3, 0.3), 0.0, 0.0])
    head_block = _block(np.array([wide, thick, tall]), 4.0)
    return [handle, _moved(head_block, bent, np.array([0.0, 0.0, long - 0.005]))]


def _pliers(rng: np.random.Generator) -> list[Mesh]:
    """Return scissors, pliers or tongs: two bars that cross, with or without rings."""
    long, half = rng.uniform(0.11, 0.24), rng.uniform(0.004, 0.010)
    angle, pivot = rng.uniform(0.04, 0.25), rng.uniform(0.45, 0.75)
    rings = rng.random() < 0.6
    pieces = []
    for sign in (-1.0, 1.0):
        bar = _stick(long, half, half * rng.uniform(0.3, 1.0), rng.uniform(0.4, 0.8))
        bar = _moved(bar, np.zeros(3), np.array([0.0, 0.0, -pivot * long]))
        pieces.append(_moved(bar, np.array([0.0, sign * angle, 0.0]), np.zeros(3)))
        if rings:
            radius = rng.uniform(0.012, 0.022)
            place = -(pivot * long + radius) * np.array([sign * np.sin(angle), 0.0, np.cos(angle)])
            place[0] -= sign * 0.7 * radius
            pieces.append(_moved(_ring(radius, 0.6 * half + 0.001), np.zeros(3), place))
    return pieces


def _tube(rng: np.random.Generator) -> list[Mesh]:
    """Return a tube such as toothpaste comes in."""
    long, r = rng.uniform(0.10, 0.20), rng.uniform(0.014, 0.026)
    wide, cap = r * rng.uniform(1.1, 1.5), r * rng.uniform(0.4, 0.9)
    rows = [
        row(0.0, wide, 0.003), row(0.5 * long, 1.1 * r, 0.6 * r), row(0.86 * long, r),
        row(0.88 * long, cap), row(long, cap),
    ]  # fmt: skip
    return [_turned(rows)]


def _device(rng: np.random.Generator) -> list[Mesh]:
    """Return a block with knobs, lenses or a cable's plug: a camera, radio, clock or stapler."""
    size = rng.uniform([0.05, 0.02, 0.02], [0.18, 0.10, 0.12])
    pieces = [_block(size, float(rng.choice([2.5, 4.0, 8.0])))]
    for _ in range(int(rng.integers(1, 4))):
        r = rng.uniform(0.15, 0.45) * min(size[0], size[2])
        knob = _turned([row(0.0, r), row(rng.uniform(0.01, 0.05), r * rng.uniform(0.7, 1.0))])
        spot = rng.uniform(-0.3, 0.3, 2) * size[[0, 2]]
        place = np.array([spot[0], 0.4 * size[1], 0.5 * size[2] + spot[1]])
        if rng.random() < 0.5:
            pieces.append(_level(knob, np.pi / 2.0, place))
        else:
            pieces.append(_moved(knob, np.zeros(3), np.array([spot[0], 0.0, 0.97 * size[2]])))
    return pieces


def _plate(rng: np.random.Generator) -> list[Mesh]:
    """Return a plate, lid, coaster, roll of tape or flat dish."""
    r = rng.uniform(0.03, 0.12)
    height = rng.uniform(0.010, 0.035)
    base = r * rng.uniform(0.5, 0.95)
    return [vessel(rounded([row(0.0, base), row(height, r)]), 0.003, 0.004).mesh]


def _angle(rng: np.random.Generator) -> list[Mesh]:
    """Return a drill, tap, pipe, spray head or iron: two thick limbs at an angle."""
    first, second = rng.uniform(0.08, 0.22), rng.uniform(0.05, 0.18)
    thick, other = rng.uniform(0.012, 0.035, 2)
    limb = _stick(first, thick, thick * rng.uniform(0.7, 1.2), rng.uniform(0.6, 1.2))
    arm = _stick(second, other, other * rng.uniform(0.5, 1.2), rng.uniform(0.6, 1.2))
    start = -second * rng.uniform(0.0, 0.35)
    arm = _moved(arm, np.zeros(3), np.array([0.0, 0.0, start]))
    arm = _moved(arm, np.array([0.0, rng.uniform(1.0, 2.2), 0.0]), np.array([0.0, 0.0, first]))
    return [limb, arm]


def _figure(rng: np.random.Generator) -> list[Mesh]:
    """Return some blobs on each other: a toy, an ornament, a plant, a pile."""
    pieces, top = [], np.zeros(3)
    for _ in range(int(rng.integers(2, 6))):
        r = rng.uniform(0.012, 0.05)
        squeeze = rng.uniform(0.5, 1.5, 2)
        angle = np.linspace(0.15, np.pi - 0.15, 8)
        rows = [
            row(float(r * squeeze[0] * (1 - np.cos(a))), float(r * np.sin(a)),
                float(r * squeeze[1] * np.sin(a)), float(rng.choice([2.0, 4.0])))
            for a in angle
        ]  # fmt: skip
        turn = np.array([*rng.normal(0.0, 0.8, 2), 0.0])
        pieces.append(_moved(loft(rings_of(np.stack(rows), 20)), turn, top.copy()))
        top += rng.uniform([-0.04, -0.04, 0.0], [0.04, 0.04, 0.06])
    return pieces


def _wedge(rng: np.random.Generator) -> list[Mesh]:
    """Return a solid of few flat faces: a wedge of cheese, a stone, a tetra pack, a tent card."""
    size = rng.uniform([0.03, 0.02, 0.02], [0.12, 0.08, 0.16])
    return [convex_hull(rng.uniform(-0.5, 0.5, (int(rng.integers(6, 14)), 3)) * size)]


MAKERS: tuple[Maker, ...] = (
    _pan, _pot, _turnery, _jar, _torch, _torch, _flatware, _flatware, _pliers, _tube, _device,
    _device, _plate, _angle, _figure, _wedge,
)  # fmt: skip
"""Each gives the pieces of another kind of thing."""


def odd_thing(rng: np.random.Generator, name: str) -> ObjectModel:
    """Return a thing of no class."""
    mesh = merge_meshes(MAKERS[rng.integers(len(MAKERS))](rng))
    red, green, blue = (float(value) for value in rng.uniform(0.08, 0.95, 3))
    draft = DesignedObject(
        mesh=mesh,
        parts=(),
        functions=Functions(),
        symmetry=NOTHING,
        mass=0.3,
        friction=0.5,
        color=(red, green, blue),
        upright=bool(rng.random() < 0.6),
    )
    return finish(draft, name, "")
