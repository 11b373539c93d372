"""ROS node: RGB-D frames in, the objects on the table out, known or estimated."""

from dataclasses import dataclass

from intent_msgs.msg import ObjectShapes, RecognizedObjects
from tf2_msgs.msg import TFMessage

from intent_perception.bags.frame_assembly import NANOSECONDS
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame, depth_advice
from intent_perception.recognition import recognizer as recognized
from intent_perception.recognition.recognizer import Recognizer, RecognizerConfig, things_alone
from intent_perception.recognition.rehearsal_scene import rehearsal_frames, rehearsal_things
from intent_perception.ros.camera_frames import CameraFrames, FramesConfig
from intent_perception.ros.convert import objects_to_msg
from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.frame_subscription import FrameSubscription
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import LATCHED, IntentNode, ShareConfig, run
from intent_perception.ros.shape_messages import shapes_to_msg
from intent_perception.scene.camera_calibration import read_calibration


@dataclass(frozen=True)
class CameraConfig(Checked):
    """Where the camera stands, and who says so."""

    calibration: str = ""
    """File that calibrate wrote; empty: the table is found in every image."""
    publish_camera: bool = True
    """Publish camera and table on /tf_static; false where another node owns the camera."""
    period: float = 0.25
    """Time between two looks at the scene [s], 0..60."""


class RecognizerNode(IntentNode):
    """Recognises the objects while no hand is near them and publishes each new answer."""

    def __init__(self) -> None:
        super().__init__("recognizer", ShareConfig(niceness=7, budget=14.0))
        self._database = declared_database(self)
        camera, config = declared(self, CameraConfig()), declared(self, RecognizerConfig())
        frames = declared(self, FramesConfig())
        self._table, self._frames_around = frames.table_frame, CameraFrames(self, frames)
        self._owns_camera, file = camera.publish_camera, camera.calibration
        self._period, self._looked = int(camera.period * NANOSECONDS), -1
        self._calibrated, self._warned = bool(file), False
        self._recognizer = Recognizer(
            self._database, config, read_calibration(file) if file else None
        )
        self._publisher = LatestResult(self, RecognizedObjects, "intent/objects")
        self._shapes = LatestResult(self, ObjectShapes, "intent/shapes")
        self._tf = self.create_publisher(TFMessage, "tf_static", LATCHED)
        self._rehearse()
        self._frames = FrameSubscription(self, self._on_frame, self._is_due)

    def reset(self) -> None:
        """Forget the held answer."""
        self._recognizer.reset()
        self._publisher.take_back()
        self._shapes.take_back()
        self._looked = -1

    def _rehearse(self) -> None:
        """Go through a rendered scene, so that the first real one finds everything loaded."""
        for frame in rehearsal_frames(self._database.example, 3):
            self._recognizer.step(frame)
        self._recognizer.reset()

    def rehearse_rare(self) -> None:
        """Estimate the shape of one thing of each class, as if none were known."""
        classes = {model.object_class: model for model in self._database}
        things_alone(rehearsal_things(list(classes.values())))

    def _is_due(self, stamp: int) -> bool:
        return self._looked < 0 or stamp - self._looked >= self._period

    def _on_frame(self, frame: RgbdFrame) -> None:
        self._looked = frame.stamp
        up = None if self._calibrated else self._frames_around.up(self._frames.frame_id)
        if up is not None:
            self._recognizer.up = up
        for objects in self._recognizer.looks(frame):  # none while nothing new can be said
            self._publish(objects)
            if objects.complete and not objects.table_seen and not self._warned:
                self._warned = True
                self.get_logger().warning(
                    "no table is seen: no object is searched for until one is; the hand is "
                    f"followed all the same{depth_advice(frame.depth)}"
                )

    def _publish(self, objects: recognized.RecognizedObjects) -> None:
        camera = self._frames.frame_id
        if self._owns_camera:
            pose = objects.T_table_camera
            message = self._frames_around.message(objects.stamp, camera, pose)
            if message is not None:
                self._tf.publish(message)
        if any(item.shape is not None for item in objects.objects):
            self._shapes.publish(
                shapes_to_msg(objects, self._table)
            )  # first: who hears both need not wait
        self._publisher.publish(objects_to_msg(objects, self._database, camera, self._table))


def main() -> None:
    """Run the node until Ctrl-C."""
    run(RecognizerNode)
