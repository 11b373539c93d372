"""ROS node: RGB-D frames in, the known objects on the table out."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from intent_msgs.msg import RecognizedObjects
from tf2_msgs.msg import TFMessage

from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.recognition.recognizer import Recognizer, RecognizerConfig
from intent_perception.ros.convert import header_at, objects_to_msg, transforms_to_msg
from intent_perception.ros.node import (
    LATCHED,
    FrameSubscription,
    IntentNode,
    declared,
    declared_database,
    run,
)


@dataclass(frozen=True)
class CameraConfig(Checked):
    """Where the camera stands, and who says so."""

    calibration: str = ""
    """File that calibrate wrote; empty: the table is found in every image."""
    publish_camera: bool = True
    """Publish table -> camera on /tf_static; false where another node owns the camera."""


class RecognizerNode(IntentNode):
    """Recognises the objects while no hand is near them and publishes each new answer."""

    def __init__(self) -> None:
        super().__init__("recognizer")
        self._database = declared_database(self)
        camera, config = declared(self, CameraConfig()), declared(self, RecognizerConfig())
        self._owns_camera, file = camera.publish_camera, camera.calibration
        self._recognizer = Recognizer(self._database, config, calibration(file) if file else None)
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
        if self._owns_camera:
            pose = [(camera, objects.T_table_camera)]
            self._tf.publish(transforms_to_msg(header_at(objects.stamp), pose))
        self._publisher.publish(objects_to_msg(objects, self._database, camera))


def calibration(path: str) -> Any:
    """Return T_table_camera (4, 4) of a file that calibrate wrote; ValueError if it holds none."""
    try:
        pose = np.array(json.loads(Path(path).read_text())["T_table_camera"], dtype=np.float64)
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"cannot read the calibration {path}: {error}") from error
    if pose.shape != (4, 4):
        raise ValueError(f"expected T_table_camera 4 x 4 in {path}, got {pose.shape}")
    return pose


def main() -> None:
    """Run the node until Ctrl-C."""
    run(RecognizerNode)
