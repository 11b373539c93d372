"""Drafts of bottles, glasses and mugs from their outlines: z up, standing on z = 0."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.objects.families.designed_object import (
    AXIS,
    NOTHING,
    Color,
    DesignedObject,
)
from intent_perception.objects.families.solids import (
    Join,
    loft,
    loft_parts,
    rings_of,
    rounded,
    sweep,
    union,
    vessel,
)
from intent_perception.objects.model import Functions, Opening, Part, Symmetry

_UP = np.array([0.0, 0.0, 1.0])


def _opening(height: float, radius: float) -> Opening:
    return Opening(np.array([0.0, 0.0, height]), _UP, radius)


def bottle_draft(
    rows: list[Array],
    neck_from: float,
    shoulder_from: float,
    mass: float,
    color: Color,
    symmetry: Symmetry = AXIS,
) -> DesignedObject:
    """Return a closed bottle; parts above a height are shoulder and neck."""
    sections = rounded(rows)
    top = sections[-1]

    def parts() -> tuple[Part, ...]:
        coarse = rings_of(sections, 24)
        cuts = [0, *np.searchsorted(sections[:, 0], [shoulder_from, neck_from]), len(coarse) - 1]
        made: list[Part] = []
        for name, low, high in zip(("body", "shoulder", "neck"), cuts[:-1], cuts[1:], strict=True):
            made += loft_parts(name, coarse[int(low) : int(high) + 1])
        return tuple(made)

    return DesignedObject(
        mesh=loft(rings_of(sections)),
        parts=parts,
        functions=Functions(
            opening=_opening(float(top[0]), float(top[3]) - 0.002),
            functional=("neck",),
        ),
        symmetry=symmetry,
        mass=mass,
        friction=0.6,
        color=color,
        upright=True,
    )


def glass_draft(
    rows: list[Array],
    wall: float,
    floor: float,
    mass: float,
    color: Color,
    times: int = 2,
    symmetry: Symmetry = AXIS,
    lobes: int = 6,
) -> DesignedObject:
    """Return an open glass with a wall and a floor of these thicknesses [m]."""
    sections = rounded(rows, times)
    made = vessel(sections, wall, floor, lobes)
    return DesignedObject(
        mesh=made.mesh,
        parts=lambda: made.parts,
        functions=Functions(opening=_opening(float(sections[-1, 0]), made.radius)),
        symmetry=symmetry,
        mass=mass,
        friction=0.5,
        color=color,
        upright=True,
    )


def mug_draft(
    rows: list[Array],
    wall: float,
    mass: float,
    color: Color,
    low: float,
    high: float,
    reach: float,
    thickness: float,
    width: float,
    bend: float = 0.7,
    times: int = 2,
    join: Join = union,
) -> DesignedObject:
    """Return a mug with a handle at +x.

    Args:
        rows: outside of the body.
        wall: thickness of the wall [m].
        mass: mass [kg].
        color: RGB.
        low: height of the handle's lower end [m].
        high: height of the handle's upper end [m].
        reach: distance from the wall to the middle of the handle [m].
        thickness: half thickness of the handle, seen from the side [m].
        width: half width of the handle [m].
        bend: 1 = half ellipse; less = squarer.
        times: roundings of the outline.
        join: makes one mesh of body and handle.
    """
    sections = rounded(rows, times)
    body = vessel(sections, wall, 0.006)
    outline = _handle_path(sections, wall, (low, high), reach, bend)
    rings = sweep(outline, thickness, width)

    def parts() -> tuple[Part, ...]:
        made = list(body.parts)
        for start in range(0, len(rings) - 1, 4):
            made += loft_parts("handle", rings[start : start + 5, ::2], 0.2)
        return tuple(made)

    return DesignedObject(
        mesh=join([body.mesh, loft(rings)]),
        parts=parts,
        functions=Functions(
            opening=_opening(float(sections[-1, 0]), body.radius), handle=("handle",)
        ),
        symmetry=NOTHING,
        mass=mass,
        friction=0.6,
        color=color,
        upright=True,
    )


def _handle_path(
    sections: Array, wall: float, ends: tuple[float, float], reach: float, bend: float
) -> Array:
    """Return the middle line (K, 2) of a handle, its ends half way into the wall."""
    low, high = ends
    angle = np.linspace(-np.pi / 2, np.pi / 2, 33)
    z = 0.5 * (low + high) + 0.5 * (high - low) * np.sign(np.sin(angle)) * (
        np.abs(np.sin(angle)) ** bend
    )
    root = np.interp(z, sections[:, 0], sections[:, 3])
    # Between the ends the handle keeps its distance from the widest part that it passes.
    widest = root[[0, -1]].max()
    share = np.abs(np.cos(angle)) ** bend
    straight = np.interp(z, [low, high], root[[0, -1]] - 0.55 * wall)
    x = straight + share * (widest + reach - straight)
    return np.stack([x, z], axis=1)
