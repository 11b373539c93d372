"""What is measured of a thing, whatever it is: how it stands, lies, narrows, is hollow or forked.

Three readings of the same points: as a body that stands around a vertical axis, as one that lies
around a level axis, and as something flat and long. Which of them is right shows in the residuals.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array, Mask
from intent_perception.recognition.estimation.revolution import (
    Revolution,
    fit_revolution,
    slice_quantiles,
)
from intent_perception.recognition.estimation.squeezed import fit_squeezed
from intent_perception.recognition.estimation.things import SeenThing

_SAMPLES = 8
_ROUND = 0.90  # bodies whose points fit a circle this well are round
_OFF = 0.006  # points further outside a body belong to a handle or to nothing [m]
_UNIT = 0.1  # lengths are given in this [m]
_LEVEL = 0.8  # cosine between up and the normal of what lies level
_WORST = 0.012
_HANDLE_WIDE = 0.022
_TOO_WIDE = 0.10  # a round body may look narrower than it is by this share: edges are lost


SIDES, TOP = np.array([0.03, 0.97]), np.array([0.9])
"""Quantiles of what is across and of what is high at which a strip of a thing ends."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The readings of one thing."""

    round: Revolution | None
    """Around a vertical axis, with a round section."""
    standing: Revolution | None
    """The same with a section of any shape, where a round one does not fit."""
    lying: Revolution | None
    """Around a level one, its thick end first."""
    handle: Mask
    """(N,) whether a point may be of a handle of the standing body."""
    long_axes: Array
    """(3, 3) rows: along a flat thing, its wide end last; across; up."""
    long_point: Array
    """(3,) its middle on the table [m]."""
    features: Array
    """(F,) what the class is told from."""


def outline_of(thing: SeenThing) -> Outline:
    """Return the readings of a thing."""
    center = np.array([*np.median(thing.points[:, :2], axis=0), 0.0])
    circular = fit_revolution(thing.points, thing.normals, np.eye(3), center, False)
    standing = _standing(thing, center, circular)
    lying = _lying(thing)
    long_axes, long_point, flat = _flat(thing)
    handle = _handle_points(thing, standing)
    features = np.concatenate(
        [
            _standing_features(thing, standing, handle),
            _lying_features(thing, lying),
            flat,
            [
                np.log(max(thing.pixels, 60) / 2000.0),
                min(thing.hidden, 0.5),
                float(len(thing.flat) > 0),
            ],
        ]
    )
    return Outline(circular, standing, lying, handle, long_axes, long_point, features)


def _standing(thing: SeenThing, center: Array, found: Revolution | None) -> Revolution | None:
    if found is not None and found.share >= _ROUND and _as_wide_as_seen(thing, found):
        return found
    other = fit_squeezed(thing, center)
    if found is None or (other is not None and other.share > found.share - 0.05):
        return other
    return found


def _as_wide_as_seen(thing: SeenThing, body: Revolution) -> bool:
    """Return whether a round body ends left and right where the thing does."""
    on = np.abs(body.gaps) < _OFF
    if on.sum() < 30:
        return False
    ahead = thing.points[on, :2].mean(axis=0) - thing.eye[:2]
    right = np.array([ahead[1], -ahead[0]]) / max(float(np.linalg.norm(ahead)), 1e-6)
    low, high = np.quantile(thing.points[on, :2] @ right, [0.01, 0.99])
    widest = 2.0 * float(np.quantile(body.radii, 0.95))
    return bool(abs(widest - (high - low)) < max(_TOO_WIDE * widest, 0.006))


def _lying(thing: SeenThing) -> Revolution | None:
    """Return the body around a level axis, thick end first, None where nothing lies."""
    axes, middle, _ = long_frame(thing.points)
    # rows: x and y of the section, axis
    axes = np.stack([axes[1], axes[2], axes[0]])
    center = np.array([*middle, 0.4 * thing.height])
    found = fit_revolution(thing.points, thing.normals, axes, center, True)
    if found is None:
        return None
    half = len(found.radii) // 2
    if found.radii[:half].mean() >= found.radii[half:].mean():
        return found
    return turned_round(found)


def turned_round(body: Revolution) -> Revolution:
    """Return the same body with its axis the other way."""
    return Revolution(
        body.point,
        np.stack([body.axes[0], -body.axes[1], -body.axes[2]]),
        body.aspect,
        body.power,
        -body.heights[::-1],
        body.radii[::-1],
        body.residual,
        body.share,
        body.outer,
        body.gaps,
    )


