"""ROS node: RGB-D frames in, the known objects on the table out."""

from intent_msgs.msg import RecognizedObjects
from tf2_msgs.msg import TFMessage

from intent_perception.camera import RgbdFrame
from intent_perception.convert import header_at, objects_to_msg, transforms_to_msg
from intent_perception.recognition import Recognizer, RecognizerConfig
from intent_perception.ros import (
    LATCHED,
    FrameSubscription,
    IntentNode,
    declared,
    declared_database,
    run,
)


class RecognizerNode(IntentNode):
    """Recognises the objects while no hand is near them and publishes each new answer."""

    def __init__(self) -> None:
        super().__init__("recognizer")
        self._database = declared_database(self)
        self._recognizer = Recognizer(self._database, declared(self, RecognizerConfig()))
        self._publisher = self.create_publisher(RecognizedObjects, "/intent/objects", LATCHED)
        self._tf = self.create_publisher(TFMessage, "/tf_static", LATCHED)
        self._frames = FrameSubscription(self, self._on_frame)

    def reset(self) -> None:
        """Forget the held answer."""
        self._recognizer.reset()

    def _on_frame(self, frame: RgbdFrame) -> None:
        objects = self._recognizer.step(frame)
        if objects is None:  # a hand is near, or nothing has changed
            return
        camera = self._frames.frame_id
        transform = transforms_to_msg(header_at(objects.stamp), [(camera, objects.T_table_camera)])
        self._tf.publish(transform)
        self._publisher.publish(objects_to_msg(objects, self._database, camera))


def main() -> None:
    """Run the node until Ctrl-C."""
    run(RecognizerNode)
