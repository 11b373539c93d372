"""Bottles, glasses, mugs and round things from a body around an axis."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from intent_perception.basics.arrays import Array, Mask
from intent_perception.geometry.mesh import merge_meshes
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.families.designed_object import AXIS, NOTHING, DesignedObject
from intent_perception.objects.families.solids import (
    loft,
    loft_parts,
    rings_of,
    rounded,
    row,
    simplified,
)
from intent_perception.objects.families.vessel_drafts import bottle_draft, glass_draft, mug_draft
from intent_perception.objects.model import Functions
from intent_perception.recognition.estimation.estimated_parts import Draft, color_of
from intent_perception.recognition.estimation.outlines import Outline, turned_round
from intent_perception.recognition.estimation.revolution import Revolution
from intent_perception.recognition.estimation.things import SeenThing

_WALL = {"glass": 0.0028, "mug": 0.0042, "": 0.0045}
"""Usual thickness of a wall, which is hardly ever seen [m]."""
_FLOOR = 0.009
_THIN = 0.38  # a stem is thinner than this share of the widest
_ROUND = 2.05
_KNOTS = 18
_STRAIGHT = 0.0006  # outlines this near to straight are [m]
_HANDLE_THICK = 0.0045
_HANDLE_WIDE = 0.0075
_LEVEL = 0.85  # cosine between the axis and the normal of an inside bottom
_ENOUGH = 15
_OPEN_SHARE = 0.25  # from this depth on, as a share of the height, a thing is hollow


def standing_vessel(thing: SeenThing, outline: Outline, object_class: str) -> Draft | None:
    """Return the vessel of a class that stands there, None where no body fits."""
    body = outline.standing
    if body is None or not body.is_told(thing.points):
        return None
    top = thing.height
    rows = _rows(body, 0.0, top)
    T_table_draft = make_pose(body.axes.T, [*body.point[:2], 0.0])
    if object_class == "mug":
        return _mug(thing, outline, body, rows, T_table_draft)
    made = _round_thing(thing, body, rows, object_class, _hollow(thing, body))
    return Draft(made, T_table_draft)


def lying_vessel(thing: SeenThing, outline: Outline, object_class: str) -> Draft | None:
    """Return the vessel of a class that lies there, None where no body fits."""
    body = outline.lying
    if body is None or not body.is_told(thing.points):
        return None
    inside = ~body.outer & (body.gaps < -0.004)
    along = body.places(thing.points)[:, 2]
    low, high = (float(q) for q in np.quantile(along, [0.005, 0.995]))
    hollow = bool(inside.mean() > 0.02)
    if object_class in ("glass", "mug", "") and _opens_backwards(body, along, inside, object_class):
        body = turned_round(body)
        low, high = -high, -low
    sections = np.stack(_rows(body, low, high))
    sections[:, 0] -= low
    kind = "glass" if object_class == "mug" else object_class
    made = _round_thing(thing, body, list(sections), kind, hollow or kind == "glass")
    point = body.point + low * body.axes[2]
    return Draft(made, make_pose(body.axes.T, point))


def _opens_backwards(body: Revolution, along: Array, inside: Mask, object_class: str) -> bool:
    """Return whether the end at which an axis begins is the open one."""
    middle = 0.5 * (body.heights[0] + body.heights[-1])
    if inside.mean() > 0.02:
        return bool(np.median(along[inside]) < middle)
    return object_class != ""  # the thick end comes first, and glasses are wide at the rim


def _hollow(thing: SeenThing, body: Revolution) -> bool:
    """Return whether one looks into a standing body from above."""
    places = body.places(thing.points)
    rim = float(body.radius_at(np.array([0.96 * thing.height]))[0])
    within = np.hypot(places[:, 0], places[:, 1] / body.aspect) < 0.85 * rim
    if within.sum() < 12:
        return False
    drop = (thing.height - places[within, 2]) / thing.height
    return bool(np.quantile(drop, 0.6) > _OPEN_SHARE)


def _rows(body: Revolution, low: float, high: float) -> list[Array]:
    """Return cross-sections (7,) of a body from one height to another [m].

    Below what the segmentation leaves of it a body goes on as it is.
    """
    radii = median_filter(body.radii, 3, mode="nearest")
    radii = gaussian_filter1d(radii, 0.7, mode="nearest")
    heights = body.heights
    knots = np.concatenate([[low, low + 0.004], np.linspace(low, high, _KNOTS)[1:-1], [high]])
    widths = np.maximum(np.interp(knots, heights, radii), 0.0025)
    widths[0] *= 0.96
    rows = np.stack(
        [
            row(float(z), float(r), float(r * body.aspect), body.power)
            for z, r in zip(knots, widths, strict=True)
        ]
    )
    return list(simplified(rows, _STRAIGHT))


def _round_thing(
    thing: SeenThing, body: Revolution, rows: list[Array], object_class: str, hollow: bool
) -> DesignedObject:
    """Return a bottle, a glass, or a can or bowl of no class."""
    widths = np.array([r[3] for r in rows])
    heights = np.array([r[0] for r in rows])
    symmetric = abs(body.aspect - 1.0) < 0.02 and body.power < _ROUND
    symmetry = AXIS if symmetric else NOTHING
    color = color_of(thing)
    if object_class == "bottle":
        shoulder, neck = _neck(heights, widths)
        return bottle_draft(rows, neck, shoulder, 0.4, color, symmetry)
    if object_class == "glass" or hollow:
        floor, wall = _inside(thing, body, heights, widths, _WALL[object_class])
        return glass_draft(rows, wall, floor, 0.25, color, 1, symmetry)
    sections = rounded(rows, 1)
    rings = rings_of(sections, 32)
    return DesignedObject(
        mesh=loft(rings),
        parts=lambda: tuple(loft_parts("body", rings_of(sections, 24), 0.03)),
        functions=Functions(),
        symmetry=symmetry,
        mass=0.3,
        friction=0.5,
        color=color,
        upright=True,
    )


def _neck(heights: Array, widths: Array) -> tuple[float, float]:
    """Return where the shoulder and where the neck of a bottle begin [m]."""
    widest, top = float(widths.max()), float(np.median(widths[-4:]))
    above = np.flatnonzero(widths > 0.92 * widest)[-1]
    shoulder = float(heights[min(above, len(heights) - 4)])
    narrow = np.flatnonzero((widths < 1.3 * top) & (heights > shoulder + 0.004))
    neck = float(heights[narrow[0]]) if len(narrow) else float(heights[-3])
    neck = min(max(neck, shoulder + 0.006), float(heights[-1]) - 0.004)
    return min(shoulder, neck - 0.004), neck


def _inside(
    thing: SeenThing, body: Revolution, heights: Array, widths: Array, usual: float
) -> tuple[float, float]:
    """Return the height of a hollow thing's inside bottom and the thickness of its wall [m].

    Both from what is seen of the inside, else as is usual: above the stem, if there is one.
    """
    thin = np.flatnonzero((widths < _THIN * widths.max()) & (heights < 0.8 * heights[-1]))
    floor = float(heights[thin[-1]]) + 0.012 if len(thin) else _FLOOR
    places = body.places(thing.points)
    places[:, 2] += heights[-1] - float(np.quantile(places[:, 2], 0.995))
    inwards = np.einsum("ij,ij->i", thing.normals @ body.axes[:2].T, places[:, :2]) < 0.0
    level = thing.normals @ body.axes[2] > _LEVEL
    gap = -body.gaps
    low = level & (gap > 2.0 * usual) & (places[:, 2] < 0.7 * heights[-1])
    if low.sum() > _ENOUGH:
        floor = float(np.median(places[low, 2]))
    steep = inwards & ~level & (gap > 0.0) & (places[:, 2] < 0.95 * heights[-1])
    wall = float(np.median(gap[steep])) if steep.sum() > _ENOUGH else usual
    wall = float(np.clip(wall, 0.5 * usual, min(3.0 * usual, 0.25 * float(widths[-1]))))
    return float(np.clip(floor, 0.003, 0.85 * heights[-1])), wall


def _mug(
    thing: SeenThing, outline: Outline, body: Revolution, rows: list[Array], T_table_draft: Array
) -> Draft | None:
    """Return a mug, its handle at +x; None where no handle is seen."""
    handle = outline.handle
    if handle.sum() < 6:
        return None
    places = body.places(thing.points)[handle]
    angle = float(np.arctan2(np.median(places[:, 1]), np.median(places[:, 0])))
    top = thing.height
    low, high = (float(q) for q in np.quantile(places[:, 2], [0.03, 0.97]))
    low, high = max(low + _HANDLE_THICK, 0.1 * top), min(high - _HANDLE_THICK, 0.93 * top)
    if high - low < 0.02:
        middle = float(np.clip(0.5 * (low + high), 0.3 * top, 0.75 * top))
        low, high = middle - 0.25 * top, middle + 0.25 * top
    reach = float(np.quantile(body.gaps[handle], 0.97)) - _HANDLE_THICK
    reach = float(np.clip(reach, 0.012, 0.06))
    spun = make_pose(
        np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        ),
        np.zeros(3),
    )
    made = mug_draft(
        rows, _WALL["mug"], 0.33, color_of(thing), max(low, 0.01), high, reach,
        _HANDLE_THICK, _HANDLE_WIDE, 0.7, times=1, join=merge_meshes,
    )  # fmt: skip
    return Draft(made, T_table_draft @ spun)
