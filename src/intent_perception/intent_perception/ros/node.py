"""What all nodes share of ROS: parameters, a node that survives bad input, RGB-D frames, run."""

import gc
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Literal, NoReturn

import cv2
import rclpy
import rclpy.logging
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions, install_signal_handlers
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from threadpoolctl import threadpool_limits

from intent_perception.bags.frame_assembly import (
    NANOSECONDS,
    FrameMessages,
    FrameSynchroniser,
    ImageConfig,
    Straight,
    SynchroniserConfig,
)
from intent_perception.basics.orphaned_files import drop_shared_memory
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
from intent_perception.ros.input_watch import InputWatch
from intent_perception.ros.live_messages import LiveMessages
from intent_perception.ros.node_help import node_help
from intent_perception.ros.step_health import WARN, StepHealth

_PREPARING = 10
"""How far the preparation of things stands back for the frames: a niceness."""
RESULTS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""Results arrive all, also at a consumer that is slow for a while."""
NEWS = QoSProfile(
    depth=1000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""What is latched, to a consumer that is slow for a while: a grasp's answer is followed by one for
every frame of the motion."""
LATCHED = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Results that a late joiner needs, and queues of those who hear them."""


@dataclass(frozen=True)
class DatabaseConfig(Checked):
    """Which objects a node knows."""

    models: str = ""
    """Object database: a YAML file or a folder with one, added to the shipped 48 objects unless it
    says `only: true`; empty: the shipped ones alone."""


@dataclass(frozen=True)
class ShareConfig(Checked):
    """A node's share of the processor; together the five keep up with a camera on two cores."""

    niceness: int = 5
    """How far this node stands back for the tracker, which must keep up with the camera, 0..19."""
    budget: float = 6.0
    """CPU time that it may take for each frame of a camera of 30 Hz [ms]; diagnostics warn when
    it takes more over ten seconds; 0.1..1000."""


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
    0.2..3600."""
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
    database = ObjectDatabase.load(declared(node, DatabaseConfig()).models or None)
    for note in database.notes:
        node.get_logger().warning(note)
    return database


class IntentNode(Node):
    """A node with ~/enable, ~/reset, ~/processed and diagnostics that no message can bring down.

    `~/processed` carries the header of every input that has been dealt with, whether or not
    anything came of it: lockstep waits for it. `~/ready` is sent once, when the node has loaded all
    that it needs and answers its first input as fast as any other.
    """

    def __init__(self, name: str, share: ShareConfig | None = None) -> None:
        super().__init__(name)
        self._share = declared(self, share or ShareConfig())
        stand_back(self._share.niceness)
        self.enabled = True
        self.inputs: FrameSubscription | None = None
        self._health, self._watch = StepHealth(), InputWatch(self)
        self._processed = self.create_publisher(Header, "~/processed", LATCHED)
        self._ready = self.create_publisher(Header, "~/ready", LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_service(SetBool, "~/enable", self._on_enable)
        self.create_service(Trigger, "~/reset", self._on_reset)
        # Of a clock that goes on where simulated time stands still.
        self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def announce(self) -> None:
        """Say that the node is ready."""
        self._ready.publish(Header(stamp=self.get_clock().now().to_msg()))
        self.get_logger().info("ready")

    def reset(self) -> None:
        """Forget the past, as after a start; nodes with a memory override it."""

    def rehearse_rare(self) -> None:
        """Go once through what few runs need; set-up has it compiled. Some nodes override it."""

    def close(self) -> None:
        """Put in order what is open when the node ends; nodes with files or doors override it."""

    def listen(self, kind: Any, topic: str, callback: Callable[[Any], Any], qos: Any) -> None:
        """Subscribe to results of other nodes; a message that cannot be used costs one warning."""
        self._watch.add(self.resolve_topic_name(topic))
        self.create_subscription(
            kind, topic, lambda message: self.attempt(callback, message, message.header), qos
        )

    def listen_for_news(self, kind: Any, topic: str, callback: Callable[[Any], Any]) -> None:
        """Subscribe to a latched topic of events, each of which is answered once.

        What was said before this node was started has been answered by the one before it: it is
        left aside, and so is a message that comes a second time.
        """
        live = LiveMessages()
        self._watch.add(self.resolve_topic_name(topic))

        def take(message: Any, info: Any) -> None:
            if live.is_news(info):
                self.attempt(callback, message, message.header)
            else:
                self.get_logger().info(f"left aside what {topic} said earlier", once=True)

        self.create_subscription(kind, topic, take, NEWS)

    def attempt(self, callback: Callable[[Any], Any], argument: Any, header: Any) -> None:
        """Run one step, time it, and warn instead of dying where the input is bad.

        A callback that returns False answers later and acknowledges its input then.
        """
        if not self.enabled:
            return
        start, answered, failed = time.perf_counter(), True, True
        try:
            answered = callback(argument) is not False
            failed = False
        except ValueError as error:
            self.reject(str(error))
        except Exception as error:  # a bad frame must not end the node
            self.reject(f"{type(error).__name__}: {error}", traceback.format_exc())
        self._health.note_step(time.perf_counter() - start, failed)
        if answered:
            self.acknowledge(header)

    def note_step(self, seconds: float) -> None:
        """Count a step that went well and took so long [s]."""
        self._health.note_step(seconds, failed=False)

    def acknowledge(self, header: Any) -> None:
        """Say that the input with this header has been dealt with."""
        self._processed.publish(header)

    def reject(self, reason: str, trace: str = "") -> None:
        """Warn about an input that was left out; the same reason again is only counted.

        Args:
            reason: one sentence.
            trace: where it happened, for what nobody has foreseen.
        """
        if self._health.note_failure(reason):
            told = f"left out one input: {reason}"
            if trace:
                self.get_logger().error(f"{told}\n{trace}")
            else:
                self.get_logger().warning(told)

    def _on_enable(self, request: Any, response: Any) -> Any:
        self.enabled = bool(request.data)
        response.success, response.message = True, "enabled" if self.enabled else "disabled"
        return response

    def _on_reset(self, _: Any, response: Any) -> Any:
        if self.inputs is not None:
            self.inputs.synchroniser.reset()
        self._health.forget()
        self.reset()
        response.success, response.message = True, "reset"
        return response

    def _report(self) -> None:
        level, message, values = self._health.report()
        cpu = self._health.cpu_per_frame()
        values["CPU per frame at 30 Hz [ms]"] = round(cpu, 1)
        if self.inputs is not None:
            values["images without partner"] = self.inputs.synchroniser.dropped
            values["frames that came while busy"] = self.inputs.skipped
        missing = [self.inputs.waiting()] if self.inputs is not None else []
        waiting = "; ".join(filter(None, [*missing, self._watch.waiting()]))
        over = f"{cpu:.0f} ms of CPU per frame, the budget is {self._share.budget:g} ms"
        troubles = [
            (not self.enabled, "disabled"),
            (bool(waiting), waiting),
            (cpu > self._share.budget, over),
        ]
        for holds, text in troubles:
            if holds and level < WARN:
                level, message = WARN, text
        status = DiagnosticStatus(name=self.get_fully_qualified_name()[1:], message=message)
        status.level = bytes([level])
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)


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
        self._period, self._newest = 0, -1
        self._jumps, self._two_senders = 0, False
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
            lambda message: self._take(name, add, message),
            qos,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=warn),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def _take(self, topic: str, add: Callable[[Any], FrameMessages | None], message: Any) -> None:
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
        gap = (messages.stamp - self._newest) / NANOSECONDS
        if self._newest >= 0 and gap > self._config.pause:
            self._start_over(f"nothing was seen for {gap:.1f} s")
        self.frame_id = messages.depth.header.frame_id or self.frame_id
        self._count_skipped(messages.stamp)
        header = Header(frame_id=self.frame_id)
        header.stamp.sec, header.stamp.nanosec = divmod(messages.stamp, NANOSECONDS)
        if self._wanted(messages.stamp):
            self._node.attempt(lambda one: self._on_frame(_checked(one)), messages, header)
        else:
            self._node.acknowledge(header)
        self._quiet_since, self._warned = time.monotonic(), False

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


def guarded(node: Node, topic: str, callback: Callable[[Any], Any]) -> Callable[[Any], None]:
    """Return a callback that warns about a message which cannot be used, instead of dying."""

    def take(message: Any) -> None:
        try:
            callback(message)
        except ValueError as error:
            node.get_logger().warning(f"left out one message on {topic}: {error}")
        except Exception as error:  # nobody's message may end another's node
            told = f"left out one message on {topic}: {type(error).__name__}: {error}"
            node.get_logger().error(f"{told}\n{traceback.format_exc()}")

    return take


def stand_back(niceness: int) -> None:
    """Lower the priority of the calling thread, and of those that it starts, to a niceness."""
    thread = threading.get_native_id()
    os.setpriority(os.PRIO_PROCESS, thread, max(niceness, os.getpriority(os.PRIO_PROCESS, thread)))


def aside() -> ThreadPoolExecutor:
    """Return one thread that prepares things beside the frames, and stands back for them."""
    return ThreadPoolExecutor(1, initializer=lambda: stand_back(_PREPARING))


def _checked(messages: FrameMessages) -> RgbdFrame:
    """Return the frame of messages; ValueError where it cannot be decoded or shows nothing."""
    frame = messages.decoded()
    if not frame.depth.any():
        raise ValueError("the depth image holds no measurement (all zero or NaN)")
    return frame


def _leave(number: int, _: Any) -> NoReturn:
    """End at once: while a node is set up there is nothing to put in order."""
    os._exit(128 + number)


def run(kind: Callable[[], IntentNode]) -> None:
    """Run a node until Ctrl-C; a wrong parameter or file ends it with one sentence.

    With `--rehearse` it ends when it is ready: set-up has kernels compiled so.
    """
    if {"-h", "--help"} & set(sys.argv):
        sys.stdout.write(node_help(kind))
        return
    cv2.setNumThreads(1)  # five nodes share the cores; more threads only wait for each other
    threadpool_limits(1)
    usual = {number: signal.signal(number, _leave) for number in (signal.SIGINT, signal.SIGTERM)}
    drop_shared_memory()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node: IntentNode | None = None
    try:
        node = kind()
        gc.freeze()  # what has been loaded stays; looking through it would hold up a frame
        for number, handler in usual.items():
            signal.signal(number, handler)
        install_signal_handlers()
        if "--rehearse" in sys.argv:
            node.rehearse_rare()
        else:
            node.announce()
            rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except ValueError as error:
        rclpy.logging.get_logger("intent").fatal(str(error))
        raise SystemExit(1) from None
    except Exception:
        if rclpy.ok():  # otherwise a signal has ended it, and what it was about to say is void
            raise
    finally:
        if node is not None:
            node.close()
            node.destroy_node()  # with its shared memory
        rclpy.try_shutdown()
