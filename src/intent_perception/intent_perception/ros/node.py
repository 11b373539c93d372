"""What all nodes share of ROS: parameters, a node that survives bad input, RGB-D frames, run."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import rclpy
import rclpy.logging
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from intent_perception.bags.frame_assembly import NANOSECONDS, FrameSynchroniser, SynchroniserConfig
from intent_perception.basics.parameters import (
    Checked,
    Kind,
    Parameter,
    as_field,
    parameters_of,
    refusal,
    with_values,
)
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase

RESULTS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""Results arrive all, also at a consumer that is slow for a while."""
LATCHED = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Results that a late joiner needs."""


@dataclass(frozen=True)
class DatabaseConfig(Checked):
    """Which objects a node knows."""

    models: str = ""
    """Object database: a YAML file or a folder with one; empty: the shipped 48 objects."""


@dataclass(frozen=True)
class InputConfig(Checked):
    """How a node's images arrive."""

    color_transport: Literal["raw", "compressed"] = "raw"
    """How colour images are sent: raw or compressed."""
    depth_transport: Literal["raw", "compressedDepth"] = "raw"
    """How depth images are sent: raw or compressedDepth."""
    queue: int = 1
    """Images kept while a step runs, 1 for a live camera, 1..1000."""
    silence: float = 5.0
    """Time without a frame after which the node says what it is waiting for [s], 0 = never,
    0..3600."""
    synchroniser: SynchroniserConfig = field(default_factory=SynchroniserConfig)
    """Which images belong together."""


def declared[C](node: Node, config: C, prefix: str = "") -> C:
    """Return a configuration as the node's parameters set it, each declared with its description.

    Raises:
        ValueError: if a parameter has the wrong type or is out of range.
    """
    values = {p.name: _declared_one(node, p) for p in parameters_of(config, prefix)}
    result: C = with_values(config, values, prefix)
    return result


def _declared_one(node: Node, parameter: Parameter) -> Any:
    """Return a parameter, declared in two steps: rclpy's own refusal does not say what it got."""
    name, kind = parameter.name, parameter.kind
    default = "" if parameter.default is None else parameter.default
    default = RosParameter(name, value=list(default) if kind.many else default)
    loose = ParameterDescriptor(dynamic_typing=True)
    value = as_field(kind, node.declare_parameter(name, default.value, loose).value)
    if not kind.allows(value):
        raise ValueError(refusal(f"parameter {name}", kind, value))
    ros_value = "" if value is None else list(value) if kind.many else value
    chosen = RosParameter(name, default.type_, ros_value).get_parameter_value()
    node.set_descriptor(name, _descriptor(kind, default.type_.value), chosen)
    return value


def _descriptor(kind: Kind, ros_type: int) -> ParameterDescriptor:
    """Return description, type and range as `ros2 param describe` shows them."""
    found = ParameterDescriptor(description=kind.description, type=ros_type, read_only=True)
    if kind.choices:
        found.additional_constraints = " or ".join(kind.choices)
    if kind.range is not None and not kind.many:
        low, high, step = kind.range.low, kind.range.high, kind.range.step
        if kind.type is int:
            bounds = IntegerRange(from_value=int(low), to_value=int(high), step=step)
            found.integer_range = [bounds]
        else:
            found.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return found


def declared_database(node: Node) -> ObjectDatabase:
    """Return the object database that the parameter `models` names; empty: the shipped one."""
    return ObjectDatabase.load(declared(node, DatabaseConfig()).models or None)


