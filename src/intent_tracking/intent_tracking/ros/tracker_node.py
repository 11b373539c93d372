"""ROS node: RGB-D frames and recognised objects in, the state of hand and objects out."""

from collections import deque
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from intent_msgs.msg import SceneState
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.recognition import recognizer as recognized
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.ros.convert import FrameNames, deletion, header_at, object_markers
from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.frame_subscription import FrameSubscription
from intent_perception.ros.latest_result import ResultOnDemand
from intent_perception.ros.node import RESULTS, IntentNode, ShareConfig, aside, run
from intent_perception.ros.shaped_objects import listen_for_objects
from intent_tracking.fit.hand_shape import save_shape
from intent_tracking.ros.convert import hand_markers, joints_to_msg, scene_transforms, state_to_msg
from intent_tracking.ros.tracker_rehearsal import rehearse
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

_ROUGH = DetectorConfig(focal_length=260.0)
"""Half the usual resolution is enough for the table until the recogniser has answered."""

_MOST_HURRIED = 8
"""Frames in a row that may be taken in a hurry."""


@dataclass(frozen=True)
class PaceConfig(Checked):
    """What the tracker waits for, and when it hurries."""

    wait: bool = False
    """Wait with the first frame for the recogniser's complete answer, as lockstep does; otherwise
    the hand is followed from the first frame on, and objects join as they are recognised."""
    late: float = 0.03
    """A frame that waited this long for the one before it is taken in a hurry, because newer ones
    wait behind it: what can be put off is [s], 0.001..100."""


class TrackerNode(IntentNode):
    """Follows the hand, and the objects as they are recognised: one scene state per frame."""

    def __init__(self) -> None:
        super().__init__("tracker", ShareConfig(niceness=0, budget=30.0))
        self._database = declared_database(self)
        self._config, pace = declared(self, TrackerConfig()), declared(self, PaceConfig())
        self._waits, self._late, self._hurried = pace.wait, pace.late, 0
        self._tracker = Tracker(self._database, self._config)
        if self._tracker.trouble:
            self.get_logger().warning(self._tracker.trouble)
        self._states = self.create_publisher(SceneState, "intent/scene_state", RESULTS)
        self._joints = self.create_publisher(JointState, "intent/hand/joint_states", 10)
        self._tf = self.create_publisher(TFMessage, "tf", 100)
        # Apart: who looks later is told the objects, and the hand comes with every frame.
        self._names = declared(self, FrameNames())
        self._shown: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        self._markers = ResultOnDemand(self, MarkerArray, "intent/markers", self._object_markers)
        self._hand_markers = self.create_publisher(MarkerArray, "intent/hand/markers", 10)
        self._workshop = aside()
        rehearse(self._tracker, self._database.example)
        self.reset()
        listen_for_objects(
            self, "intent/objects", "intent/shapes", self._database, self._on_objects
        )
        self._frames = FrameSubscription(self, self._on_frame)

    def reset(self) -> None:
        """Forget hand and objects; the next recognised objects start the tracker again."""
        self._tracker.forget_hand()
        self._started, self._shape_kept, self._alone = False, False, False
        self._answers: deque[tuple[recognized.RecognizedObjects, Future[None]]] = deque()
        self._shown = (), ()
        self._held: RgbdFrame | None = None
        self._markers.renew()
        self._hand_markers.publish(MarkerArray(markers=[deletion("hand")]))

    def _on_objects(self, objects: recognized.RecognizedObjects, _: Any) -> None:
        """Take an answer; the shapes of objects that are new are prepared beside the frames."""
        if self._waits and not objects.complete:
            return
        task = self._workshop.submit(self._tracker.prepare, objects)
        self._answers.append((objects, task))
        if self._waits:
            task.result()
        if self._held is not None:  # the frame that came before its objects
            frame, self._held = self._held, None
            self.attempt(self._on_frame, frame, header_at(frame.stamp))

    def _take_answers(self, frame: RgbdFrame) -> None:
        """Give the tracker the newest answer whose shapes are ready.

        An answer to this very frame counts from the next one on, so that it does not matter which
        of the two arrives first.
        """
        newest = None
        while self._answers and self._answers[0][1].done():
            if self._started and self._answers[0][0].stamp >= frame.stamp:
                break
            newest, task = self._answers.popleft()
            task.result()
        if newest is None:
            return
        if self._started:
            self._tracker.join(newest)
        else:
            self._begin(newest)
        if newest.complete and not newest.objects and not self._alone:
            what = "known object" if newest.table_seen else "table"
            self.get_logger().warning(f"no {what} is seen: the hand is followed alone")
        self._alone = newest.complete and not newest.objects

    def _begin(self, objects: recognized.RecognizedObjects) -> None:
        self._tracker.start(objects)
        self._started = True

    def _on_frame(self, frame: RgbdFrame) -> bool:
        self._take_answers(frame)
        if not self._started and self._waits:
            self._held = frame
            return False
        if not self._started:
            self._begin(replace(recognized.table_alone(frame, _ROUGH), complete=False))
        state = self._tracker.step(frame, self._hurries())
        self._states.publish(state_to_msg(state, self._frames.frame_id, self._names.table_frame))
        if state.hand_tracked:
            self._joints.publish(joints_to_msg(state, self._names.table_frame))
        self._tf.publish(scene_transforms(state, self._names))
        self._keep_shape()
        self._show(state)
        return True

    def _hurries(self) -> bool:
        """Return whether this frame is taken in a hurry: the last of a few never is.

        In lockstep none is, so that the same bag gives the same answer.
        """
        late = self._frames.waited > self._late and not self._waits
        self._hurried = self._hurried + 1 if late and self._hurried < _MOST_HURRIED else 0
        return self._hurried > 0

    def _show(self, state: Any) -> None:
        """Publish the objects' meshes when there are others, and the hand while somebody looks."""
        if (state.object_ids, state.object_models) != self._shown:
            self._shown = state.object_ids, state.object_models
            self._markers.renew()
        if self._hand_markers.get_subscription_count():
            self._hand_markers.publish(hand_markers(state, self._names))

    def _object_markers(self) -> MarkerArray:
        """Return the meshes of the objects that are shown, after word to forget earlier ones."""
        names = zip(*self._shown, strict=True)
        models = [(name, self._database[model]) for name, model in names]
        return object_markers(models, self._names)

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
