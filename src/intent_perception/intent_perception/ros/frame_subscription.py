"""RGB-D frames as a node hears them: what belongs together, what was lost, how long it waited."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from intent_perception.bags.frame_assembly import (
    NANOSECONDS,
    FrameMessages,
    FrameSynchroniser,
    ImageConfig,
    Straight,
    SynchroniserConfig,
)
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.coded_images import rehearse_depth
from intent_perception.ros.declared import declared
from intent_perception.ros.node import IntentNode

_FASTEST = 10.0
"""Recordings are played at most so many times as fast as they were made."""


@dataclass(frozen=True)
class InputConfig(Checked):
    """How a node's images arrive."""

    color_transport: Literal["raw", "compressed"] = "raw"
    """How colour images are sent: raw or compressed."""
    depth_transport: Literal["raw", "compressedDepth", "compressed"] = "raw"
    """How depth images are sent: raw, compressedDepth, or compressed as PNG of 16 bits."""
    queue: int = 3
    """Images kept while a step runs: what arrives beyond is dropped, the oldest first; 1..1000."""
    silence: float = 5.0
    """Time without a frame after which the node says what it is waiting for [s], 0 = never,
    0..3600."""
    reliable: bool = False
    """Ask senders to repeat what is lost on the way, as lockstep needs it; a camera that sends as
    best it can is then not heard."""
    pause: float = 2.0
    """After a gap in the stamps this long everything is begun anew, as with another recording [s];
    what passed while the node was busy is no gap; 0.2..3600."""
    synchroniser: SynchroniserConfig = field(default_factory=SynchroniserConfig)
    """Which images belong together."""


