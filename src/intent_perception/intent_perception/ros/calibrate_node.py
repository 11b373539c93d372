"""ROS node: finds the camera over the table, publishes it on /tf_static and writes it to a file."""

from dataclasses import dataclass, field

from tf2_msgs.msg import TFMessage

from intent_perception.basics.parameters import Checked
from intent_perception.basics.safe_files import write_json
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.ros.camera_frames import CameraFrames, FramesConfig
from intent_perception.ros.declared import declared
from intent_perception.ros.frame_subscription import FrameSubscription
from intent_perception.ros.node import LATCHED, IntentNode, run
from intent_perception.scene.camera_calibration import CalibrationConfig, Chessboard, calibrate


@dataclass(frozen=True)
class CalibrateConfig(Checked):
    """What is looked for, and where the answer goes."""

    output: str = "calibration.json"
    """File that the recognizer's parameter `calibration` takes; empty: none is written."""
    use_board: bool = True
    """False: the table's plane in the depth image is enough."""
    board: Chessboard = field(default_factory=Chessboard)
    search: CalibrationConfig = field(default_factory=CalibrationConfig)


class CalibrateNode(IntentNode):
    """Calibrates once, from the first frame that shows what is looked for."""

    def __init__(self) -> None:
        super().__init__("calibrate")
        self._config = declared(self, CalibrateConfig())
        self._publisher = self.create_publisher(TFMessage, "tf_static", LATCHED)
        self._done = False
        self._around = CameraFrames(self, declared(self, FramesConfig()))
        self._frames = FrameSubscription(self, self._on_frame)

    def reset(self) -> None:
        """Calibrate again."""
        self._done = False

    def _on_frame(self, frame: RgbdFrame) -> None:
        if self._done:
            return
        board = self._config.board if self._config.use_board else None
        found = calibrate(frame, board, self._config.search)
        if found is None or (board is not None and found.source != "chessboard"):
            raise ValueError("neither board nor table is seen clearly; move camera, board or lamp")
        transform = self._around.message(frame.stamp, self._frames.frame_id, found.T_table_camera)
        if transform is None:  # /tf_static may still come
            return
        self._done = True
        self._publisher.publish(transform)
        if self._config.output:
            report = {"T_table_camera": found.T_table_camera.tolist(), "source": found.source}
            write_json(self._config.output, report, indent=2)
        self.get_logger().info(f"calibrated from the {found.source}: {self._config.output}")


def main() -> None:
    """Run the node until Ctrl-C."""
    run(CalibrateNode)
