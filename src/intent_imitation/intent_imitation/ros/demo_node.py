"""ROS node: collects what the five nodes say about one bag, writes result.json and the report."""

import sys
import time
from typing import Any

import rclpy
from intent_msgs import msg as msgs
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from intent_imitation.demo.demo_result import (
    Collected,
    parse_options,
    print_result,
    record_of,
    stamps_of,
    write_result,
)
from intent_imitation.demo.report import write_report
from intent_imitation.ros.convert import plan_from_msg
from intent_inference.ros.convert import posterior_from_msg
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.ros.convert import objects_from_msg
from intent_perception.ros.node import LATCHED, RESULTS
from intent_tracking.ros.convert import grasp_from_msg, state_from_msg

_NODES = ("tracker", "grasp_detector", "inference")
_QUIET = 10.0  # seconds without a message after which an answer that is due will not come


class DemoNode(Node):
    """Listens until every node has dealt with the bag's last frame."""

    def __init__(self, bag: str) -> None:
        super().__init__("demo")
        self.collected, self._last = Collected(), stamps_of(bag)[-1]
        self._processed = dict.fromkeys(_NODES, -1)
        self._heard = time.monotonic()
        got = self.collected
        self._hear(msgs.RecognizedObjects, "/intent/objects", objects_from_msg, got.objects)
        self._hear(
            msgs.RecognizedObjects, "/robot/intent/objects", objects_from_msg, got.robot_objects
        )
        self._hear(msgs.SceneState, "/intent/scene_state", state_from_msg, got.states, RESULTS)
        self._hear(msgs.StableGrasp, "/intent/stable_grasp", grasp_from_msg, got.grasps)
        self._hear(msgs.TaskPosterior, "/intent/task_posterior", posterior_from_msg, got.posteriors)
        self._hear(msgs.GraspPlan, "/intent/grasp_plan", plan_from_msg, got.plans)
        self.create_subscription(CameraInfo, "/rgb/camera_info", self._on_info, 10)
        for name in _NODES:
            self.create_subscription(
                Header, f"/{name}/processed", lambda m, name=name: self._on_done(name, m), LATCHED
            )

    def complete(self) -> bool:
        """Return whether nothing more can come: all frames dealt with, all answers here."""
        got = self.collected
        final = [posterior for posterior in got.posteriors if not posterior.preliminary]
        last_state = got.states[-1].stamp if got.states else -1
        if self._processed["tracker"] < self._last:
            return False
        if time.monotonic() - self._heard > _QUIET:
            return True
        return (
            min(self._processed["grasp_detector"], self._processed["inference"]) >= last_state
            and len(final) >= len(got.grasps)
            and len(got.plans) >= sum(posterior.best is not None for posterior in final)
        )

    def _hear(self, kind: Any, topic: str, convert: Any, into: Any, qos: Any = LATCHED) -> None:
        def note(message: Any) -> None:
            into.append(convert(message))
            self._heard = time.monotonic()
            if len(self.collected.plans) <= 1 and (
                topic.endswith("plan") or not self.collected.plans
            ):
                self.collected.planned = self._heard

        self.create_subscription(kind, topic, note, qos)

    def _on_info(self, _: Any) -> None:
        if self.collected.started is None:
            self.collected.started = time.monotonic()

    def _on_done(self, name: str, header: Any) -> None:
        self._processed[name] = max(self._processed[name], stamp_of(header))
        self._heard = time.monotonic()


def main() -> None:
    """Collect one run and write what came of it."""
    options = parse_options(remove_ros_args(sys.argv)[1:])
    rclpy.init()
    try:
        node = DemoNode(options.bag)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        deadline = time.monotonic() + options.timeout
        while not node.complete() and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        record = record_of(options, node.collected)
        write_result(record, options.out)
        print_result(record)
        write_report(record, options.out)
    except ValueError as error:
        raise SystemExit(f"error: {error}") from None
    except (KeyboardInterrupt, ExternalShutdownException):
        raise SystemExit(130) from None
    finally:
        rclpy.try_shutdown()
