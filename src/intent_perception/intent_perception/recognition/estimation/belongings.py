"""Pieces that are seen apart but are of one thing: the inside of a bowl, the handle of a mug."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.recognition.estimation.outlines import Outline, outline_of
from intent_perception.recognition.estimation.revolution import Revolution, section_radius
from intent_perception.recognition.estimation.things import SeenThing, thing_of, things_in
from intent_perception.scene.scene_view import SceneView

_ROUND = 0.85  # bodies that fit worse tell nothing about what is near them
_MOST_INSIDE = 0.7  # of a piece's points: then it is the body's inside
_REACH = 0.055  # of a handle [m]
_NARROW = 0.018  # half width of a handle [m]
_SMALL = 0.35  # a handle's share of the body's pixels, at most
_RAISED = 0.06  # a handle's lowest point is above this share of the body's height


def readings_of(
    scene: SceneView, T_table_camera: Array, rng: np.random.Generator
) -> list[tuple[SeenThing, Outline]]:
    """Return the things of a scene and how each may be read.

    Args:
        scene: with a table, and the pixels that may be things.
        T_table_camera: (4, 4).
        rng: chooses the points that are looked at.
    """
    pieces = [(thing, outline_of(thing)) for thing in things_in(scene, T_table_camera, rng)]
    owners = _owners(pieces)
    whole = []
    for k, (thing, outline) in enumerate(pieces):
        own = [j for j, owner in enumerate(owners) if owner == k]
        if own == [k]:
            whole.append((thing, outline))
        elif owners[k] == k:
            mask = np.zeros(scene.shape, dtype=bool)
            for j in own:
                piece = pieces[j][0]
                mask[piece.window] |= piece.mask
            joined = thing_of(scene, mask, T_table_camera, rng)
            whole.append((joined, outline_of(joined)))
    return whole


def _owners(pieces: list[tuple[SeenThing, Outline]]) -> list[int]:
    """Return of which piece each is a part; itself if of none."""
    owners = list(range(len(pieces)))
    for k, (thing, outline) in enumerate(pieces):
        body = outline.round
        if body is None or body.share < _ROUND or not body.is_told(thing.points):
            continue
        for j, (other, _) in enumerate(pieces):
            if j == k or owners[j] != j or owners[k] != k:
                continue
            if _is_inside(thing, body, other) or _is_handle(thing, body, other):
                owners = [k if owner == j else owner for owner in owners]
    return owners


def _is_inside(thing: SeenThing, body: Revolution, other: SeenThing) -> bool:
    places = body.places(other.points)
    radius = section_radius(places, body.aspect, body.power)
    limit = body.radius_at(np.clip(places[:, 2], 0.0, body.heights[-1]))
    inside = (radius < limit) & (places[:, 2] < thing.height + 0.005)
    return bool(inside.mean() > _MOST_INSIDE)


def _is_handle(thing: SeenThing, body: Revolution, other: SeenThing) -> bool:
    if other.pixels > _SMALL * thing.pixels:
        return False
    places = body.places(other.points)
    if places[:, 2].min() < _RAISED * thing.height or places[:, 2].max() > 1.02 * thing.height:
        return False
    radius = section_radius(places, body.aspect, body.power)
    gap = radius - body.radius_at(places[:, 2])
    angle = np.arctan2(places[:, 1].mean(), places[:, 0].mean())
    beside = -np.sin(angle) * places[:, 0] + np.cos(angle) * places[:, 1]
    return bool(np.quantile(gap, 0.9) < _REACH and np.quantile(np.abs(beside), 0.9) < _NARROW)
