"""Knives, hammers and screwdrivers from the outline of something long that lies on the table."""

from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import merge_meshes
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.families.solids import grip_rows, row
from intent_perception.objects.families.tool_drafts import (
    hammer_draft,
    hammer_head,
    knife_draft,
    screwdriver_draft,
)
from intent_perception.recognition.estimation.estimated_parts import Draft, color_of
from intent_perception.recognition.estimation.outlines import SIDES, TOP, Outline, long_frame
from intent_perception.recognition.estimation.revolution import slice_quantiles
from intent_perception.recognition.estimation.things import SeenThing

_UP = np.array([0.0, 0.0, 1.0])
_STEPS = 16
_ROUND = 0.6  # from this share of its points on a round body fits a screwdriver
_LOW = 0.0055  # what lies flatter is hardly seen in depth [m]
_BLADE = 0.0022  # usual thickness [m]


@dataclass(frozen=True, eq=False)
class _Strip:
    """A long thing in steps along its axis."""

    along: Array
    """(3,) unit, level."""
    across: Array
    """(3,) unit, level."""
    middle: Array
    """(3,) on the table [m]."""
    places: Array
    """(K,) of the steps along the axis from the middle [m]."""
    low: Array
    """(K,) edge on the side of -across [m]."""
    high: Array
    """(K,) edge on the side of across [m]."""
    tall: Array
    """(K,) height above the table [m]."""

    @property
    def wide(self) -> Array:
        """(K,) width [m]."""
        return self.high - self.low

    @property
    def length(self) -> float:
        """From end to end [m]."""
        step = float(self.places[1] - self.places[0])
        return float(self.places[-1] - self.places[0]) + step

    def turned(self) -> "_Strip":
        """Return the strip with its axis the other way."""
        return _Strip(
            -self.along, -self.across, self.middle, -self.places[::-1],
            -self.high[::-1], -self.low[::-1], self.tall[::-1],
        )  # fmt: skip

    def pose(self, height: float, shift: float, pitch: float = 0.0, raised: bool = False) -> Array:
        """Return the pose (4, 4) of a tool's frame: z along the axis, x across, y up or down.

        Args:
            height: of the axis above the table at the frame's origin [m].
            shift: of the axis across [m].
            pitch: how far the axis points upwards [rad].
            raised: whether x points up instead.
        """
        z = np.cos(pitch) * self.along + np.sin(pitch) * _UP
        x = np.cos(pitch) * _UP - np.sin(pitch) * self.along if raised else self.across
        start = self.places[0] - 0.5 * (self.places[1] - self.places[0])
        origin = self.middle + start * self.along + shift * self.across + height * _UP
        return make_pose(np.stack([x, np.cross(z, x), z], axis=1), origin)


def _strip(thing: SeenThing, outline: Outline) -> _Strip | None:
    points = np.concatenate([thing.points, thing.flat])
    axes = outline.long_axes
    flat = (points - outline.long_point) @ axes.T
    first, last = np.quantile(flat[:, 0], [0.004, 0.996])
    if last - first < 0.05:
        return None
    step = (last - first) / _STEPS
    index = np.clip(((flat[:, 0] - first) / step).astype(np.int64), 0, _STEPS - 1)
    sides = slice_quantiles(flat[:, 1].copy(), index, _STEPS, SIDES, 3)
    edges = np.hstack([sides, slice_quantiles(points[:, 2].copy(), index, _STEPS, TOP, 3)])
    known = np.isfinite(edges[:, 0])
    if known.sum() < 6:
        return None
    steps = np.arange(_STEPS)
    low, high, tall = (np.interp(steps, steps[known], column[known]) for column in edges.T)
    places = first + (steps + 0.5) * step
    return _Strip(axes[0], axes[1], outline.long_point, places, low, high, tall)


def knife(thing: SeenThing, outline: Outline) -> Draft | None:
    """Return the knife that lies there, None where it is none."""
    strip = _strip(thing, outline)
    if strip is None:
        return None
    half = _STEPS // 2
    # The blade is the flat end.
    if strip.tall[:half].mean() < strip.tall[half:].mean():
        strip = strip.turned()
    boundary = _boundary(strip.tall)
    grip_low = float(np.median(strip.low[:boundary]))
    grip_high = float(np.median(strip.high[:boundary]))
    center = 0.5 * (grip_low + grip_high)
    # The edge is on the side on which the blade stands out further from the handle.
    out_high = float(np.max(strip.high[boundary:]) - grip_high)
    out_low = float(grip_low - np.min(strip.low[boundary:]))
    if out_high > out_low:
        strip = _mirrored(strip)
        center = -center
    step = strip.length / _STEPS
    start = boundary * step
    thick = float(np.clip(np.median(strip.tall[:boundary]), 0.006, 0.030))
    halves = np.clip(0.5 * strip.wide[:boundary], 0.005, 0.025)
    sizes: list[tuple[float, ...]] = [(0.0, 0.9 * float(halves[0]), 0.42 * thick)]
    sizes += [(float((k + 0.5) * step), float(h), 0.5 * thick) for k, h in enumerate(halves)]
    grip = grip_rows([*sizes, (start, float(halves[-1]), 0.45 * thick)])
    spine = np.append(strip.high[boundary:], strip.high[-1]) - center
    edge = np.append(strip.low[boundary:], 0.5 * (strip.high[-1] + strip.low[-1])) - center
    edge = np.minimum(edge, spine - 0.002)
    shares = np.concatenate([(np.arange(_STEPS - boundary) + 0.5) / (_STEPS - boundary), [1.0]])
    made = knife_draft(
        grip, start, strip.length - start,
        lambda share: np.interp(share, shares, spine), lambda share: np.interp(share, shares, edge),
        _BLADE, None, 0.15, color_of(thing), join=merge_meshes,
    )  # fmt: skip
    return Draft(made, strip.pose(0.5 * thick, center))


