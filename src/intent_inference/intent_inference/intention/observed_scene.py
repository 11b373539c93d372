"""Hands and objects that another source has measured, as the scene states that our steps read."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from intent_inference.intention.observed_hand import hands_of_joints, shape_of_joints
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import vector_from_pose
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.scene.hand_model import SIDES, Side
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE

_JOINT_STD, _TURN_STD, _PLACE_STD = 0.05, 0.02, 0.002
"""Uncertainty of a measured hand's angles [rad], orientation [rad] and position [m]."""


@dataclass(frozen=True, eq=False)
class ObservedScene:
    """One hand and one object over F frames, z up and 0 on the table."""

    stamp: Array
    """(F,) [s]."""
    hand: Array
    """(F, 26) state of the hand, see `SceneState`; NaN where it was not measured."""
    hand_error: Array
    """(F,) root mean square distance of our joints to those measured [m]."""
    shape: Array
    """(22,) of the hand."""
    T_table_object: Array
    """(F, 4, 4)."""
    object_model: str
    hand_side: Side

    def states(self, database: ObjectDatabase) -> Iterator[SceneState]:
        """Yield a scene state per frame."""
        model = database[self.object_model]
        spread = np.full(HAND_SIZE + OBJECT_SIZE, _JOINT_STD)
        spread[[0, 1, 2, HAND_SIZE, HAND_SIZE + 1, HAND_SIZE + 2]] = _PLACE_STD
        spread[[3, 4, 5, HAND_SIZE + 3, HAND_SIZE + 4, HAND_SIZE + 5]] = _TURN_STD
        for second, hand, thing in zip(self.stamp, self.hand, self.T_table_object, strict=True):
            values = np.concatenate([hand, vector_from_pose(thing)])
            seen = bool(np.isfinite(hand).all())
            yield SceneState(
                round(float(second) * 1e9), self.hand_side, values,
                np.where(np.isfinite(values), spread, np.nan), self.shape,
                (model.name,), (model.name,), (model.object_class,), np.eye(4), float("nan"),
                seen, False, (not np.isfinite(thing).all(),),
            )  # fmt: skip


def read_observed(path: Path | str) -> ObservedScene:
    """Return what a file of `observe` holds.

    Args:
        path: NPZ with `stamp` (F,) s, `joints` (F, 21, 3) m in a frame with z up, `T_object`
            (F, 4, 4), `object_model`, `hand_side`, optional `table_height` m (default: the height
            of the lowest place that the object's frame was at).

    Raises:
        ValueError: that names what is missing or of the wrong form.
    """
    arrays = read_arrays(path, "file of hands and objects")
    wanted = ("stamp", "joints", "T_object", "object_model", "hand_side")
    if missing := [name for name in wanted if name not in arrays]:
        raise ValueError(f"{path}: expected {', '.join(wanted)}, {', '.join(missing)} missing")
    stamp = np.asarray(arrays["stamp"], dtype=np.float64)
    joints = np.asarray(arrays["joints"], dtype=np.float64)
    objects = np.asarray(arrays["T_object"], dtype=np.float64)
    frames = len(stamp)
    if stamp.shape != (frames,) or frames < 2 or np.any(np.diff(stamp) <= 0.0):
        raise ValueError(f"{path}: expected stamp (F,) that grows, in seconds, of two or more")
    if joints.shape != (frames, 21, 3) or objects.shape != (frames, 4, 4):
        raise ValueError(
            f"{path}: expected joints ({frames}, 21, 3) and T_object ({frames}, 4, 4), "
            f"got {joints.shape} and {objects.shape}"
        )
    side = str(arrays["hand_side"])
    if side not in SIDES:
        raise ValueError(f"{path}: expected hand_side right or left, got {side!r}")
    known = np.isfinite(objects).all(axis=(1, 2))
    if not known.any() or not np.isfinite(joints).any():
        raise ValueError(f"{path}: expected at least one frame with a hand and one with an object")
    _check_metres(path, joints)
    lowest = float(objects[known, 2, 3].min())
    height = float(arrays["table_height"]) if "table_height" in arrays else lowest
    down = np.array([0.0, 0.0, height])
    joints = joints - down
    objects = objects.copy()
    objects[:, :3, 3] -= down
    shape = shape_of_joints(joints)
    hands, errors = hands_of_joints(joints, "right" if side == "right" else "left", shape)
    return ObservedScene(
        stamp, hands, errors, shape, objects, str(arrays["object_model"]),
        "right" if side == "right" else "left",
    )  # fmt: skip


def _check_metres(path: Path | str, joints: Array) -> None:
    palm = float(np.nanmedian(np.linalg.norm(joints[:, 9] - joints[:, 0], axis=1)))
    if not 0.04 < palm < 0.2:
        raise ValueError(
            f"{path}: expected joints in metres, wrist first, thumb to little finger from palm to "
            f"tip; wrist and middle knuckle are {palm:.3g} apart"
        )
