"""Where the camera and the table go in the tree of frames, and what an IMU says of the vertical.

A frame has one parent. A camera's driver, or a robot that carries the camera, gives the optical
frame its parent; `table` then must become a child in that tree, not the optical frame's parent.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

from intent_perception.basics.arrays import Array
from intent_perception.geometry.frame_tree import FrameTree
from intent_perception.geometry.transforms import inverse
from intent_perception.ros.convert import TableFrame, header_at, pose_from_msg, transforms_to_msg
from intent_perception.ros.node import LATCHED, guarded
from intent_perception.scene.gravity import Gravity


@dataclass(frozen=True)
class FramesConfig(TableFrame):
    """How the table is tied to the other frames, and who tells the vertical."""

    table_parent: str = ""
    """Frame that the table is published in: the camera's optical frame, or one of the robot that
    /tf_static connects with it; empty: the optical frame where its driver has put it into a tree,
    else the table is the root and the camera its child."""
    imu: str = ""
    """Topic (sensor_msgs/Imu) whose acceleration at rest tells the vertical; empty: none."""


class CameraFrames:
    """Listens to /tf_static and to the IMU; makes the transform to publish for a camera pose."""

    def __init__(self, node: Node, config: FramesConfig) -> None:
        self._node, self._config, self._table = node, config, config.table_frame
        self._tree, self._gravity, self._imu_frame = FrameTree(), Gravity(), ""
        self._said: set[str] = set()
        self._rooted = False
        # Drivers publish on /tf_static, whatever the namespace; a graph may have its own.
        for topic in dict.fromkeys(("/tf_static", node.resolve_topic_name("tf_static"))):
            node.create_subscription(
                TFMessage, topic, guarded(node, topic, self._on_frames), LATCHED
            )
        if config.imu:
            qos = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
            node.create_subscription(Imu, config.imu, guarded(node, config.imu, self._on_imu), qos)

    def _on_frames(self, message: Any) -> None:
        for transform in message.transforms:
            parent, child = transform.header.frame_id, transform.child_frame_id
            if self._table not in (parent, child):  # our own
                self._tree.add(parent, child, _pose_of(transform.transform))

    def _on_imu(self, message: Any) -> None:
        self._imu_frame = message.header.frame_id
        felt = message.linear_acceleration
        self._gravity.add(np.array([felt.x, felt.y, felt.z]))

    def up(self, camera: str) -> Array | None:
        """Return the vertical (3,) in the camera's frame, None where no IMU tells it."""
        up = self._gravity.up
        if up is None:
            return None
        T_camera_imu = self._tree.between(camera, self._imu_frame)
        if T_camera_imu is not None:
            return np.asarray(T_camera_imu[:3, :3] @ up)
        if self._imu_frame.endswith("optical_frame"):  # parallel in every driver that has one
            return up
        self._say(
            f"/tf_static does not connect {self._imu_frame} with {camera}: the IMU is left aside"
        )
        return None

    def message(self, stamp: int, camera: str, T_table_camera: Array) -> Any | None:
        """Return the transform to publish; None where the table's parent is not known (yet)."""
        driver = self._tree.parent(camera)
        parent = self._config.table_parent or (camera if driver and not self._rooted else "")
        if not parent:
            if driver:
                self._say(
                    f"{camera} has two parents, {driver} of its driver and {self._table}: "
                    f"set table_parent:={camera}"
                )
            self._rooted = True
            return transforms_to_msg(header_at(stamp), [(camera, T_table_camera)])
        T_parent_camera = self._tree.between(parent, camera)
        if T_parent_camera is None:
            self._say(f"/tf_static does not connect {parent} with {camera}: the table has no place")
            return None
        T_parent_table = T_parent_camera @ inverse(T_table_camera)
        return transforms_to_msg(header_at(stamp, parent), [(self._table, T_parent_table)])

    def _say(self, text: str) -> None:
        if text not in self._said:
            self._node.get_logger().warning(text)
        self._said.add(text)


def _pose_of(transform: Any) -> Array:
    """Return the pose (4, 4) of a geometry_msgs/Transform."""

    class _Pose:
        position, orientation = transform.translation, transform.rotation

    return pose_from_msg(_Pose)
