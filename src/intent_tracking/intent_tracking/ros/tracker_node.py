"""ROS node: RGB-D frames and recognised objects in, the state of hand and objects out."""

from typing import Any

from intent_msgs.msg import RecognizedObjects, SceneState
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.ros.convert import deletion, header_at, object_markers, objects_from_msg
from intent_perception.ros.node import (
    LATCHED,
    RESULTS,
    FrameSubscription,
    IntentNode,
    declared,
    declared_database,
    run,
)
from intent_tracking.fit.hand_shape import save_shape
from intent_tracking.ros.convert import hand_markers, joints_to_msg, scene_transforms, state_to_msg
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig


class TrackerNode(IntentNode):
    """Starts the tracker from the recognised objects and publishes one scene state per frame."""

    def __init__(self) -> None:
        super().__init__("tracker")
        self._database = declared_database(self)
        models = {model.name: model for model in self._database}
        self._config = declared(self, TrackerConfig())
        self._tracker = Tracker(models, self._config)
        if self._tracker.trouble:
            self.get_logger().warning(self._tracker.trouble)
        self._states = self.create_publisher(SceneState, "/intent/scene_state", RESULTS)
        self._joints = self.create_publisher(JointState, "/intent/hand/joint_states", 10)
        self._tf = self.create_publisher(TFMessage, "/tf", 100)
        self._markers = self.create_publisher(MarkerArray, "/intent/markers", LATCHED)
        self.reset()
        self.listen(RecognizedObjects, "/intent/objects", self._on_objects, LATCHED)
        self._frames = FrameSubscription(self, self._on_frame)

    def reset(self) -> None:
        """Forget hand and objects; the next recognised objects start the tracker again."""
        self._tracker.forget_hand()
        self._started, self._hand_in_view, self._shape_kept = False, False, False
        self._recognized: Any = None
        self._alone = False
        self._held: RgbdFrame | None = None
        self._markers.publish(MarkerArray(markers=[deletion("hand"), deletion("objects")]))

    def _on_objects(self, message: Any) -> None:
        self._recognized = message
        if self._held is not None:  # the frame that came before its objects
            frame, self._held = self._held, None
            self.attempt(self._on_frame, frame, header_at(frame.stamp))

    def _start(self, message: Any) -> None:
        objects = objects_from_msg(message)
        self._tracker.start(objects)
        if not objects.objects and not self._alone:
            what = "known object" if objects.table_seen else "table"
            self.get_logger().warning(f"no {what} is seen: the hand is followed alone")
        self._alone = not objects.objects
        self._started, self._recognized = True, None
        models = [(item.id, self._database[item.model]) for item in message.objects]
        self._markers.publish(object_markers(models))

    def _may_start(self, frame: RgbdFrame) -> bool:
        """A hand in view keeps its objects; an answer to this very frame counts from the next."""
        older = stamp_of(self._recognized) < frame.stamp
        return not self._started or (older and not self._hand_in_view)

    def _on_frame(self, frame: RgbdFrame) -> bool:
        if self._recognized is not None and self._may_start(frame):
            self._start(self._recognized)
        if not self._started:
            self._held = frame
            return False
        state = self._tracker.step(frame)
        self._hand_in_view = state.hand_visible
        self._states.publish(state_to_msg(state, self._frames.frame_id))
        if state.hand_tracked:
            self._joints.publish(joints_to_msg(state))
        self._tf.publish(scene_transforms(state))
        self._keep_shape()
        if self._markers.get_subscription_count():
            self._markers.publish(hand_markers(state))
        return True

    def _keep_shape(self) -> None:
        """Write the hand's shape once it is calibrated."""
        estimate, path = self._tracker.shape, self._config.shape.save
        if path and estimate.complete and estimate.side and not self._shape_kept:
            self._shape_kept = True
            save_shape(path, estimate.side, estimate.shape)
            self.get_logger().info(f"hand shape kept in {path}")


def main() -> None:
    """Run the node until Ctrl-C."""
    run(TrackerNode)