class FrameSubscription:
    """Subscribes to colour, depth and camera_info and hands over the frames they make."""

    def __init__(
        self,
        node: IntentNode,
        on_frame: Callable[[RgbdFrame], Any],
        wanted: Callable[[int], bool] = lambda _: True,
    ) -> None:
        """Subscribe.

        Args:
            node: whose parameters say how images arrive.
            on_frame: takes a frame; False if it will be acknowledged later.
            wanted: whether the frame of a stamp [ns] is looked at; others are not even decoded.
        """
        self._node, self._on_frame, self._wanted = node, on_frame, wanted
        self._config, images = declared(node, InputConfig()), declared(node, ImageConfig())
        color = images.straight(node.resolve_topic_name("rgb/image_rect_color"), "color")
        depth = images.straight(node.resolve_topic_name("depth_registered/image_rect"), "depth")
        self.synchroniser = FrameSynchroniser(
            self._config.synchroniser, images.depth_scale, Straight(color, depth)
        )
        node.inputs = self
        self.skipped = 0
        """Frames that the camera sent and that never arrived: the node was busy."""
        self.waited = 0.0
        """How long the newest frame lay here before it was taken [s]; 0 where nobody says so."""
        self._period, self._newest = 0, -1
        self._jumps, self._two_senders = 0, False
        self._taken = self._quiet_since = time.monotonic()
        self._warned = False
        self.topics: list[str] = []
        self.frame_id = "camera_color_optical_frame"
        add, config = self.synchroniser, self._config
        rehearse_depth()
        self._subscribe("rgb/image_rect_color", config.color_transport, add.add_color)
        self._subscribe("depth_registered/image_rect", config.depth_transport, add.add_depth)
        self._listen(CameraInfo, "rgb/camera_info", add.add_info)

    def _subscribe(self, topic: str, transport: str, add: Callable[[Any], Any]) -> None:
        if transport == "raw":
            self._listen(Image, topic, add)
        else:
            self._listen(CompressedImage, f"{topic}/{transport}", add)

    def _listen(self, kind: Any, topic: str, add: Callable[[Any], FrameMessages | None]) -> None:
        name = self._node.resolve_topic_name(topic)
        self.topics.append(name)
        way = ReliabilityPolicy.BEST_EFFORT
        if self._config.reliable:
            way = ReliabilityPolicy.RELIABLE
        qos = QoSProfile(depth=self._config.queue, reliability=way)

        def warn(event: Any) -> None:
            self._node.get_logger().warning(
                f"{name} is published with an incompatible QoS ({event.last_policy_kind}); "
                "change the publisher's or set the parameters qos_overrides"
            )

        self._node.create_subscription(
            kind,
            topic,
            lambda message, info: self._take(name, add, message, info),
            qos,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=warn),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def _take(
        self, topic: str, add: Callable[[Any], FrameMessages | None], message: Any, info: Any
    ) -> None:
        if not self._node.enabled:
            return
        try:
            messages = add(message)
        except Exception as error:  # an odd message must not end the node
            self._node.reject(f"{topic}: {error}")
            return
        self._warn_of_two_senders(topic)
        if self.synchroniser.jumps != self._jumps:
            self._jumps = self.synchroniser.jumps
            self._start_over("the clock went back")
        if messages is None:
            return
        gap = self._unseen(messages.stamp)
        if gap > self._config.pause:
            self._start_over(f"nothing was seen for {gap:.1f} s")
        self.frame_id = messages.depth.header.frame_id or self.frame_id
        self._count_skipped(messages.stamp)
        arrived = info["received_timestamp"]
        self.waited = (time.time_ns() - arrived) / NANOSECONDS if arrived else 0.0
        header = Header(frame_id=self.frame_id)
        header.stamp.sec, header.stamp.nanosec = divmod(messages.stamp, NANOSECONDS)
        if self._wanted(messages.stamp):
            self._node.attempt(lambda one: self._on_frame(_checked(one)), messages, header)
        else:
            self._node.acknowledge(header)
        self._quiet_since, self._warned = time.monotonic(), False

    def _unseen(self, stamp: int) -> float:
        """Return for how long nothing was seen before the frame of a stamp [s]; 0 for the first.

        What the camera sent while a step ran was dropped by the queue, and counts as seen.
        """
        before, self._taken = self._taken, time.monotonic()
        if self._newest < 0:
            return 0.0
        gap, busy = (stamp - self._newest) / NANOSECONDS, self._quiet_since - before
        share = busy / max(self._taken - before, busy, 1e-9)
        return gap - min(share * gap, _FASTEST * busy)

    def _warn_of_two_senders(self, topic: str) -> None:
        """Say once that images of two clocks come, and which are followed."""
        two = self.synchroniser.two_senders
        if two and not self._two_senders:
            self._node.get_logger().warning(
                f"images of two clocks come on {topic} ({self._node.count_publishers(topic)} "
                "publishers): those with the older stamps are left out"
            )
        self._two_senders = two

    def _start_over(self, reason: str) -> None:
        self._newest = -1
        self._node.get_logger().info(f"{reason}: starting over")
        self._node.reset()

    def _count_skipped(self, stamp: int) -> None:
        """Count the frames that are missing between the last one and this."""
        gap = stamp - self._newest
        if self._newest >= 0 and gap > 0:
            self._period = min(self._period, gap) if self._period else gap
            self.skipped += max(0, round(gap / self._period) - 1)
        self._newest = stamp

    def waiting(self) -> str:
        """Return what a node without frames is waiting for; warn about it once."""
        quiet = time.monotonic() - self._quiet_since
        silence = self._config.silence
        if not self._node.enabled or silence <= 0.0 or quiet < silence:
            return ""
        missing = self.synchroniser.missing
        what = ", ".join(missing) if missing else "colour and depth of the same time"
        seen = ", ".join(f"{t}: {self._node.count_publishers(t)}" for t in self.topics)
        text = f"no frame for {silence:g} s, waiting for {what}; publishers: {seen}"
        if not self._warned:
            self._warned = True
            self._node.get_logger().warning(text)
        return text


def _checked(messages: FrameMessages) -> RgbdFrame:
    """Return the frame of messages; ValueError where it cannot be decoded or shows nothing."""
    frame = messages.decoded()
    if not frame.depth.any():
        raise ValueError("the depth image holds no measurement (all zero or NaN)")
    return frame
