"""What was said before a node was started is history, and is not answered again."""

import time
from typing import Any

import numpy as np
import pytest
from intent_msgs.msg import StableGrasp, TaskPosterior
from std_msgs.msg import Header
from tests.support.grasp_tables import made_up_grasps
from tests.support.harness import Graph, Probe

from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.ros.latest_result import LATEST
from intent_perception.ros.live_messages import LiveMessages, process_age
from intent_perception.ros.node import LATCHED
from intent_tracking.grasp.grasp_detector import StableGrasp as Grasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.ros.convert import grasp_to_msg

NOW, AGE = 1_000_000_000_000, 5.0


def heard(live: LiveMessages, seconds_ago: float) -> bool:
    return live.is_news({"source_timestamp": NOW - int(seconds_ago * 1e9)})


def listener() -> LiveMessages:
    """Of a process of five seconds."""
    return LiveMessages(lambda: AGE, lambda: NOW)


@pytest.mark.parametrize(("seconds_ago", "news"), [(0.0, True), (4.9, True), (5.1, False)])
def test_what_was_sent_before_the_start_is_no_news(seconds_ago: float, news: bool) -> None:
    assert heard(listener(), seconds_ago) is news


def test_a_message_is_news_once() -> None:
    live = listener()
    assert [heard(live, ago) for ago in (2.0, 2.0, 1.0, 2.0)] == [True, False, True, False]


def test_a_sender_without_a_clock_always_brings_news() -> None:
    live = listener()
    assert live.is_news({"source_timestamp": 0})
    assert live.is_news({"source_timestamp": 0})


def test_the_age_of_a_process_grows_with_the_clock() -> None:
    before = process_age()
    time.sleep(0.05)
    assert 0.0 < before < before + 0.04 < process_age() < before + 5.0


def grasp(stamp: int) -> Any:
    """A grasp of a mug as a message."""
    table = made_up_grasps(3)
    values = {n: table.features[n][0] for n in ("size", "conv", "dir", "npos", "fcon")}
    features = GraspFeatures(object_class="mug", fvol=None, coc=None, gbvl=None, **values)
    unknown = GraspFeatures(*(None,) * 9)
    return grasp_to_msg(
        Grasp(stamp, "mug_0", "mug_0", "mug", "right", features, unknown, np.eye(4))
    )


@pytest.mark.slow
def test_a_restarted_node_does_not_answer_an_earlier_grasp(graph: Graph, probe: Probe) -> None:
    probe.listen(TaskPosterior, "/intent/task_posterior")
    publisher = probe.create_publisher(StableGrasp, "/intent/stable_grasp", LATCHED)
    publisher.publish(grasp(1_000_000_000))
    probe.until(lambda: False, timeout=0.2)
    name = graph.start("intent_inference", "inference")
    probe.listen(Header, "/inference/ready")
    ready = probe.heard["/inference/ready"]
    assert probe.until(lambda: bool(ready), timeout=240.0), graph.log(name)
    probe.until(lambda: False, timeout=1.0)
    publisher.publish(grasp(9_000_000_000))
    answers = probe.heard["/intent/task_posterior"]
    assert probe.until(lambda: bool(answers)), graph.log(name)
    assert [stamp_of(answer) for answer in answers] == [9_000_000_000]


def test_a_late_joiner_hears_only_the_last_of_results(probe: Probe) -> None:
    publisher = probe.create_publisher(TaskPosterior, "/intent/task_posterior", LATEST)
    for preliminary in (True, True, False):
        publisher.publish(TaskPosterior(preliminary=preliminary))
    probe.listen(TaskPosterior, "/intent/task_posterior")
    kept = probe.heard["/intent/task_posterior"]
    assert probe.until(lambda: bool(kept))
    probe.until(lambda: len(kept) > 1, timeout=0.5)
    assert [message.preliminary for message in kept] == [False]
