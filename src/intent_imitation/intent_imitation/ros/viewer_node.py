"""ROS node: what the system believes, drawn into the camera's picture, for whoever looks."""

import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from intent_msgs import msg as msgs
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from intent_imitation.live.belief import BeliefKeeper
from intent_imitation.live.live_picture import live_picture
from intent_imitation.live.live_server import LiveServer
from intent_imitation.ros.convert import plan_from_msg
from intent_inference.ros.convert import posterior_from_msg
from intent_perception.bags.frame_assembly import ImageConfig, color_from, stamp_of
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.lens import camera_from, lens_from
from intent_perception.objects.model import ObjectModel
from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.node import LATCHED, RESULTS, IntentNode, ShareConfig, guarded, run
from intent_perception.ros.shaped_objects import learn_shapes
from intent_tracking.ros.convert import state_from_msg

_ALONE = 1.0
"""Without the tracker for so long the picture is shown as it comes [s]."""


@dataclass(frozen=True)
class ViewerConfig(Checked):
    """Who sees the picture, and how often."""

    port: int = 0
    """Port of the web page on 127.0.0.1; 0: there is none; 0..65535."""
    rate: float = 8.0
    """Most pictures in a second while somebody looks, 0.1..30."""
    quality: int = 80
    """Quality of the JPEG, 1..100."""
    color_transport: Literal["raw", "compressed"] = "raw"
    """How colour images are sent: raw or compressed."""


class ViewerNode(IntentNode):
    """Draws while somebody listens to the picture or has the page open, and hears nothing else."""

    def __init__(self) -> None:
        super().__init__("viewer", ShareConfig(niceness=10, budget=20.0))
        self._config, self._database = declared(self, ViewerConfig()), declared_database(self)
        topic = self.resolve_topic_name("rgb/image_rect_color")
        self._straight = declared(self, ImageConfig()).straight(topic, "color")
        self._keeper, self._colors = BeliefKeeper(), deque[Any](maxlen=40)
        self._info: Any = None
        self._jpeg, self._count, self._drawn, self._told = b"", 0, 0.0, time.monotonic()
        self._publisher = self.create_publisher(CompressedImage, "intent/image/compressed", 1)
        self._ears: list[Any] = []
        learn_shapes(self, "intent/shapes", self._database)
        port, page = self._config.port, None
        if port:
            page = LiveServer(port, lambda: self._jpeg, self._page_state)
            self.get_logger().info(f"http://127.0.0.1:{port} shows what the system believes")
        self._page = page
        self.create_timer(0.5, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def reset(self) -> None:
        """Forget what was believed."""
        self._keeper.forget()
        self._colors.clear()

    def close(self) -> None:
        """Close the page."""
        if self._page is not None:
            self._page.close()

    def _page_state(self) -> dict[str, Any]:
        return {**self._keeper.as_json(), "picture": self._count}

    def _look(self) -> None:
        """Begin or end to listen, as somebody begins or ends to look."""
        looked_at = self._publisher.get_subscription_count() > 0
        looked_at = looked_at or (self._page is not None and self._page.looked_at)
        if looked_at and not self._ears:
            self._listen()
        elif not looked_at and self._ears:
            for ear in self._ears:
                self.destroy_subscription(ear)
            self._ears = []
            self.reset()

    def _listen(self) -> None:
        camera = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        color, kind = "rgb/image_rect_color", Image
        if self._config.color_transport == "compressed":
            color, kind = f"{color}/compressed", CompressedImage
        for topic, of, take, qos in (
            (color, kind, self._on_color, camera),
            ("rgb/camera_info", CameraInfo, self._on_info, camera),
            ("intent/scene_state", msgs.SceneState, self._on_state, RESULTS),
            ("intent/task_posterior", msgs.TaskPosterior, self._on_posterior, LATCHED),
            ("intent/grasp_plan", msgs.GraspPlan, self._on_plan, LATCHED),
        ):
            ear = self.create_subscription(of, topic, guarded(self, topic, take), qos)
            self._ears.append(ear)

    def _on_info(self, message: Any) -> None:
        self._info = message

    def _on_posterior(self, message: Any) -> None:
        self._keeper.note_posterior(posterior_from_msg(message))

    def _on_plan(self, message: Any) -> None:
        self._keeper.note_plan(plan_from_msg(message))

    def _on_color(self, message: Any) -> None:
        self._colors.append(message)
        if time.monotonic() - self._told > _ALONE:
            self._keeper.lose_track()
            self._draw(message)

    def _on_state(self, message: Any) -> None:
        self._told = time.monotonic()
        self._keeper.note_state(state_from_msg(message))
        if self._colors:
            stamp = stamp_of(message)
            self._draw(min(self._colors, key=lambda color: abs(stamp_of(color) - stamp)))

    def _draw(self, message: Any) -> None:
        """Draw over a colour image and show it, unless the last picture was a moment ago."""
        now = time.monotonic()
        if self._info is None or now - self._drawn < 1.0 / self._config.rate:
            return
        self._drawn, start = now, time.perf_counter()
        color = color_from(message)
        if self._straight:
            camera = camera_from(self._info)
        else:
            lens = lens_from(self._info)
            camera, color = lens.camera, lens.rectified(color, nearest=False)
        picture = live_picture(color, camera, self._keeper.belief, self._model)
        bgr = np.ascontiguousarray(picture[..., ::-1])
        coded = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, self._config.quality])[1]
        self._jpeg, self._count = coded.tobytes(), self._count + 1
        shown = CompressedImage(header=message.header, format="jpeg", data=self._jpeg)
        self._publisher.publish(shown)
        self.note_step(time.perf_counter() - start)

    def _model(self, name: str) -> ObjectModel | None:
        return next((model for model in self._database.models if model.name == name), None)


def main() -> None:
    """Run the node until Ctrl-C."""
    run(ViewerNode)
