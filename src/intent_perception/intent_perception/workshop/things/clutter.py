"""Household things of none of the six classes: clutter, and objects that afford no known task."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.families.designed_object import AXIS, NOTHING, Color, DesignedObject
from intent_perception.objects.families.solids import (
    loft,
    loft_parts,
    rings_of,
    rounded,
    row,
    union,
    vessel,
)
from intent_perception.objects.model import Functions, Part, Symmetry

_FLIPPED = Symmetry(
    AXIS.axis, (make_pose(rotation_from_vector([np.pi, 0.0, 0.0]), [0.0, 0.0, 0.0]),)
)
"""Any turn about z, and upside down."""


def _thing(
    pieces: list[tuple[Mesh, list[Part]]],
    mass: float,
    color: Color,
    symmetry: Symmetry = NOTHING,
    rests: int = 12,
) -> DesignedObject:
    return DesignedObject(
        mesh=union([mesh for mesh, _ in pieces]),
        parts=tuple(part for _, parts in pieces for part in parts),
        functions=Functions(),
        symmetry=symmetry,
        mass=mass,
        friction=0.6,
        color=color,
        upright=True,
        rests=rests,
    )


def _solid(rows: list[Array], times: int = 2, segments: int = 48) -> tuple[Mesh, list[Part]]:
    sections = rounded(rows, times)
    return loft(rings_of(sections, segments)), loft_parts("body", rings_of(sections), 0.03)


def _block(x: float, y: float, z: float, edge: float) -> tuple[Mesh, list[Part]]:
    """Return a box standing on z = 0 with edges cut at a distance."""
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    levels = ((0.0, edge), (edge, 0.0), (z - edge, 0.0), (z, edge))
    rings = np.stack(
        [
            np.column_stack([corners * [0.5 * x - cut, 0.5 * y - cut], np.full(4, height)])
            for height, cut in levels
        ]
    )
    return loft(rings), loft_parts("body", rings)


def _placed(
    piece: tuple[Mesh, list[Part]], vector: Array, shift: tuple[float, float, float]
) -> tuple[Mesh, list[Part]]:
    pose = make_pose(rotation_from_vector(vector), shift)
    mesh, parts = piece
    return mesh.transformed(pose), [Part(p.name, p.mesh.transformed(pose)) for p in parts]


def toy_car() -> DesignedObject:
    """Return a toy car: body, cabin and four wheels."""
    body = _solid(
        [
            row(0.010, 0.052, 0.0225, 5.0),
            row(0.014, 0.056, 0.0255, 5.0),
            row(0.028, 0.056, 0.0255, 5.0),
            row(0.034, 0.050, 0.0225, 5.0),
        ],
        1,
    )
    cabin = _solid(
        [
            row(0.032, 0.034, 0.0215, 4.0, -0.006),
            row(0.052, 0.022, 0.0175, 4.0, -0.008),
            row(0.054, 0.018, 0.0150, 4.0, -0.008),
        ],
        1,
    )
    pieces = [body, cabin]
    for x in (-0.034, 0.034):
        for side in (-1.0, 1.0):
            wheel = _solid(
                [row(-0.006, 0.0105), row(-0.004, 0.0125), row(0.004, 0.0125), row(0.006, 0.0105)],
                1,
                32,
            )
            pieces.append(_placed(wheel, np.array([np.pi / 2, 0, 0]), (x, side * 0.0235, 0.0125)))
    return _thing(pieces, 0.12, (0.90, 0.15, 0.15))


def box() -> DesignedObject:
    """Return a carton of tea."""
    return _thing([_block(0.135, 0.068, 0.085, 0.001)], 0.12, (0.25, 0.60, 0.35), _box_turns())


def _box_turns() -> Symmetry:
    vectors = np.eye(3) * np.pi
    return Symmetry(None, tuple(make_pose(rotation_from_vector(v), np.zeros(3)) for v in vectors))


def ball() -> DesignedObject:
    """Return a foam ball."""
    radius = 0.034
    rows = [
        row(radius * (1 - np.cos(a)), radius * np.sin(a))
        for a in np.linspace(0.06, np.pi - 0.06, 25)
    ]
    return _thing([_solid(rows, 0)], 0.06, (0.95, 0.75, 0.20), AXIS, rests=1)


def bowl() -> DesignedObject:
    """Return a cereal bowl."""
    profile = [
        (0.0, 0.032),
        (0.004, 0.034),
        (0.007, 0.034),
        (0.020, 0.055),
        (0.040, 0.069),
        (0.062, 0.075),
    ]
    made = vessel(rounded([row(z, r) for z, r in profile]), 0.004, 0.010)
    return _thing([(made.mesh, list(made.parts))], 0.32, (0.55, 0.65, 0.85), AXIS)


def can() -> DesignedObject:
    """Return a tin with a rim at both ends."""
    profile = [
        (0.0, 0.0355),
        (0.002, 0.0365),
        (0.003, 0.0350),
        (0.098, 0.0350),
        (0.099, 0.0365),
        (0.101, 0.0355),
    ]
    return _thing([_solid([row(z, r) for z, r in profile], 1)], 0.39, (0.75, 0.30, 0.15), _FLIPPED)


def book() -> DesignedObject:
    """Return a paperback: spine at -x, cover wider than the pages."""
    cover = _block(0.128, 0.192, 0.002, 0.0002)
    top = _placed(_block(0.128, 0.192, 0.002, 0.0002), np.zeros(3), (0.0, 0.0, 0.023))
    pages = _placed(_block(0.124, 0.187, 0.0225, 0.0002), np.zeros(3), (-0.001, 0.0, 0.001))
    spine = _placed(_block(0.002, 0.192, 0.025, 0.0002), np.zeros(3), (-0.063, 0.0, 0.0005))
    return _thing([cover, top, pages, spine], 0.33, (0.30, 0.25, 0.55))


def spoon() -> DesignedObject:
    """Return a wooden cooking spoon that lies on its back."""
    handle = _solid(
        [
            row(0.0, 0.0045, 0.0045),
            row(0.004, 0.0060, 0.0060),
            row(0.150, 0.0050, 0.0050),
            row(0.215, 0.0058, 0.0050),
        ],
        1,
    )
    oval = vessel(
        rounded(
            [
                row(0.0, 0.010, 0.007),
                row(0.003, 0.022, 0.015),
                row(0.009, 0.030, 0.0205),
                row(0.013, 0.031, 0.0215),
            ]
        ),
        0.0035,
        0.005,
    )
    lying = _placed(handle, np.array([0.0, np.pi / 2, 0.0]), (0.027, 0.0, 0.0085))
    return _thing([(oval.mesh, list(oval.parts)), lying], 0.045, (0.70, 0.50, 0.30))


def plate() -> DesignedObject:
    """Return a dessert plate."""
    profile = [(0.0, 0.052), (0.002, 0.054), (0.006, 0.062), (0.013, 0.080), (0.019, 0.096)]
    made = vessel(rounded([row(z, r) for z, r in profile]), 0.0065, 0.004)
    return _thing([(made.mesh, list(made.parts))], 0.36, (0.93, 0.93, 0.88), AXIS)


def banana() -> DesignedObject:
    """Return a banana lying on its side."""
    angle = np.linspace(-0.62, 0.62, 15)
    share = np.linspace(-1.0, 1.0, 15)
    radius = 0.0175 * np.clip(1.0 - np.abs(share) ** 3.2, 0.18, 1.0)
    centers = np.stack(
        [0.155 * np.sin(angle), 0.155 * (1 - np.cos(angle)), 0.0175 + 0.0 * angle], 1
    )
    rings = []
    for center, tilt, r in zip(centers, angle, radius, strict=True):
        flat = rings_of(np.stack([row(0.0, r, r, 2.4)]), 32)[0]
        turned = (
            flat
            @ np.array(
                [[0, -np.sin(tilt), np.cos(tilt)], [0, np.cos(tilt), np.sin(tilt)], [-1, 0, 0]]
            ).T
        )
        rings.append(turned + center)
    piece = loft(np.stack(rings)), loft_parts("body", np.stack(rings)[:, ::2], 0.05)
    return _thing([piece], 0.12, (0.95, 0.85, 0.25))


def remote_control() -> DesignedObject:
    """Return a television remote with a raised pad."""
    body = _solid(
        [
            row(0.0, 0.020, 0.078, 6.0),
            row(0.004, 0.0235, 0.084, 6.0),
            row(0.014, 0.0235, 0.084, 6.0),
            row(0.018, 0.0215, 0.081, 6.0),
        ],
        1,
    )
    pad = _placed(
        _solid([row(0.016, 0.0120, 0.0120), row(0.021, 0.0110, 0.0110)], 0),
        np.zeros(3),
        (0, 0.040, 0),
    )
    return _thing([body, pad], 0.11, (0.24, 0.26, 0.32))


def tape_roll() -> DesignedObject:
    """Return a roll of packing tape."""
    angle = np.arange(24) * (2 * np.pi / 24)
    outer, inner, height = 0.050, 0.038, 0.046
    profile = np.array([[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]])
    ring = np.stack(
        [
            np.stack([r * np.cos(a), r * np.sin(a), z])
            for a in np.arange(64) * (2 * np.pi / 64)
            for r, z in profile
        ]
    ).reshape(64, 4, 3)
    here, after = np.arange(64)[:, None], (np.arange(64)[:, None] + 1) % 64
    side, next_side = np.arange(4)[None], (np.arange(4)[None] + 1) % 4
    a, b, c, d = here * 4 + side, after * 4 + side, after * 4 + next_side, here * 4 + next_side
    faces = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    parts = []
    for k in range(24):
        wedge = [
            [r * np.cos(t), r * np.sin(t), z]
            for t in (angle[k], angle[k] + 2 * np.pi / 24)
            for r, z in profile
        ]
        parts += loft_parts("body", np.array(wedge).reshape(2, 4, 3), 0.1)
    return _thing(
        [(Mesh.of(ring.reshape(-1, 3), faces), parts)], 0.21, (0.72, 0.58, 0.40), _FLIPPED
    )


def sponge() -> DesignedObject:
    """Return a dish sponge with a wavy long side."""
    body = _solid(
        [
            row(0.0, 0.043, 0.030, 6.0),
            row(0.002, 0.045, 0.032, 6.0),
            row(0.026, 0.045, 0.032, 6.0),
            row(0.028, 0.043, 0.030, 6.0),
        ],
        1,
    )
    return _thing([body], 0.02, (0.95, 0.90, 0.30), _box_turns())


CLUTTER_MAKERS = (
    toy_car,
    box,
    ball,
    bowl,
    can,
    book,
    spoon,
    plate,
    banana,
    remote_control,
    tape_roll,
    sponge,
)
