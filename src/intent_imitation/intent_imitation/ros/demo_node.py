"""ROS node: collects what the five nodes say about one bag, writes result.json and the report."""

import sys
import time
from functools import partial
from typing import Any

import rclpy
from intent_msgs import msg as msgs
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from intent_imitation.demo.collected import Collected
from intent_imitation.demo.demo_result import (
    parse_options,
    record_of,
    stamps_of,
    write_all,
)
from intent_imitation.demo.result_files import results_folder
from intent_imitation.demo.run_progress import FOLLOWERS, RunProgress
from intent_imitation.ros.convert import plan_from_msg
from intent_inference.ros.convert import posterior_from_msg
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.basics.progress import ProgressBar
from intent_perception.objects.database import ObjectDatabase
from intent_perception.ros.node import LATCHED, RESULTS, guarded
from intent_perception.ros.shaped_objects import ShapedObjects
from intent_tracking.ros.convert import grasp_from_msg, state_from_msg

_GRACE = 2.0
"""A plan may arrive so long after its acknowledgement [s]."""


class DemoNode(Node):
    """Listens until every node has dealt with the bag's last frame."""

    def __init__(self, bag: str, patience: float) -> None:
        super().__init__("demo")
        self.collected = Collected()
        self.progress = RunProgress(stamps_of(bag), patience, time.monotonic())
        got = self.collected
        self._hear_objects("intent", got.objects)
        self._hear_objects("robot/intent", got.robot_objects)
        self._hear(msgs.SceneState, "intent/scene_state", state_from_msg, got.states, RESULTS)
        self._hear(msgs.StableGrasp, "intent/stable_grasp", grasp_from_msg, got.grasps)
        self._hear(msgs.TaskPosterior, "intent/task_posterior", posterior_from_msg, got.posteriors)
        self._hear(msgs.GraspPlan, "intent/grasp_plan", plan_from_msg, got.plans)
        self.create_subscription(CameraInfo, "rgb/camera_info", self._on_info, 10)
        self._imitated: dict[int, float] = {}
        self.create_subscription(
            Header,
            "imitation/processed",
            guarded(self, "imitation/processed", self._on_imitated),
            LATCHED,
        )
        for name in ("tracker", *FOLLOWERS):
            topic = f"{name}/processed"
            done = guarded(self, topic, partial(self._on_done, name))
            self.create_subscription(Header, topic, done, LATCHED)

    def waiting(self) -> bool:
        """Return whether more is to come; ValueError once nothing has come for too long."""
        self._note_refusals()
        if self.progress.missing(self.collected) == "":
            return False
        self.progress.check(self.collected, time.monotonic())
        return True

    def phase(self) -> str:
        """Return what the nodes are about, in a word or two."""
        if self.collected.started is None:
            return "loading, robot's table"
        if self.progress.seen < self.progress.total:
            return "tracking" if self.collected.states else "recognising"
        return "concluding"

    def _hear_objects(self, namespace: str, into: Any) -> None:
        """Take note of what is on a table, with the shapes of what is estimated."""

        def note(objects: Any, _: Any) -> None:
            into.append(objects)
            self.progress.note(time.monotonic())

        heard = ShapedObjects(ObjectDatabase(()), note)
        for kind, name, take in (
            (msgs.ObjectShapes, "shapes", heard.on_shapes),
            (msgs.RecognizedObjects, "objects", heard.on_objects),
        ):
            topic = f"{namespace}/{name}"
            self.create_subscription(kind, topic, guarded(self, topic, take), LATCHED)

    def _hear(self, kind: Any, topic: str, convert: Any, into: Any, qos: Any = LATCHED) -> None:
        def note(message: Any) -> None:
            into.append(convert(message))
            now = time.monotonic()
            self.progress.note(now)
            if len(self.collected.plans) <= 1 and (
                topic.endswith("plan") or not self.collected.plans
            ):
                self.collected.planned = now

        self.create_subscription(kind, topic, guarded(self, topic, note), qos)

    def _on_info(self, _: Any) -> None:
        if self.collected.started is None:
            self.collected.started = time.monotonic()

    def _on_imitated(self, header: Any) -> None:
        self._imitated[stamp_of(header)] = time.monotonic()

    def _note_refusals(self) -> None:
        """Take note of posteriors that were dealt with a while ago and got no plan."""
        planned = {plan.stamp for plan in self.collected.plans}
        for stamp, moment in self._imitated.items():
            if stamp not in planned and time.monotonic() - moment > _GRACE:
                self.progress.note_refused(stamp)

    def _on_done(self, name: str, header: Any) -> None:
        self.progress.note_dealt(name, stamp_of(header), time.monotonic())


def main() -> None:
    """Collect one run and write what came of it."""
    options = parse_options(remove_ros_args(sys.argv)[1:])
    rclpy.init()
    node = None
    try:
        folder = results_folder(options.out)
        node = DemoNode(options.bag, options.patience)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        with ProgressBar("frame", node.progress.total) as bar:
            while node.waiting():
                executor.spin_once(timeout_sec=0.1)
                bar.at(node.progress.seen, node.phase())
        write_all(record_of(options, node.collected), options.bag, folder)
    except ValueError as error:
        raise SystemExit(f"error: {error}") from None
    except (KeyboardInterrupt, ExternalShutdownException):
        after = node.progress if node is not None else "no frame"
        sys.stderr.write(f"demo: stopped after {after}; nothing is concluded\n")
        raise SystemExit(130) from None
    finally:
        if node is not None:
            node.destroy_node()  # with its shared memory
        rclpy.try_shutdown()
