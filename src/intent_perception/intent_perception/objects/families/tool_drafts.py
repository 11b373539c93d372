"""Drafts of knives, hammers and screwdrivers: z from the handle to the end that does the work."""

from collections.abc import Callable

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
    Piece,
    along_x,
    loft,
    loft_parts,
    parts_of_pieces,
    rod,
    row,
    union,
)
from intent_perception.objects.model import Edge, Face, Functions, Part, Symmetry

Outline = Callable[[Array], Array]
"""x of an outline for shares 0..1 of its length [m]."""


def blade_piece(spine: Array, edge: Array, heights: Array, thickness: float) -> Piece:
    """Return a wedge-shaped blade between the outlines of spine and edge, (K,) x each."""
    flat = edge + 0.45 * (spine - edge)
    full = 0.5 * thickness * np.clip((spine - edge) / 0.012, 0.35, 1.0)
    fine = np.full_like(full, 0.0002)
    xs = np.stack([spine, flat, edge, edge, flat, spine], axis=1)
    ys = np.stack([full, 0.9 * full, fine, -fine, -0.9 * full, -full], axis=1)
    rings = np.stack([xs, ys, np.repeat(heights[:, None], 6, axis=1)], axis=2)
    return loft(rings), lambda: loft_parts("blade", rings, 0.04)


def knife_draft(
    grip: list[Array],
    start: float,
    length: float,
    spine: Outline,
    edge: Outline,
    thickness: float,
    bolster: tuple[float, float, float] | None,
    mass: float,
    color: Color,
    join: Join = union,
) -> DesignedObject:
    """Return a knife.

    Args:
        grip: cross-sections of the handle.
        start: height at which the blade leaves the handle [m].
        length: length of the blade [m].
        spine: x of the spine for shares 0..1 of the length [m].
        edge: x of the edge for the same shares [m].
        thickness: thickness of the spine [m].
        bolster: half height, half thickness, length of the metal collar [m], or none.
        mass: mass [kg].
        color: RGB.
        join: makes one mesh of the pieces.
    """
    share = np.linspace(0.0, 1.0, 33) ** 0.9
    heights = start + length * share
    # The tang: the blade's root reaches into the handle.
    inner = np.concatenate([[start - 0.012], heights])
    spine_x, edge_x = spine(share), edge(share)
    root = min(0.6 * float(grip[-1][3]), 0.008)
    center = float(grip[-1][1])
    tang_spine = np.concatenate([[min(float(spine_x[0]), center + root)], spine_x])
    tang_edge = np.concatenate([[max(float(edge_x[0]), center - root)], edge_x])
    pieces = [rod("handle", grip), blade_piece(tang_spine, tang_edge, inner, thickness)]
    if bolster is not None:
        half, side, long = bolster
        low = start - long * 0.6
        rows = [
            row(low, half, side, 3.0, center),
            row(low + long, 0.92 * half, 0.6 * side, 3.0, center),
        ]
        pieces.append(rod("bolster", rows, 0))
    return DesignedObject(
        mesh=join([mesh for mesh, _ in pieces]),
        parts=parts_of_pieces(pieces),
        functions=Functions(
            edge=Edge(
                np.array([edge_x[0], 0.0, heights[0]]),
                np.array([edge_x[-1], 0.0, heights[-1]]),
                np.array([-1.0, 0.0, 0.0]),
            ),
            tip=np.array([0.5 * (spine_x[-1] + edge_x[-1]), 0.0, heights[-1]]),
            handle=("handle",),
            functional=("blade",),
        ),
        symmetry=NOTHING,
        mass=mass,
        friction=0.6,
        color=color,
        upright=False,
    )


def hammer_head(sections: list[Array], z: float, times: int = 2) -> Piece:
    """Return a piece of a head along x at a height z; rows: (x, half height, half width)."""
    mesh, parts = rod("head", sections, times)
    return along_x(mesh, z), lambda: [Part(part.name, along_x(part.mesh, z)) for part in parts()]


def hammer_draft(
    grip: list[Array],
    head: list[Piece],
    face: tuple[float, float],
    mass: float,
    color: Color,
    symmetry: Symmetry = NOTHING,
    power: int = 2,
    join: Join = union,
) -> DesignedObject:
    """Return a hammer whose face is at x, z = face."""
    pieces = [rod("handle", grip, power), *head]
    return DesignedObject(
        mesh=join([mesh for mesh, _ in pieces]),
        parts=parts_of_pieces(pieces),
        functions=Functions(
            face=Face(np.array([face[0], 0.0, face[1]]), np.array([1.0, 0.0, 0.0])),
            handle=("handle",),
            functional=("head",),
        ),
        symmetry=symmetry,
        mass=mass,
        friction=0.6,
        color=color,
        upright=False,
    )


def screwdriver_draft(
    grip: list[Array],
    start: float,
    length: float,
    radius: float,
    tip: str,
    mass: float,
    color: Color,
    symmetry: Symmetry = AXIS,
    square: bool = False,
    times: int = 2,
    extra: list[Piece] | None = None,
    lobes: int = 6,
    join: Join = union,
) -> DesignedObject:
    """Return a screwdriver whose shaft leaves the handle at a height.

    Args:
        grip: cross-sections of the handle.
        start: height at which the shaft leaves the handle [m].
        length: length of shaft and tip [m].
        radius: radius of the shaft [m].
        tip: "flat" or "cross".
        mass: mass [kg].
        color: RGB.
        symmetry: seen from the handle; the tip is too small to be seen.
        square: whether the shaft is square.
        times: roundings of the handle.
        extra: more pieces of the handle.
        lobes: grooves around the handle.
        join: makes one mesh of the pieces.
    """
    end = start + length
    point = max(0.012, 3.0 * radius)
    power = 5.0 if square else 2.0
    shaft = [row(start - 0.015, radius, radius, power), row(end - point, radius, radius, power)]
    if tip == "flat":
        work = [
            row(end - point - 0.001, radius, radius, power),
            row(end - 0.5 * point, 1.15 * radius, 0.45 * radius, 3.0),
            row(end, 1.15 * radius, 0.0005, 5.0),
        ]
    else:
        work = [
            row(end - point - 0.001, radius, radius, power),
            row(end - 0.7 * point, 0.95 * radius, flute=0.25 * radius),
            row(end - 0.15 * point, 0.55 * radius, flute=0.2 * radius),
            row(end, 0.25 * radius, flute=0.05 * radius),
        ]
    pieces = [rod("handle", grip, times, lobes), *(extra or [])]
    pieces += [rod("shaft", shaft, 0), rod("tip", work, 0, 4)]
    return DesignedObject(
        mesh=join([mesh for mesh, _ in pieces]),
        parts=parts_of_pieces(pieces),
        functions=Functions(
            tip=np.array([0.0, 0.0, end]), handle=("handle",), functional=("shaft", "tip")
        ),
        symmetry=symmetry,
        mass=mass,
        friction=0.6,
        color=color,
        upright=False,
    )
