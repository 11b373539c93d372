"""What all nodes share of ROS: a node that survives bad input and says how it is, and its run."""

import gc
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NoReturn, Protocol

import cv2
import rclpy
import rclpy.logging
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions, install_signal_handlers
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from threadpoolctl import threadpool_limits

from intent_perception.bags.frame_assembly import FrameSynchroniser
from intent_perception.basics.orphaned_files import drop_shared_memory
from intent_perception.basics.parameters import Checked
from intent_perception.ros.declared import declared
from intent_perception.ros.health.input_watch import InputWatch
from intent_perception.ros.health.step_health import WARN, StepHealth
from intent_perception.ros.live_messages import LiveMessages
from intent_perception.ros.node_help import node_help

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
class ShareConfig(Checked):
    """A node's share of the processor; together the five keep up with a camera on two cores."""

    niceness: int = 5
    """How far this node stands back for the tracker, which must keep up with the camera, 0..19."""
    budget: float = 6.0
    """CPU time that it may take for each frame of a camera of 30 Hz [ms]; diagnostics warn when
    it takes more over ten seconds; 0.1..1000."""


class Inputs(Protocol):
    """The frames that a node hears, if it hears any."""

    synchroniser: FrameSynchroniser
    skipped: int
    """Frames that were sent and never arrived."""

    def waiting(self) -> str:
        """Return what a node without frames is waiting for."""


class IntentNode(Node):
    """A node with ~/enable, ~/reset, ~/processed and diagnostics that no message can bring down.

    `~/processed` carries the header of every input that has been dealt with, whether or not
    anything came of it: lockstep waits for it. `~/ready` is sent once, when the node has loaded all
    that it needs and answers its first input as fast as any other.
    """

    def __init__(self, name: str, share: ShareConfig | None = None) -> None:
        super().__init__(name)
        self._share = declared(self, share or ShareConfig())
        stand_back(self._share.niceness, _all_threads())
        self.enabled = True
        self.inputs: Inputs | None = None
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


def stand_back(niceness: int, threads: Iterable[int] | None = None) -> None:
    """Lower the priority of threads, and of those that they start, to a niceness.

    Such a thread no longer interrupts one that runs when a message wakes it (SCHED_BATCH).

    Args:
        niceness: 0..19.
        threads: their numbers; None: the calling one.
    """
    for thread in threads if threads is not None else [threading.get_native_id()]:
        try:
            if niceness > 0:
                os.sched_setscheduler(thread, os.SCHED_BATCH, os.sched_param(0))
            usual = os.getpriority(os.PRIO_PROCESS, thread)
            os.setpriority(os.PRIO_PROCESS, thread, max(niceness, usual))
        except ProcessLookupError:
            pass  # it has ended


def _all_threads() -> list[int]:
    """Return the numbers of this process's threads: the middleware has some of its own."""
    return [int(name) for name in os.listdir("/proc/self/task")]


def aside() -> ThreadPoolExecutor:
    """Return one thread that prepares things beside the frames, and stands back for them."""
    return ThreadPoolExecutor(1, initializer=lambda: stand_back(_PREPARING))


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
