"""ROS node: how long the running graph takes from a final posterior to the published plan.

python -m intent_imitation.graph_probe_node [--answers 20] [--seed S]

Starts the five nodes as `ros2 run` would, in a ROS domain of its own, tells the imitation node of a
table, and times each answer by the wall clock. Prints one line of JSON.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from ament_index_python import get_package_prefix
from intent_msgs import msg as msgs
from rclpy.node import Node
from std_msgs.msg import Header

from intent_imitation.scenes import FITTING, SceneMaker, merged
from intent_inference.intention.estimator import TaskPosterior
from intent_inference.ros.convert import posterior_to_msg
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.objects.database import CLUTTER, ObjectDatabase
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
def running_graph() -> Iterator[None]:
    """Run the five nodes in a ROS domain that no other run on this machine uses."""
    with private_domain(), tempfile.TemporaryDirectory() as folder:
        nodes = []
        for package, executable in _NODES:
            file = Path(get_package_prefix(package)) / "lib" / package / executable
            with (Path(folder) / f"{executable}.log").open("wb") as log:
                nodes.append(
                    subprocess.Popen([str(file)], stdout=log, stderr=log, start_new_session=True)
                )
        try:
            yield
        finally:
            for node in nodes:
                os.killpg(node.pid, signal.SIGKILL)
                node.wait()


def measured(answers: int, seed: int) -> dict[str, Any]:
    """Return the wall times of some answers [ms], four tables in turn."""
    database = ObjectDatabase.load()
    maker = SceneMaker(database, ObjectDatabase.load(CLUTTER), frozenset())
    rng, tasks = np.random.default_rng(seed), tuple(FITTING)
    probe, seconds = GraphProbe(), []
    for number in range(answers):
        task = tasks[number % len(tasks)]
        if number % 5 == 0:
            scene = maker.make("hand-over", rng)  # known objects only, as the node's database has
            objects = RecognizedObjects(
                number + 1, scene.recognized().objects, scene.recognized().T_table_camera
            )
            probe.show(objects, merged(database, ObjectDatabase.load(CLUTTER)))
        chances = np.array([0.9 if name == task else 0.1 for name in tasks])
        posterior = TaskPosterior(
            1000 + number, "demo", "", tasks, chances, task, (task,), False, 0.0, (), ()
        )
        seconds.append(probe.ask(posterior))
    milliseconds = 1e3 * np.array(seconds)
    return {
        "answers": answers,
        "latency_ms_median": float(np.median(milliseconds)),
        "latency_ms_max": float(milliseconds.max()),
        "within_200_ms": float((milliseconds <= 200.0).mean()),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--answers", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with running_graph():
        rclpy.init()
        try:
            print(json.dumps(measured(options.answers, options.seed)))
        except TimeoutError as error:
            print(error, file=sys.stderr)
            raise SystemExit(1) from None
        finally:
            rclpy.try_shutdown()


if __name__ == "__main__":
    main()
