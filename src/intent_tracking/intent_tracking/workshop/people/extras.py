"""Where the other hands lie: the person's own beside the work, a stranger's at the image's edge."""

from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.workshop.people.company_pieces import (
    RestingHand,
    mirrored_skin,
    resting_hand,
)
from intent_tracking.workshop.person.acting.script import Script
from intent_tracking.workshop.person.body.dressed import with_folds
from intent_tracking.workshop.person.body.person_hand import sample_hand
from intent_tracking.workshop.person.body.skin import Skin, make_skin
from intent_tracking.workshop.person.filming.film import Set
from intent_tracking.workshop.person.filming.look import Look, skin_palette
from intent_tracking.workshop.person.filming.room import sample_clothes

_APART = 0.17
"""Another hand's middle keeps this far from everything that moves or stands there [m]."""
_TRIES = 40


def second_hand(script: Script, skin: Skin, scene: Set, rng: np.random.Generator) -> RestingHand:
    """Return the demonstrator's other hand at rest on the table."""
    assert scene.look is not None
    outwards = 1.0 if skin.hand.side == "right" else -1.0
    busy, best, room = _busy(script), (np.zeros(2), np.array([0.0, -1.0])), -1.0
    for _ in range(_TRIES):
        wrist = np.array(
            [outwards * rng.uniform(0.14, 0.34), script.edge - rng.uniform(0.06, 0.14)]
        )
        ahead = np.array([-outwards * rng.uniform(-0.1, 0.6), -1.0])
        free = _freedom(wrist, ahead, busy)
        if free > room:
            best, room = (wrist, ahead), free
        if free > _APART:
            break
    look = replace(scene.look, things=())
    frames = len(script.hands)
    return resting_hand(mirrored_skin(skin), look, scene.clothes, *best, frames, rng)


def bystander(script: Script, scene: Set, rng: np.random.Generator) -> RestingHand:
    """Return a stranger's hand that lies near the edge of the image."""
    side = str(rng.choice(["right", "left"]))
    skin = with_folds(make_skin(sample_hand(rng, side), 0.004))
    look = Look(skin_palette(int(rng.integers(1, 11)), rng), bare=bool(rng.random() < 0.4))
    clothes = sample_clothes(rng)
    if look.bare:
        clothes = replace(clothes, bare=0.0, width=0.045)
    busy, best, room = _busy(script), (np.array([9.0, 0.0]), np.array([1.0, 0.0])), -1.0
    for _ in range(_TRIES):
        place = _on_table(scene, rng)
        if place is None:
            continue
        ahead = -place + rng.normal(0.0, 0.08, 2)
        ahead /= np.linalg.norm(ahead)
        wrist = place - 0.09 * ahead
        free = _freedom(wrist, ahead, busy)
        if free > room and wrist[1] < script.edge - 0.05:
            best, room = (wrist, ahead), free
        if room > _APART:
            break
    return resting_hand(skin, look, clothes, *best, len(script.hands), rng)


def _on_table(scene: Set, rng: np.random.Generator) -> Array | None:
    """Return a point (2,) of the table that is seen near the border of the image, or None."""
    camera = scene.camera
    border = rng.uniform(0.08, 0.20)
    across, along = border if rng.random() < 0.5 else 1.0 - border, rng.uniform(0.1, 0.9)
    across, along = (along, across) if rng.random() < 0.4 else (across, along)
    u, v = across * camera.width, along * camera.height
    ray = scene.T_table_camera[:3, :3] @ [
        (u - camera.cx) / camera.fx,
        (v - camera.cy) / camera.fy,
        1,
    ]
    if ray[2] > -1e-3:
        return None
    point = scene.T_table_camera[:3, 3] - ray * scene.T_table_camera[2, 3] / ray[2]
    near = abs(point[0]) < 0.6 and point[1] > -0.7
    return np.asarray(point[:2]) if near else None


def _busy(script: Script) -> Array:
    """Return the points (P, 2) over the table where hand and objects pass."""
    palms = script.hands[:, :3, 3] + 0.08 * script.hands[:, :3, 0]
    palms = palms[script.hands[:, 1, 3] < script.edge]
    return np.concatenate([palms, script.objects[::4, :, :3, 3].reshape(-1, 3)])[:, :2]


def _freedom(wrist: Array, ahead: Array, busy: Array) -> float:
    """Return the distance of a lying hand's middle to everything busy [m]."""
    middle = wrist + 0.08 * ahead / np.linalg.norm(ahead)
    return float(np.linalg.norm(busy - middle, axis=1).min(initial=9.0))
