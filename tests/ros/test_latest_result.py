"""A late joiner hears what holds, and nothing that holds no longer."""

from typing import Any

from intent_msgs.msg import TaskPosterior
from rclpy.node import Node
from tests.support.harness import Probe

from intent_perception.ros.latest_result import LatestResult, ResultOnDemand

TOPIC = "/intent/task_posterior"


def results(probe: Probe) -> LatestResult:
    node = Node("speaker")
    probe.run_with(node)
    return LatestResult(node, TaskPosterior, TOPIC)


def heard_late(probe: Probe, wait: float = 0.6) -> list[Any]:
    """What a listener hears that comes only now."""
    probe.listen(TaskPosterior, TOPIC)
    probe.until(lambda: False, timeout=wait)
    return [message.best for message in probe.heard[TOPIC]]


def test_a_late_joiner_hears_the_last_result_alone(probe: Probe) -> None:
    speaker = results(probe)
    for best in ("pouring", "hand-over"):
        speaker.publish(TaskPosterior(best=best))
    assert heard_late(probe) == ["hand-over"]


def test_a_forecast_of_some_time_ago_is_told_to_nobody(probe: Probe) -> None:
    speaker = results(probe)
    speaker.publish(TaskPosterior(best="pouring"))
    speaker.publish_fleeting(TaskPosterior(best="tool-use", preliminary=True))
    probe.until(lambda: False, timeout=1.2)
    assert heard_late(probe) == []


def test_a_forecast_reaches_who_listens(probe: Probe) -> None:
    speaker = results(probe)
    probe.listen(TaskPosterior, TOPIC)
    for best in ("pouring", "hand-over"):
        speaker.publish_fleeting(TaskPosterior(best=best, preliminary=True))
        kept = probe.heard[TOPIC]
        assert probe.until(lambda kept=kept, best=best: bool(kept) and kept[-1].best == best)


def test_what_is_taken_back_has_reached_who_listened_before(probe: Probe) -> None:
    speaker = results(probe)
    probe.listen(TaskPosterior, TOPIC)
    assert probe.until(lambda: probe.count_publishers(TOPIC) > 0)
    probe.until(lambda: False, timeout=0.3)
    speaker.publish(TaskPosterior(best="pouring"))
    speaker.take_back()
    kept = probe.heard[TOPIC]
    assert probe.until(lambda: bool(kept), timeout=5.0)


def test_after_a_reset_the_next_result_is_heard_again(probe: Probe) -> None:
    speaker = results(probe)
    speaker.publish(TaskPosterior(best="pouring"))
    speaker.take_back()
    speaker.publish(TaskPosterior(best="tool-use"))
    assert heard_late(probe) == ["tool-use"]


def test_what_takes_long_to_make_is_made_when_somebody_listens(probe: Probe) -> None:
    node, made = Node("speaker"), list[str]()
    probe.run_with(node)

    def make() -> TaskPosterior:
        made.append("pouring" if not made else "hand-over")
        return TaskPosterior(best=made[-1])

    speaker = ResultOnDemand(node, TaskPosterior, TOPIC, make)
    speaker.renew()
    speaker.renew()
    probe.until(lambda: False, timeout=0.3)
    assert not made
    assert heard_late(probe) == ["pouring"]
    speaker.renew()
    kept = probe.heard[TOPIC]
    assert probe.until(lambda: [message.best for message in kept] == ["pouring", "hand-over"])
