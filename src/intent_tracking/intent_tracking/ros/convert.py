"""Scene states and stable grasps to and from messages, TF and markers."""

from typing import Any

import numpy as np
from geometry_msgs.msg import Point
from intent_msgs import msg as msgs
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.ros.convert import (
    CAMERA_FRAME,
    TABLE_FRAME,
    FrameNames,
    deletion,
    header_at,
    pose_from_msg,
    pose_to_msg,
    transforms_to_msg,
)
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.scene.hand_model import JOINT_NAMES
from intent_tracking.scene.scene_state import SceneState

_FEATURES = ("size", "conv", "dir", "npos", "fcon", "fvol", "coc", "gbvl")
_NAMES = FrameNames()
_SKIN = ColorRGBA(r=0.93, g=0.72, b=0.6, a=0.9)


def state_to_msg(
    state: SceneState, camera_frame: str = CAMERA_FRAME, table_frame: str = TABLE_FRAME
) -> Any:
    """Return the message of a scene state."""
    return msgs.SceneState(
        header=header_at(state.stamp, table_frame),
        state=state.state.tolist(),
        state_std=state.state_std.tolist(),
        hand_side=state.hand_side,
        hand_shape=state.hand_shape.tolist(),
        joint_names=list(JOINT_NAMES),
        object_ids=list(state.object_ids),
        object_models=list(state.object_models),
        object_classes=list(state.object_classes),
        objects_lost=[bool(lost) for lost in state.objects_lost],
        cost=float(state.cost),
        hand_visible=bool(state.hand_visible),
        hand_lost=bool(state.hand_lost),
        camera_frame=camera_frame,
        camera_pose=pose_to_msg(state.T_table_camera),
    )


def state_from_msg(message: Any) -> SceneState:
    """Return the scene state of a message."""
    return SceneState(
        stamp=stamp_of(message),
        hand_side=message.hand_side,
        state=np.array(message.state, dtype=np.float64),
        state_std=np.array(message.state_std, dtype=np.float64),
        hand_shape=np.array(message.hand_shape, dtype=np.float64),
        object_ids=tuple(message.object_ids),
        object_models=tuple(message.object_models),
        object_classes=tuple(message.object_classes),
        T_table_camera=pose_from_msg(message.camera_pose),
        cost=message.cost,
        hand_visible=message.hand_visible,
        hand_lost=message.hand_lost,
        objects_lost=tuple(message.objects_lost),
    )


def joints_to_msg(state: SceneState, table_frame: str = TABLE_FRAME) -> Any:
    """Return the 20 joint angles of a tracked hand."""
    angles = state.joint_angles.tolist()
    header = header_at(state.stamp, table_frame)
    return JointState(header=header, name=list(JOINT_NAMES), position=angles)


def scene_transforms(state: SceneState, names: FrameNames = _NAMES) -> Any:
    """Return table -> object_<id> and, while the hand is tracked, table -> hand_wrist."""
    poses = [
        (names.of_object(name), pose)
        for name, pose in zip(state.object_ids, state.T_table_objects, strict=True)
    ]
    if state.hand_tracked:
        poses.append((names.hand_frame, state.T_table_hand))
    return transforms_to_msg(header_at(state.stamp, names.table_frame), poses)


def hand_markers(state: SceneState, names: FrameNames = _NAMES) -> Any:
    """Return the hand's capsules as lines and balls in its frame; nothing while it is lost."""
    if not state.hand_tracked:
        return MarkerArray(markers=[deletion("hand")])
    ends, radii = state.hand.capsules(state.joint_angles)
    markers = []
    for index, (pair, radius) in enumerate(zip(ends.tolist(), radii.tolist(), strict=True)):
        for offset, kind in ((0, Marker.LINE_STRIP), (1, Marker.SPHERE_LIST)):
            marker = Marker(header=header_at(state.stamp, names.hand_frame), ns="hand")
            marker.id, marker.type, marker.color = 2 * index + offset, kind, _SKIN
            marker.lifetime.sec = 1
            marker.scale.x = marker.scale.y = marker.scale.z = 2.0 * radius
            marker.pose.orientation.w = 1.0
            marker.points = [Point(x=x, y=y, z=z) for x, y, z in pair]
            markers.append(marker)
    return MarkerArray(markers=markers)


def grasp_to_msg(grasp: StableGrasp, table_frame: str = TABLE_FRAME) -> Any:
    """Return the message of a stable grasp."""
    return msgs.StableGrasp(
        header=header_at(grasp.stamp, table_frame),
        object_id=grasp.object_id,
        object_model=grasp.object_model,
        object_class=grasp.object_class,
        hand_side=grasp.hand_side,
        hand_pose=pose_to_msg(grasp.T_object_hand),
        features=_features_to_msg(grasp.features, grasp.std),
    )


def grasp_from_msg(message: Any) -> StableGrasp:
    """Return the stable grasp of a message."""
    values = {name: _array(getattr(message.features, name), "value") for name in _FEATURES}
    deviations = {name: _array(getattr(message.features, name), "std") for name in _FEATURES}
    return StableGrasp(
        stamp=stamp_of(message),
        object_id=message.object_id,
        object_model=message.object_model,
        object_class=message.object_class,
        hand_side=message.hand_side,
        features=GraspFeatures(message.features.object_class or None, **values),
        std=GraspFeatures(None, **deviations),
        T_object_hand=pose_from_msg(message.hand_pose),
    )


def _features_to_msg(features: GraspFeatures, std: GraspFeatures | None) -> Any:
    message = msgs.GraspFeatures(object_class=features.object_class or "")
    for name in _FEATURES:
        value, deviation = getattr(features, name), getattr(std, name, None)
        if value is not None:
            known = [] if deviation is None else np.ravel(deviation).tolist()
            feature = msgs.Feature(observed=True, value=np.ravel(value).tolist(), std=known)
            setattr(message, name, feature)
    return message


def _array(feature: Any, part: str) -> Any:
    values = getattr(feature, part)
    return np.array(values, dtype=np.float64) if feature.observed and len(values) else None
