"""Each node says when its input is missing, goes, or the clock stands still."""

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from intent_msgs.msg import StableGrasp
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Header
from tests.support.harness import Probe

from intent_perception.ros.health.input_watch import InputWatch
from intent_perception.ros.health.step_health import ERROR, OK, WARN, StepHealth
from intent_perception.ros.node import IntentNode

TOPIC = "/intent/stable_grasp"


class Hands:
    """A clock that is set by hand [s]."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def node(probe: Probe) -> Node:
    made = Node("listener")
    probe.run_with(made)
    return made


def test_a_topic_that_nobody_publishes_is_named_and_warned_about_once(
    node: Node, probe: Probe
) -> None:
    clock = Hands()
    watch = InputWatch(node, clock)
    watch.add(TOPIC)
    assert watch.waiting() == ""
    clock.now = 6.0
    assert watch.waiting() == f"nobody publishes {TOPIC}"
    clock.now = 31.0
    watch.waiting()
    clock.now = 32.0
    watch.waiting()
    assert probe.until(lambda: bool(probe.warnings))
    probe.until(lambda: False, timeout=0.2)
    (said,) = probe.warnings
    assert said.startswith(f"nobody publishes {TOPIC}")


def test_a_publisher_that_dies_is_missed_at_once(node: Node, probe: Probe) -> None:
    watch = InputWatch(node, Hands())
    watch.add(TOPIC)
    publisher = probe.create_publisher(StableGrasp, TOPIC, 10)
    assert probe.until(lambda: node.count_publishers(TOPIC) == 1)
    assert watch.waiting() == ""
    probe.destroy_publisher(publisher)
    assert probe.until(lambda: node.count_publishers(TOPIC) == 0)
    assert watch.waiting() == f"the publisher of {TOPIC} has gone"
    assert probe.until(lambda: f"the publisher of {TOPIC} has gone" in probe.warnings)


def test_simulated_time_without_a_clock_is_said(node: Node, probe: Probe) -> None:
    node.set_parameters([Parameter("use_sim_time", value=True)])
    clock = Hands()
    watch = InputWatch(node, clock)
    clock.now = 6.0
    assert "nothing comes on /clock" in watch.waiting()
    assert probe.until(lambda: any("/clock" in text for text in probe.warnings))


def diagnosed(probe: Probe, node: Node) -> Any:
    """The next status of a node."""
    kept = probe.heard["/diagnostics"]
    count = len(kept)
    assert probe.until(lambda: len(kept) > count, timeout=5.0)
    return kept[-1].status[0]


def test_diagnostics_come_without_a_clock_and_turn_to_error_while_steps_fail(probe: Probe) -> None:
    node = IntentNode("seer")
    probe.run_with(node)
    node.set_parameters([Parameter("use_sim_time", value=True)])
    probe.listen(DiagnosticArray, "/diagnostics", 10)
    assert diagnosed(probe, node).level == DiagnosticStatus.OK

    def fail(_: Any) -> None:
        raise IndexError("nobody has foreseen this")

    for _ in range(30):
        node.attempt(fail, None, Header())
    status = diagnosed(probe, node)
    assert (status.name, status.level) == ("seer", DiagnosticStatus.ERROR)
    assert "IndexError: nobody has foreseen this" in status.message
    (said,) = [text for text in probe.warnings if "nobody has foreseen" in text]
    assert "in fail" in said  # the traceback
    node.attempt(lambda _: None, None, Header())
    diagnosed(probe, node)
    assert diagnosed(probe, node).level == DiagnosticStatus.OK


def test_one_bad_input_is_a_warning_and_three_in_a_row_are_an_error() -> None:
    health = StepHealth()
    levels = [health.report()[0]]
    for good in (False, True, False, False, False, True):
        if not good:
            health.note_failure("blank")
        health.note_step(0.001, failed=not good)
        levels.append(health.report()[0])
    assert levels == [OK, WARN, OK, WARN, WARN, ERROR, OK]
