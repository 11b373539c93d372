"""Frames of an invented table: nodes go through them before they say that they are ready.

Compiled code is loaded from disk, and tables are filled, when they are first needed. That must not
happen in the first real frame. Nothing that is seen in a rehearsal is kept.
"""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import convex_hull
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at, make_pose
from intent_perception.objects.model import ObjectModel

T_TABLE_CAMERA = look_at(np.array([0.0, -0.75, 0.55]), np.array([0.0, 0.05, 0.0]))
"""(4, 4) camera -> table."""
HAND_PLACE = np.array([0.10, -0.05, 0.05])
"""Middle of the block that stands for a hand, in the frame `table` [m]."""
_TABLE, _HAND = np.array([0.6, 0.4, 0.01]), np.array([0.045, 0.10, 0.02])
"""Half the edges of the blocks that stand for table and hand [m]."""
_COLORS = np.array([[0.45, 0.42, 0.4], [0.85, 0.62, 0.5]])
_SECOND = 1_000_000_000
_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T


def rehearsal_frames(model: ObjectModel, count: int) -> list[RgbdFrame]:
    """Return so many frames, a second apart: an object alone at first, then with a hand beside.

    Args:
        model: stands on the table.
        count: how many.
    """
    pose = model.stable_poses[0] if len(model.stable_poses) else np.eye(4)
    return [_frame(model, pose, k * _SECOND, with_hand=k > 0) for k in range(count)]


def _frame(model: ObjectModel, pose: Array, stamp: int, with_hand: bool) -> RgbdFrame:
    meshes = [convex_hull(_CORNERS * _TABLE), model.mesh, convex_hull(_CORNERS * _HAND)]
    places = np.stack(
        [make_pose(np.eye(3), [0.0, 0.0, -_TABLE[2]]), pose, make_pose(np.eye(3), HAND_PLACE)]
    )
    colors = np.stack([_COLORS[0], model.color, _COLORS[1]])
    shown = slice(0, 3 if with_hand else 2)
    seen = render(KINECT, meshes[shown], (inverse(T_TABLE_CAMERA) @ places)[shown], colors[shown])
    assert seen.color is not None
    return RgbdFrame(stamp, seen.color, seen.depth, KINECT)
