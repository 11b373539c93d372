"""ROS node: times the running graph from a final posterior to the published plan.

The five nodes run as `ros2 run` would start them, in a ROS domain of their own; answers are timed
by the wall clock.
"""

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rclpy
from ament_index_python import get_package_prefix
from intent_msgs import msg as msgs
from rclpy.node import Node
from std_msgs.msg import Header

from intent_inference.intention.estimator import TaskPosterior
from intent_inference.ros.convert import posterior_to_msg
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_perception.ros.convert import objects_to_msg
from intent_perception.ros.node import LATCHED
from intent_perception.ros.ros_domain import private_domain

_NODES = (
    ("intent_perception", "recognizer"),
    ("intent_tracking", "tracker"),
    ("intent_tracking", "grasp_detector"),
    ("intent_inference", "inference"),
    ("intent_imitation", "imitation"),
)
_PATIENCE = 120.0  # [s]


class GraphProbe(Node):
    """Speaks for recogniser and inference, and listens to the plans."""

    def __init__(self) -> None:
        super().__init__("graph_probe")
        self._plans: dict[int, float] = {}
        self._done: set[int] = set()
        self._objects = self.create_publisher(
            msgs.RecognizedObjects, "/imitation/robot_objects", LATCHED
        )
        self._posterior = self.create_publisher(
            msgs.TaskPosterior, "/intent/task_posterior", LATCHED
        )
        self.create_subscription(msgs.GraspPlan, "/intent/grasp_plan", self._on_plan, LATCHED)
        self.create_subscription(
            Header, "/imitation/processed", lambda m: self._done.add(stamp_of(m)), LATCHED
        )

    def show(self, objects: RecognizedObjects, database: ObjectDatabase) -> None:
        """Publish the robot's table and wait until the node has dealt with it."""
        self._until(lambda: self._objects.get_subscription_count() > 0)
        self._objects.publish(objects_to_msg(objects, database))
        self._until(lambda: objects.stamp in self._done)

    def ask(self, posterior: TaskPosterior) -> float:
        """Return the wall time from a posterior to its plan [s]."""
        started = time.perf_counter()
        self._posterior.publish(posterior_to_msg(posterior))
        self._until(lambda: posterior.stamp in self._plans)
        return self._plans[posterior.stamp] - started

    def _on_plan(self, message: Any) -> None:
        self._plans[stamp_of(message)] = time.perf_counter()

    def _until(self, condition: Callable[[], bool]) -> None:
        end = time.monotonic() + _PATIENCE
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"the graph said nothing for {_PATIENCE:g} s")
            rclpy.spin_once(self, timeout_sec=0.02)


@contextmanager
def probed_graph() -> Iterator[GraphProbe]:
    """Run the five nodes in a ROS domain that no other run on this machine uses, and the probe."""
    with private_domain(), tempfile.TemporaryDirectory() as folder:
        nodes = []
        for package, executable in _NODES:
            file = Path(get_package_prefix(package)) / "lib" / package / executable
            with (Path(folder) / f"{executable}.log").open("wb") as log:
                nodes.append(
                    subprocess.Popen([str(file)], stdout=log, stderr=log, start_new_session=True)
                )
        rclpy.init()
        try:
            yield GraphProbe()
        finally:
            rclpy.try_shutdown()
            for node in nodes:
                os.killpg(node.pid, signal.SIGKILL)
                node.wait()
