"""ROS node: plays a bag's images like `ros2 bag play`, or frame by frame with the tracker."""

import importlib
import sys
import time
from typing import Any

import rclpy
from intent_msgs.msg import RecognizedObjects, SceneState
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from intent_perception.bags.bag_files import BagMessage, image_topics
from intent_perception.bags.frame_assembly import NANOSECONDS, stamp_of
from intent_perception.bags.playback import Bundle, bundles, parse_options, target_topic
from intent_perception.ros.node import LATCHED, RESULTS, guarded

_GRACE = 0.2  # an answer that was sent before its acknowledgement may arrive after it [s]
_QUIET = 2.0  # a node that says nothing for so long has dealt with all it got [s]


class ReplayNode(Node):
    """Publishes stored messages byte by byte, in time or in lockstep."""

    def __init__(self, options: Any) -> None:
        super().__init__("replay")
        self._options, self._topics = options, image_topics(options.bag, options.topics)
        if options.lockstep and not self._topics.info:
            raise ValueError(f"bag {options.bag} has no camera_info: record that topic too")
        self._running, self._objects = not options.start_paused, False
        self._answered: dict[str, int] = {}
        self._ready: set[str] = set()
        self._heard = time.monotonic()
        follows = ("recognizer",) if options.objects_only else ("recognizer", "tracker")
        self._awaited = follows if options.lockstep else ()
        self._senders: dict[str, Any] = {}
        self._clock_sender = self.create_publisher(Clock, "/clock", 10) if options.clock else None
        self.create_service(Trigger, "~/resume", lambda _, r: self._run(True, r))
        self.create_service(Trigger, "~/pause", lambda _, r: self._run(False, r))
        # Relative names: a namespace makes it the player of another table.
        self.create_subscription(RecognizedObjects, "intent/objects", self._on_objects, LATCHED)
        self._answers("intent/scene_state", SceneState, "tracker")
        self._answers("tracker/processed", Header, "tracker", LATCHED)
        self._answers("recognizer/processed", Header, "recognizer", LATCHED)
        for name in {*options.nodes, *self._awaited}:
            self._listen_for(name)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def _listen_for(self, name: str) -> None:
        self.create_subscription(Header, f"{name}/ready", lambda _: self._ready.add(name), LATCHED)

    def play(self) -> int:
        """Play the bag (for ever with --loop); return the number of frames sent.

        Raises:
            ValueError: if nobody listens, or a frame is not answered in lockstep.
        """
        count = 0
        while True:
            start, self._objects = time.monotonic(), False
            for bundle in bundles(
                self._options.bag,
                self._options.start_offset,
                self._options.also,
                self.get_logger().warning,
                self._options.topics,
            ):
                if count == 0:
                    self._prepare(bundle)
                    start = time.monotonic()
                start += self._until(lambda: self._running, float("inf"))
                if not self._options.lockstep:
                    due = start + bundle.time / self._options.rate
                    self._until(lambda due=due: time.monotonic() >= due, float("inf"))
                self._send(bundle)
                count += 1
                if self._options.lockstep:
                    self._await(bundle)
                    if self._options.objects_only and self._objects:
                        return count
            if not self._options.loop:
                self._drain()
                return count

    def _drain(self) -> None:
        """Wait until the nodes that were waited for have dealt with what they got."""
        if self._options.nodes:
            self._heard = time.monotonic()
            self._until(lambda: time.monotonic() - self._heard > _QUIET, self._options.timeout)

    def _prepare(self, bundle: Bundle) -> None:
        """Advertise, then wait for subscribers: discovery must not cost the first frames."""
        senders = [self._sender(message) for message in bundle.messages]
        wanted, wait = self._options.subscribers, self._options.wait

        def heard() -> int:
            return min(int(sender.get_subscription_count()) for sender in senders)

        needed = {*self._options.nodes, *self._awaited}

        def ready() -> bool:
            listeners = self.count_subscribers("intent/scene_state")
            there = needed <= self._ready and listeners >= self._options.listeners
            return there and heard() >= wanted

        if self._until(ready, wait) >= wait:
            names = ", ".join(sorted({sender.topic_name for sender in senders}))
            missing = ", ".join(sorted(needed - self._ready))
            raise ValueError(
                f"nothing was played: after {wait:.0f} s only {heard()} of {wanted} nodes listen "
                f"to all of {names}"
                + (f", and {missing} did not say ready" if missing else "")
                + ": start the nodes first, or give --subscribers 0 to play to nobody"
            )

    def _await(self, bundle: Bundle) -> None:
        """Wait until recognizer and tracker have dealt with the frame."""

        def done(name: str) -> bool:
            return name not in self._awaited or self._answered.get(name, -1) >= bundle.stamp

        waited = self._until(lambda: done("recognizer"), self._options.timeout)
        if not self._objects:
            self._until(lambda: self._objects, _GRACE)
        if self._objects:  # before that the tracker has nothing to start from
            waited += self._until(lambda: done("tracker"), self._options.timeout)
        if waited >= self._options.timeout:
            what = "/intent/scene_state" if self._objects else "/intent/objects"
            raise ValueError(
                f"no answer on {what} to the frame at {bundle.stamp * 1e-9:.3f} s within "
                f"{self._options.timeout:.0f} s: see the warnings of recognizer and tracker"
            )

    def _send(self, bundle: Bundle) -> None:
        self._answered.clear()  # what comes before the frame is sent answers an earlier run
        if self._clock_sender is not None:
            clock = Clock()
            clock.clock.sec, clock.clock.nanosec = divmod(bundle.stamp, NANOSECONDS)
            self._clock_sender.publish(clock)
        for message in bundle.messages:
            self._sender(message).publish(message.data)

    def _sender(self, message: BagMessage) -> Any:
        topic = target_topic(message, self._topics)
        if topic not in self._senders:
            package, _, name = message.type.split("/")
            kind = getattr(importlib.import_module(f"{package}.msg"), name)
            self._senders[topic] = self.create_publisher(kind, topic, QoSProfile(depth=10))
        return self._senders[topic]

    def _answers(self, topic: str, kind: Any, name: str, qos: Any = RESULTS) -> None:
        def note(message: Any) -> None:
            self._answered[name] = max(self._answered.get(name, -1), stamp_of(message))
            self._heard = time.monotonic()

        self.create_subscription(kind, topic, guarded(self, topic, note), qos)

    def _on_objects(self, message: Any) -> None:
        self._objects = self._objects or message.complete
        self._heard = time.monotonic()

    def _run(self, running: bool, response: Any) -> Any:
        self._running, response.success = running, True
        return response

    def _until(self, condition: Any, longest: float) -> float:
        """Serve callbacks until a condition holds; return the seconds that took."""
        start = time.monotonic()
        while not condition() and time.monotonic() - start < longest:
            self._executor.spin_once(timeout_sec=0.01)
        return time.monotonic() - start


def main() -> None:
    """Play the bag that the command line names."""
    options = parse_options(remove_ros_args(sys.argv)[1:])
    rclpy.init()
    node = None
    try:
        node = ReplayNode(options)
        node.get_logger().info(f"played {node.play()} frames")
    except ValueError as error:
        raise SystemExit(f"replay: {error}") from None
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            node.destroy_node()  # with its shared memory
        rclpy.try_shutdown()
