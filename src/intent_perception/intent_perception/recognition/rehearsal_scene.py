"""Frames of an invented table: nodes go through them before they say that they are ready.

Compiled code is loaded from disk, and tables are filled, when they are first needed. That must not
happen in the first real frame. Nothing that is seen in a rehearsal is kept.
"""

from collections.abc import Sequence

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at, make_pose
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObject

T_TABLE_CAMERA = look_at(np.array([0.0, -0.75, 0.55]), np.array([0.0, 0.05, 0.0]))
"""(4, 4) camera -> table."""
HAND_PLACE = np.array([0.10, -0.05, 0.05])
"""Middle of the block that stands for a hand, in the frame `table` [m]."""
_TABLE, _HAND = np.array([0.6, 0.4, 0.01]), np.array([0.045, 0.10, 0.02])
"""Half the edges of the blocks that stand for table and hand [m]."""
_COLORS = np.array([[0.45, 0.42, 0.4], [0.85, 0.62, 0.5]])
_SECOND = 1_000_000_000
_APART = 0.13  # between things in a row [m]
_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T


def rehearsal_frames(model: ObjectModel, count: int) -> list[RgbdFrame]:
    """Return so many frames, a second apart: an object alone at first, then with a hand beside.

    Args:
        model: stands on the table.
        count: how many.
    """
    return [_frame(model, k * _SECOND, with_hand=k > 0) for k in range(count)]


def rehearsal_things(models: Sequence[ObjectModel]) -> RgbdFrame:
    """Return a frame of several objects in a row, as they rest."""
    places = []
    for k, model in enumerate(models):
        places.append(model.rest.copy())
        places[-1][0, 3] += _APART * (k - 0.5 * (len(models) - 1))
    return _drawn([model.mesh for model in models], places, [model.color for model in models], 0)


def rehearsal_object(model: ObjectModel) -> RecognizedObject:
    """Return what the recogniser would say of the object on the table."""
    return RecognizedObject(model.name, model.name, model.object_class, model.rest, 1.0, 1.0)


def _frame(model: ObjectModel, stamp: int, with_hand: bool) -> RgbdFrame:
    meshes, places, colors = [model.mesh], [model.rest], [model.color]
    if with_hand:
        meshes.append(convex_hull(_CORNERS * _HAND))
        places.append(make_pose(np.eye(3), HAND_PLACE))
        colors.append(_COLORS[1])
    return _drawn(meshes, places, colors, stamp)


def _drawn(meshes: list[Mesh], places: list[Array], colors: list[Array], stamp: int) -> RgbdFrame:
    """Return the frame of things at their places (4, 4) on the table."""
    shown = [convex_hull(_CORNERS * _TABLE), *meshes]
    poses = np.stack([make_pose(np.eye(3), [0.0, 0.0, -_TABLE[2]]), *places])
    seen = render(KINECT, shown, inverse(T_TABLE_CAMERA) @ poses, np.stack([_COLORS[0], *colors]))
    assert seen.color is not None
    return RgbdFrame(stamp, seen.color, seen.depth, KINECT)