def _mirrored(strip: _Strip) -> _Strip:
    """Return the strip with across the other way: the frame's y points down instead of up."""
    return _Strip(
        strip.along, -strip.across, strip.middle, strip.places, -strip.high, -strip.low, strip.tall
    )


def _boundary(tall: Array) -> int:
    """Return the step at which a handle ends and a blade begins."""
    handle = float(np.quantile(tall, 0.8))
    flat = np.flatnonzero(tall < max(0.55 * handle, _LOW))
    ends = [int(k) for k in flat if k >= 3]
    boundary = ends[0] if ends else int(0.42 * _STEPS)
    return int(np.clip(boundary, 4, _STEPS - 4))


def hammer(thing: SeenThing, outline: Outline) -> Draft | None:
    """Return the hammer that lies there, its head at the wide end; None where it is none."""
    strip = _strip(thing, outline)
    if strip is None:
        return None
    first = _head_start(strip)
    strip = _along_handle(thing, outline, strip, first) or strip
    first = _head_start(strip)
    step = strip.length / _STEPS
    start = strip.places[0] - 0.5 * step
    flat = (thing.points - strip.middle) @ np.stack([strip.along, strip.across, _UP]).T
    head = flat[flat[:, 0] > strip.places[first] - 0.5 * step]
    if len(head) < 10:
        return None
    center = float(np.median(0.5 * (strip.low + strip.high)[1:first]))
    half = 0.5 * float(np.ptp(np.quantile(head[:, 0], [0.02, 0.995])))
    half = float(np.clip(half, 0.008, 0.032))
    z = float(np.quantile(head[:, 0], 0.995)) - start - half
    thick = 0.5 * float(np.median(strip.wide[1:first]))
    places = strip.places[1:first] - start
    slope, base = np.polyfit(places, strip.tall[1:first] - 0.8 * thick, 1)
    pitch = float(np.clip(np.arctan(slope), -0.4, 0.4))
    across, tall = head[:, 1] - center, head[:, 2]
    wide = float(np.ptp(np.quantile(across, [0.02, 0.98])))
    top = float(np.quantile(tall, 0.97))
    raised = top > 1.25 * wide  # the head stands on one of its ends
    if raised:
        reach = -(base + slope * z), top - (base + slope * z)
        side = 0.5 * wide
    else:
        reach = float(np.quantile(across, 0.01)), float(np.quantile(across, 0.99))
        side = 0.5 * top
        if _thicker(head, center) < 0.0:  # the face is at the thick end
            strip, center, reach = _mirrored(strip), -center, (-reach[1], -reach[0])
    widths = np.clip(0.5 * strip.wide[:first], 0.006, 0.022)
    flatness = [0.85 * float(w) for w in widths]
    sizes = [(0.0, 0.9 * float(widths[0]), 0.9 * flatness[0])]
    sizes += [
        (float((k + 0.5) * step), float(w), t)
        for k, (w, t) in enumerate(zip(widths, flatness, strict=True))
    ]
    grip = grip_rows([*sizes, (z + 0.6 * half, float(widths[-1]), flatness[-1])])
    front = max(reach[1], 0.015)
    rows = [
        row(min(reach[0], -0.015), 0.9 * half, max(side, 0.007), 3.0),
        row(0.0, half, max(side, 0.007), 3.0),
        row(front, half, max(side, 0.007), 3.0),
    ]
    made = hammer_draft(
        grip, [hammer_head(rows, z, 1)], (front, z), 0.5, color_of(thing), join=merge_meshes
    )
    return Draft(made, strip.pose(max(float(base), 0.5 * thick), center, pitch, raised))


