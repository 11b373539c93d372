"""ROS node: stable grasps and scene states in, probability of each task out."""

from typing import Any

from intent_msgs.msg import SceneState, StableGrasp, TaskPosterior

from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.ros.convert import posterior_to_msg
from intent_perception.ros.declared import declared
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import RESULTS, IntentNode, run
from intent_perception.ros.shaped_objects import learn_shapes
from intent_tracking.ros.convert import grasp_from_msg, state_from_msg


class InferenceNode(IntentNode):
    """Passes every grasp and every frame of a reach to the estimator and publishes its answers.

    A grasp that was reported before this node was started is not answered again. Forecasts of a
    reach and conclusions share a topic, of which a late joiner hears the last conclusion alone, and
    none once another reach has begun.
    """

    def __init__(self) -> None:
        super().__init__("inference")
        self._estimator = IntentionEstimator(declared(self, InferenceConfig()))
        self._estimator.rehearse()
        self._publisher = LatestResult(self, TaskPosterior, "intent/task_posterior")
        learn_shapes(self, "intent/shapes", self._estimator.database)
        self.listen_for_news(StableGrasp, "intent/stable_grasp", self._on_grasp)
        self.listen(SceneState, "intent/scene_state", self._on_state, RESULTS)

    def reset(self) -> None:
        """Forget the reach."""
        self._estimator.reset()
        self._publisher.take_back()

    def _on_grasp(self, message: Any) -> None:
        self._publish(self._estimator.step(grasp_from_msg(message)), message.header.frame_id)

    def _on_state(self, message: Any) -> None:
        self._publish(self._estimator.step(state_from_msg(message)), message.header.frame_id)

    def _publish(self, posterior: Any, frame: str) -> None:
        if posterior is None:  # nothing to say: silence, not a guess
            return
        message = posterior_to_msg(posterior)
        message.header.frame_id = frame
        if posterior.preliminary:
            self._publisher.publish_fleeting(message)
        else:
            self._publisher.publish(message)


def main() -> None:
    """Run the node until Ctrl-C."""
    run(InferenceNode)
