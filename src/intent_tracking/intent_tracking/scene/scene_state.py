"""What the tracker says about one frame: hand and objects, 26 + 6 N values."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, pose_from_vector, require_pose
from intent_tracking.scene.hand_model import SHAPE_SIZE, HandModel, Side
from intent_tracking.scene.state_layout import HAND_SIZE, OBJECT_SIZE, state_size

_FARTHEST = 1e3
_LARGEST_SHARE = 10.0
"""Of the average hand: scale, thickness and bones."""


@dataclass(frozen=True, eq=False)
class SceneState:
    """Hand and objects in the table's frame at the stamp of one depth image."""

    stamp: int
    """Stamp of the depth image [ns]."""
    hand_side: Side
    state: Array
    """(26 + 6 N,) wrist position [m], wrist rotation vector [rad], 20 joint angles [rad] in the
    order of `JOINT_NAMES`; per object position [m] and rotation vector [rad], all of T_table_*.
    The first 26 are NaN while the hand is not visible or lost."""
    state_std: Array
    """(26 + 6 N,) standard deviation of each value, in its unit; NaN where the state is."""
    hand_shape: Array
    """(22,) shape of the fitted hand, see `HandModel.from_shape`."""
    object_ids: tuple[str, ...]
    object_models: tuple[str, ...]
    object_classes: tuple[str, ...]
    T_table_camera: Array
    """(4, 4) colour camera's optical frame in the table's."""
    cost: float
    """Rendered cost of the frame (see `objective`), NaN without a hand."""
    hand_visible: bool
    """Something like a hand is in view."""
    hand_lost: bool
    """A hand is in view, but its pose is not known."""
    objects_lost: tuple[bool, ...]

    def __post_init__(self) -> None:
        expected = state_size(len(self.object_ids))
        if self.state.shape != (expected,) or self.state_std.shape != (expected,):
            raise ValueError(
                f"expected state and state_std of ({expected},) for {len(self.object_ids)} "
                f"objects, got {self.state.shape} and {self.state_std.shape}"
            )
        if self.hand_side not in ("left", "right"):
            raise ValueError(f"expected hand_side left or right, got {self.hand_side!r}")
        if self.hand_shape.shape != (SHAPE_SIZE,) or not np.all(
            (self.hand_shape > 0.0) & (self.hand_shape < _LARGEST_SHARE)
        ):
            raise ValueError(f"expected hand_shape as {SHAPE_SIZE} shares above 0, got others")
        # NaN is not known; what is known lies near the table.
        if np.any(np.abs(self.state) > _FARTHEST) or np.any(self.state_std < 0.0):
            raise ValueError("expected a state within metres and radians, and deviations from 0 on")
        require_pose(self.T_table_camera, "T_table_camera")

    @property
    def hand_tracked(self) -> bool:
        """Whether the first 26 values are a pose."""
        return bool(np.isfinite(self.state[:HAND_SIZE]).all())

    @property
    def T_table_hand(self) -> Array:
        """(4, 4) wrist frame in the table's; NaN where the hand is not tracked."""
        return pose_from_vector(self.state[:6])

    @property
    def joint_angles(self) -> Array:
        """(20,) [rad]."""
        return self.state[6:HAND_SIZE]

    @property
    def hand(self) -> HandModel:
        """The fitted hand."""
        return HandModel.from_shape(self.hand_side, self.hand_shape)

    @property
    def T_table_objects(self) -> Array:
        """(N, 4, 4)."""
        return pose_from_vector(self.state[HAND_SIZE:].reshape(-1, OBJECT_SIZE))

    @property
    def joints_table(self) -> Array:
        """(21, 3) hand landmarks in the table's frame [m]; NaN where the hand is not tracked."""
        pose = self.T_table_hand
        local = self.hand.joint_positions(np.nan_to_num(self.joint_angles))
        return np.asarray(local @ pose[:3, :3].T + pose[:3, 3])

    @property
    def joints_camera(self) -> Array:
        """(21, 3) hand landmarks in the camera's frame [m]."""
        pose = inverse(self.T_table_camera)
        return np.asarray(self.joints_table @ pose[:3, :3].T + pose[:3, 3])
