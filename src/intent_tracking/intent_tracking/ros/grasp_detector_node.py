"""ROS node: scene states in, one message for each stable grasp out."""

from typing import Any

from intent_msgs.msg import SceneState, StableGrasp

from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import RESULTS, IntentNode, run
from intent_perception.ros.shaped_objects import learn_shapes
from intent_tracking.grasp.grasp_detector import GraspConfig, GraspDetector
from intent_tracking.grasp.rehearsal_states import rehearsal_states
from intent_tracking.ros.convert import grasp_to_msg, state_from_msg


class GraspDetectorNode(IntentNode):
    """Passes every scene state to the detector and publishes the grasps it finds."""

    def __init__(self) -> None:
        super().__init__("grasp_detector")
        database = declared_database(self)
        self._detector = GraspDetector(database, declared(self, GraspConfig()))
        for state in rehearsal_states(database.example, 12):
            self._detector.step(state)
        self._detector.reset()
        self._publisher = LatestResult(self, StableGrasp, "intent/stable_grasp")
        learn_shapes(self, "intent/shapes", database)
        self.listen(SceneState, "intent/scene_state", self._on_state, RESULTS)

    def reset(self) -> None:
        """Forget the grasp in progress."""
        self._detector.reset()
        self._publisher.take_back()

    def _on_state(self, message: Any) -> None:
        grasp = self._detector.step(state_from_msg(message))
        if grasp is not None:
            self._publisher.publish(grasp_to_msg(grasp, message.header.frame_id))


def main() -> None:
    """Run the node until Ctrl-C."""
    run(GraspDetectorNode)
