"""Things that fit no family: what is seen, its mirror image, and what holds it up, in one hull."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import convex_hull
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.families.designed_object import NOTHING, DesignedObject
from intent_perception.objects.model import Functions, Part
from intent_perception.recognition.estimation.estimated_parts import Draft, color_of
from intent_perception.recognition.estimation.things import SeenThing

_ON_SURFACE = 0.01  # quantiles that bound the points: single ones fly [share]
_SHALLOW = 0.6  # a hull this much flatter towards the camera than across has an unseen back
_CORNERS = 24


def completed(thing: SeenThing) -> Draft:
    """Return the closed hull of a thing: its visible surface, the back and what is below.

    The back is the mirror image of the front where nothing of the top tells how deep it is.
    """
    points = np.concatenate([_without_flyers(thing.points), thing.flat])
    points[:, 2] = np.maximum(points[:, 2], 0.0)
    points = np.concatenate([points, _mirrored(thing, points)])
    below = points.copy()
    below[:, 2] = 0.0
    # What overhangs keeps its own outline: only the part that stands is carried down.
    stands = points[:, 2] < 0.5 * thing.height
    below = below[stands] if stands.sum() > 20 else below
    middle = np.array([*(0.5 * (points[:, :2].min(axis=0) + points[:, :2].max(axis=0))), 0.0])
    mesh = convex_hull(_thinned(np.concatenate([points, below])) - middle)
    made = DesignedObject(
        mesh=mesh,
        parts=(Part("body", mesh),),
        functions=Functions(),
        symmetry=NOTHING,
        mass=0.3,
        friction=0.5,
        color=color_of(thing),
        upright=True,
    )
    return Draft(made, make_pose(np.eye(3), middle))


def _without_flyers(points: Array) -> Array:
    low, high = np.quantile(points, [_ON_SURFACE, 1.0 - _ON_SURFACE], axis=0)
    kept = np.all((points >= low - 0.002) & (points <= high + 0.002), axis=1)
    return points[kept]


def _mirrored(thing: SeenThing, points: Array) -> Array:
    """Return the mirror image of the front, where the thing's depth is not seen."""
    ahead = points[:, :2].mean(axis=0) - thing.eye[:2]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-6)
    right = np.array([ahead[1], -ahead[0]])
    deep, across = points[:, :2] @ ahead, points[:, :2] @ right
    extent = np.ptp(np.quantile(deep, [0.01, 0.99]))
    width = np.ptp(np.quantile(across, [0.01, 0.99]))
    level = float((thing.normals[:, 2] > 0.8).mean())
    if level > 0.04 or extent > _SHALLOW * width:
        return np.zeros((0, 3))
    # about the plane in which the outline is seen: its sides are as far back as one can see
    plane = float(np.quantile(deep, 0.97))
    image = points.copy()
    image[:, :2] += (2.0 * (plane - deep))[:, None] * ahead
    return image


def _thinned(points: Array) -> Array:
    """Return points whose hull is nearly that of all: the farthest in some directions."""
    steps = np.arange(_CORNERS * 12)
    heights = 1.0 - 2.0 * (steps + 0.5) / len(steps)
    turns = steps * (np.pi * (3.0 - np.sqrt(5.0)))
    across = np.sqrt(1.0 - heights**2)
    directions = np.stack([across * np.cos(turns), across * np.sin(turns), heights], axis=1)
    farthest = np.unique(np.argmax(points @ directions.T, axis=0))
    return np.asarray(points[farthest])