class IntentNode(Node):
    """A node with ~/enable, ~/reset, ~/processed and diagnostics that no message can bring down.

    `~/processed` carries the header of every input that has been dealt with, whether or not
    anything came of it: lockstep waits for it.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.enabled = True
        self.inputs: FrameSubscription | None = None
        self._seconds: deque[float] = deque(maxlen=300)
        self._count, self._reported, self._bad, self._last_error = 0, 0, 0, ""
        self._processed = self.create_publisher(Header, "~/processed", LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_service(SetBool, "~/enable", self._on_enable)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_timer(1.0, self._report)

    def reset(self) -> None:
        """Forget the past, as after a start; nodes with a memory override it."""

    def listen(self, kind: Any, topic: str, callback: Callable[[Any], Any], qos: Any) -> None:
        """Subscribe to results of other nodes; a message that cannot be used costs one warning."""
        self.create_subscription(
            kind, topic, lambda message: self.attempt(callback, message, message.header), qos
        )

    def attempt(self, callback: Callable[[Any], Any], argument: Any, header: Any) -> None:
        """Run one step, time it, and warn instead of dying where the input is bad.

        A callback that returns False answers later and acknowledges its input then.
        """
        if not self.enabled:
            return
        start, answered = time.perf_counter(), True
        try:
            answered = callback(argument) is not False
        except ValueError as error:
            self.reject(str(error))
        except Exception as error:  # a bad frame must not end the node
            self.reject(f"{type(error).__name__}: {error}")
        self._seconds.append(time.perf_counter() - start)
        self._count += 1
        if answered:
            self.acknowledge(header)

    def acknowledge(self, header: Any) -> None:
        """Say that the input with this header has been dealt with."""
        self._processed.publish(header)

    def reject(self, reason: str) -> None:
        """Warn about an input that was left out; the same reason again is only counted."""
        self._bad += 1
        if reason != self._last_error:
            self.get_logger().warning(f"left out one input: {reason}")
        self._last_error = reason

    def _on_enable(self, request: Any, response: Any) -> Any:
        self.enabled = bool(request.data)
        response.success, response.message = True, "enabled" if self.enabled else "disabled"
        return response

    def _on_reset(self, _: Any, response: Any) -> Any:
        if self.inputs is not None:
            self.inputs.synchroniser.reset()
        self._last_error = ""
        self.reset()
        response.success, response.message = True, "reset"
        return response

    def _report(self) -> None:
        rate, self._reported = self._count - self._reported, self._count
        dropped = self.inputs.synchroniser.dropped if self.inputs is not None else 0
        ordered = sorted(self._seconds) or [0.0]
        values = {
            "rate [Hz]": rate,
            "step median [ms]": round(1e3 * ordered[len(ordered) // 2], 2),
            "step p95 [ms]": round(1e3 * ordered[int(0.95 * (len(ordered) - 1))], 2),
            "steps": self._count,
            "inputs left out": self._bad,
            "images without partner": dropped,
            "last warning": self._last_error,
        }
        status = DiagnosticStatus(name=self.get_name(), hardware_id="", message="ok")
        status.level = DiagnosticStatus.OK
        waiting = self.inputs.waiting() if self.inputs is not None else ""
        if waiting or not self.enabled:
            status.level, status.message = DiagnosticStatus.WARN, waiting or "disabled"
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)


class FrameSubscription:
    """Subscribes to colour, depth and camera_info and hands over the frames they make."""

    def __init__(self, node: IntentNode, on_frame: Callable[[RgbdFrame], Any]) -> None:
        self._node, self._on_frame = node, on_frame
        self._config = declared(node, InputConfig())
        self.synchroniser = FrameSynchroniser(self._config.synchroniser)
        node.inputs = self
        self._jumps = 0
        self._quiet_since, self._warned = time.monotonic(), False
        self.topics: list[str] = []
        self.frame_id = "camera_color_optical_frame"
        add, config = self.synchroniser, self._config
        self._subscribe("rgb/image_rect_color", config.color_transport, add.add_color)
        self._subscribe("depth_registered/image_rect", config.depth_transport, add.add_depth)
        self._listen(CameraInfo, "rgb/camera_info", add.add_info)

    def _subscribe(self, topic: str, transport: str, add: Callable[[Any], Any]) -> None:
        if transport == "raw":
            self._listen(Image, topic, add)
        else:
            self._listen(CompressedImage, f"{topic}/{transport}", add)

    def _listen(self, kind: Any, topic: str, add: Callable[[Any], RgbdFrame | None]) -> None:
        name = self._node.resolve_topic_name(topic)
        self.topics.append(name)
        qos = QoSProfile(depth=self._config.queue, reliability=ReliabilityPolicy.BEST_EFFORT)

        def warn(event: Any) -> None:
            self._node.get_logger().warning(
                f"{name} is published with an incompatible QoS ({event.last_policy_kind}); "
                "change the publisher's or set the parameters qos_overrides"
            )

        self._node.create_subscription(
            kind,
            topic,
            lambda message: self._take(add, message),
            qos,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=warn),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def _take(self, add: Callable[[Any], RgbdFrame | None], message: Any) -> None:
        if not self._node.enabled:
            return
        try:
            frame = add(message)
        except ValueError as error:
            self._node.reject(str(error))
            self._node.acknowledge(message.header)
            return
        if self.synchroniser.jumps != self._jumps:
            self._jumps = self.synchroniser.jumps
            self._node.get_logger().info("the clock went back: starting over")
            self._node.reset()
        if frame is None:
            return
        self.frame_id = message.header.frame_id or self.frame_id
        if not frame.depth.any():
            self._node.reject("the depth image holds no measurement (all zero or NaN)")
            self._node.acknowledge(message.header)
        else:
            header = Header(frame_id=message.header.frame_id)
            header.stamp.sec, header.stamp.nanosec = divmod(frame.stamp, NANOSECONDS)
            self._node.attempt(self._on_frame, frame, header)
        self._quiet_since, self._warned = time.monotonic(), False

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


def run(kind: Callable[[], Node]) -> None:
    """Run a node until Ctrl-C; a wrong parameter or file ends it with one sentence."""
    rclpy.init()
    try:
        node = kind()
        rclpy.spin(node)
    except ValueError as error:
        rclpy.logging.get_logger("intent").fatal(str(error))
        raise SystemExit(1) from None
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
