"""ROS node: plans and objects in, messages of MoveIt, vision_msgs and a gripper's driver out."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from intent_msgs import msg as msgs
from trajectory_msgs.msg import JointTrajectory

from intent_imitation.ros.bridge_messages import detections, hand_trajectory, moveit_grasps
from intent_perception.basics.parameters import Checked
from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import LATCHED, IntentNode, run


@dataclass(frozen=True)
class BridgeConfig(Checked):
    """How a hand is to move."""

    closing: float = 2.0
    """Time from the pre-grasp to the grasp [s], 0.1..60."""


class BridgeNode(IntentNode):
    """Translates each plan and each answer with objects; MoveIt and vision_msgs are optional."""

    def __init__(self) -> None:
        super().__init__("bridge")
        self._config, database = declared(self, BridgeConfig()), declared_database(self)
        self._sizes = {model.name: model.size for model in database.models}
        self._moveit, self._vision = self._package("moveit_msgs"), self._package("vision_msgs")
        self._trajectory = LatestResult(self, JointTrajectory, "intent/hand_trajectory")
        if self._moveit is not None:
            kind = self._moveit.Grasp
            self._grasps = self.create_publisher(kind, "intent/moveit_grasps", 50)
        if self._vision is not None:
            kind = self._vision.Detection3DArray
            self._detections = LatestResult(self, kind, "intent/detections")
            self.listen(msgs.RecognizedObjects, "intent/objects", self._on_objects, LATCHED)
        self.listen_for_news(msgs.GraspPlan, "intent/grasp_plan", self._on_plan)

    def _package(self, name: str) -> Any:
        """Return the messages of a package, None (and one sentence) where it is not installed."""
        try:
            return import_module(f"{name}.msg")
        except ImportError:
            apt = f"ros-jazzy-{name.replace('_', '-')}"
            self.get_logger().warning(f"{name} is not installed: install {apt} for its messages")
            return None

    def _on_objects(self, message: Any) -> None:
        self._detections.publish(detections(message, self._sizes, self._vision))

    def _on_plan(self, message: Any) -> None:
        if not message.grasps:
            self._trajectory.take_back()
            return
        self._trajectory.publish(hand_trajectory(message.grasps[0], self._config.closing))
        if self._moveit is not None:
            for grasp in moveit_grasps(message, self._moveit):
                self._grasps.publish(grasp)


def main() -> None:
    """Run the node until Ctrl-C."""
    run(BridgeNode)
