"""The examples that listen to a graph say what it says."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from intent_msgs.msg import GraspPlan, RobotGrasp, StableGrasp, TaskPosterior
from tests.conftest import ROOT
from tests.ros.test_live_messages import grasp
from tests.support.harness import Probe

from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.ros.node import LATCHED


@contextmanager
def example(name: str, log: Path, *arguments: str) -> Iterator[None]:
    """Run an example beside the test."""
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), *arguments]
    with log.open("wb") as file, subprocess.Popen(command, stdout=file, stderr=file) as process:
        yield
        process.kill()


def test_the_listener_prints_conclusions_and_plans(probe: Probe, tmp_path: Path) -> None:
    log = tmp_path / "log"
    told = TaskPosterior(object_id="mug_1", tasks=["pouring"], probability=[0.9], stage="GRASP")
    plan = GraspPlan(task="pouring", grasps=[RobotGrasp(object_id="bottle_2")])
    probe.create_publisher(TaskPosterior, "intent/task_posterior", LATCHED).publish(told)
    probe.create_publisher(GraspPlan, "intent/grasp_plan", LATCHED).publish(plan)
    said = ("mug_1 {'pouring': 0.9}", "for pouring the robot takes bottle_2")  # in any order
    with example("listener", log):
        heard = probe.until(lambda: all(text in log.read_text() for text in said), 30.0)
    assert heard, log.read_text()


def test_the_recorder_writes_a_table(probe: Probe, tmp_path: Path) -> None:
    log, table = tmp_path / "log", tmp_path / "mine.csv"
    publisher = probe.create_publisher(StableGrasp, "intent/stable_grasp", 10)
    with example("recorder", log, str(table), "pouring"):
        assert probe.until(lambda: publisher.get_subscription_count() > 0, 30.0), log.read_text()
        publisher.publish(grasp(1_000_000_000))
        assert probe.until(lambda: "row 1" in log.read_text(), 10.0), log.read_text()
    assert read_grasps(table).labels["pouring"].tolist() == [1.0]