def long_frame(points: Array) -> tuple[Array, Array, float]:
    """Return rows along, across and up (3, 3), the middle (2,) [m] and the length of points [m]."""
    flat = points[:, :2]
    middle = flat.mean(axis=0)
    _, _, rows = np.linalg.svd(flat - middle, full_matrices=False)
    along = np.array([*rows[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    axes = np.stack([along, np.cross(up, along), up])
    places = flat @ axes[:2, :2].T
    low, high = np.quantile(places, [0.005, 0.995], axis=0)
    return axes, 0.5 * (low + high) @ axes[:2, :2], float(high[0] - low[0])


def _handle_points(thing: SeenThing, body: Revolution | None) -> Mask:
    """Return which points (N,) stand off a standing body as a handle does."""
    none = np.zeros(len(thing.points), dtype=bool)
    if body is None:
        return none
    places = body.places(thing.points)
    off = (body.gaps > _OFF) & (places[:, 2] < 0.99 * thing.height)
    if off.sum() < 8:
        return none
    angle = np.arctan2(places[off, 1], places[off, 0])
    mean = np.arctan2(np.median(np.sin(angle)), np.median(np.cos(angle)))
    beside = -np.sin(mean) * places[:, 0] + np.cos(mean) * places[:, 1]
    ahead = np.cos(mean) * places[:, 0] + np.sin(mean) * places[:, 1] > 0.0
    return np.asarray(off & ahead & (np.abs(beside) < _HANDLE_WIDE))


def _standing_features(thing: SeenThing, body: Revolution | None, handle: Mask) -> Array:
    if body is None:
        return np.concatenate([[0.0, 1.0, 0.0, 1.0, 1.0], np.zeros(_SAMPLES + 12)])
    places, h = body.places(thing.points), max(thing.height, 1e-3)
    widest = float(np.quantile(body.radii, 0.95))
    samples = body.radius_at(np.linspace(0.05, 0.97, _SAMPLES) * h) / max(widest, 1e-4)
    # what is seen within the rim: a lid at its level, or the inside further down
    radius = np.hypot(places[:, 0], places[:, 1] / body.aspect)
    rim = float(body.radius_at(np.array([0.96 * h]))[0])
    within = (radius < 0.85 * rim) & ~handle
    drop = np.clip((h - places[within, 2]) / h, 0.0, 1.0)
    inner = within | (~body.outer & (body.gaps < -0.002) & ~handle)
    level = thing.normals[:, 2] > _LEVEL
    lid = level & (places[:, 2] > 0.90 * h) & (radius < 1.02 * rim)
    low_level = level & (places[:, 2] < 0.75 * h) & within
    return np.concatenate(
        [
            [
                body.share,
                min(body.residual, _WORST) / _WORST,
                float(body.outer.mean()),
                body.aspect,
                0.3 * body.power,
            ],
            np.clip(samples, 0.0, 1.3),
            [
                h / _UNIT,
                min(2.0 * widest, 0.4) / _UNIT,
                min(h / max(2.0 * widest, 1e-3), 4.0),
                float(within.mean()),
                float(drop.mean()) if len(drop) > 5 else 0.0,
                float(np.quantile(drop, 0.8)) if len(drop) > 5 else 0.0,
                float(inner.mean()),
                float(lid.mean()),
                float(low_level.mean()),
                *_handle_features(thing, body, handle),
            ],
        ]
    )


def _handle_features(thing: SeenThing, body: Revolution, handle: Mask) -> Array:
    """Return share, reach and upright span of what stands off the body."""
    off = (body.gaps > _OFF).mean()
    if handle.sum() < 8:
        return np.array([0.0, 0.0, float(off)])
    heights = body.places(thing.points)[handle, 2]
    span = (np.quantile(heights, 0.95) - np.quantile(heights, 0.05)) / max(thing.height, 1e-3)
    reach = min(float(np.quantile(body.gaps[handle], 0.9)), 0.08) / _UNIT
    return np.array([reach, span, float(off) - float(handle.mean())])


def _lying_features(thing: SeenThing, body: Revolution | None) -> Array:
    if body is None:
        return np.concatenate([[0.0, 1.0, 0.0], np.zeros(_SAMPLES + 4)])
    low, high = float(body.heights[0]), float(body.heights[-1])
    widest = float(np.quantile(body.radii, 0.95))
    samples = body.radius_at(low + np.linspace(0.04, 0.96, _SAMPLES) * (high - low))
    inside = ~body.outer & (body.gaps < -0.004)
    return np.concatenate(
        [
            [body.share, min(body.residual, _WORST) / _WORST, float(body.outer.mean())],
            np.clip(samples / max(widest, 1e-4), 0.0, 1.3),
            [
                min(high - low, 0.5) / _UNIT,
                min(2.0 * widest, 0.4) / _UNIT,
                float(inside.mean()),
                float((body.gaps > _OFF).mean()),
            ],
        ]
    )


def _flat(thing: SeenThing) -> tuple[Array, Array, Array]:
    """Return axes and middle of a flat thing, wide end last, and its features."""
    points = np.concatenate([thing.points, thing.flat])
    axes, middle, length = long_frame(points)
    places = (points[:, :2] - middle) @ axes[:2, :2].T
    half = max(0.5 * length, 1e-3)
    index = ((places[:, 0] / half + 1.0) * 0.5 * _SAMPLES).astype(np.int64)
    index = np.clip(index, 0, _SAMPLES - 1)
    low, high = np.nan_to_num(slice_quantiles(places[:, 1].copy(), index, _SAMPLES, SIDES, 3)).T
    (tall,) = np.nan_to_num(slice_quantiles(points[:, 2].copy(), index, _SAMPLES, TOP, 3)).T
    wide = high - low
    if wide[:3].sum() > wide[-3:].sum():
        axes = np.stack([-axes[0], -axes[1], axes[2]])
        wide, tall, low, high = wide[::-1], tall[::-1], -high[::-1], -low[::-1]
    bend = 0.5 * (low + high)
    features = np.concatenate(
        [
            wide / _UNIT,
            tall / _UNIT,
            (bend - bend.mean()) / _UNIT,
            [min(length, 0.5) / _UNIT, wide.max() / max(length, 1e-3)],
            [np.clip(thing.points[:, 2], 0.0, 0.2).std() / _UNIT],
            [float((thing.normals[:, 2] > _LEVEL).mean()), len(thing.flat) / (len(points) + 1.0)],
        ]
    )
    return axes, np.array([*middle, 0.0]), features