def _head_start(strip: _Strip) -> int:
    """Return the step at which a hammer's head begins."""
    handle = float(np.median(strip.wide[2 : _STEPS // 2]))
    low = float(np.median(strip.tall[2 : _STEPS // 2]))
    large = (strip.wide > max(1.5 * handle, handle + 0.012)) | (strip.tall > low + 0.018)
    found = np.flatnonzero(large)
    found = found[found >= _STEPS // 2]
    return int(np.clip(found[0] if len(found) else _STEPS - 2, 4, _STEPS - 1))


def _along_handle(thing: SeenThing, outline: Outline, strip: _Strip, first: int) -> _Strip | None:
    """Return the strip along the handle alone: a head on one side turns the axis of the whole."""
    axes = outline.long_axes
    along = (thing.points - outline.long_point) @ axes[0]
    own = thing.points[along < strip.places[first] - (strip.places[1] - strip.places[0])]
    if len(own) < 40:
        return None
    handle, _, length = long_frame(own)
    if length < 0.06:
        return None
    sign = 1.0 if handle[0] @ axes[0] > 0.0 else -1.0
    turned = np.stack([sign * handle[0], sign * handle[1], axes[2]])
    return _strip(thing, replace(outline, long_axes=turned))


def _thicker(head: Array, center: float) -> float:
    """Return how much longer along the handle the front half of a head is than the back [m]."""
    ends = []
    for side in (head[head[:, 1] > center + 0.015], head[head[:, 1] < center - 0.015]):
        ends.append(float(np.ptp(side[:, 0])) if len(side) > 5 else 0.0)
    return ends[0] - ends[1]


def screwdriver(thing: SeenThing, outline: Outline) -> Draft | None:
    """Return the screwdriver that lies there, None where it is none."""
    body = outline.lying
    if body is None or body.share < _ROUND:
        return _flat_screwdriver(thing, outline)
    points = np.concatenate([thing.points, thing.flat])
    along = (points - body.point) @ body.axes[2]
    low, high = (float(q) for q in np.quantile(along, [0.005, 0.997]))
    length = high - low
    if length < 0.06:
        return None
    steps = low + (np.arange(_STEPS) + 0.5) * length / _STEPS
    radii = body.radius_at(steps)
    widest = float(np.quantile(radii, 0.9))
    thin = np.flatnonzero(radii < 0.5 * widest)
    thin = thin[thin >= 3]
    boundary = int(np.clip(thin[0] if len(thin) else 0.5 * _STEPS, 3, _STEPS - 2))
    shaft = float(np.clip(np.median(radii[boundary:]), 0.0018, 0.0045))
    start = boundary * length / _STEPS
    made = screwdriver_draft(
        _turned_grip(radii[:boundary], length / _STEPS),
        start, length - start, shaft, "flat", 0.1, color_of(thing), join=merge_meshes,
    )  # fmt: skip
    return Draft(made, make_pose(body.axes.T, body.point + low * body.axes[2]))


def _turned_grip(radii: Array, step: float) -> list[Array]:
    """Return the rows of a handle from its radii in the middle of equal steps [m]."""
    return (
        [row(0.0, 0.75 * float(radii[0]))]
        + [row((k + 0.5) * step, float(r)) for k, r in enumerate(radii)]
        + [row(len(radii) * step, 0.7 * float(radii[-1]))]
    )


def _flat_screwdriver(thing: SeenThing, outline: Outline) -> Draft | None:
    """Return the screwdriver of an outline on the table, where no round body fits."""
    strip = _strip(thing, outline)
    if strip is None:
        return None
    # The handle is the wide end.
    strip = strip.turned()
    half = _STEPS // 2
    if strip.wide[:half].mean() < strip.wide[half:].mean():
        strip = strip.turned()
    step = strip.length / _STEPS
    widest = float(np.quantile(strip.wide[: half + 2], 0.9))
    thin = np.flatnonzero(strip.wide < 0.5 * widest)
    thin = thin[thin >= 3]
    boundary = int(np.clip(thin[0] if len(thin) else 0.5 * _STEPS, 3, _STEPS - 3))
    center = 0.5 * (strip.low + strip.high)
    widths = np.clip(0.5 * strip.wide[:boundary], 0.004, 0.025)
    tall = float(np.clip(np.quantile(strip.tall[:boundary], 0.9), 0.010, 0.045))
    radius = 0.5 * (0.5 * widest + 0.5 * tall)
    widths = widths * radius / max(0.5 * widest, 1e-3)
    shaft = float(np.clip(0.5 * np.median(strip.wide[boundary:]) - 0.0008, 0.0015, 0.005))
    start = boundary * step
    grip = _turned_grip(widths, step)
    made = screwdriver_draft(
        grip, start, strip.length - start, shaft, "flat", 0.1, color_of(thing), join=merge_meshes
    )
    # Handle and tip both touch the table.
    pitch = -np.arcsin(np.clip((radius - shaft) / max(strip.length - 0.3 * start, 0.05), 0.0, 0.5))
    shift = float(np.median(center[:boundary]))
    return Draft(made, strip.pose(radius * np.cos(pitch), shift, float(pitch)))
