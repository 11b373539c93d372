"""The recorder writes what the grasp detector says, for `train add`."""

from pathlib import Path

import pytest
from intent_msgs.msg import StableGrasp
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tests.ros.test_live_messages import grasp
from tests.support.harness import Graph, Probe, ros_arguments

from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.ros.node import LATCHED


@pytest.mark.slow
def test_shown_grasps_become_rows_and_the_last_can_be_taken_back(
    graph: Graph, probe: Probe, tmp_path: Path
) -> None:
    table = tmp_path / "mine.csv"
    told = ros_arguments(f"out:={table}", "shown:=pouring", "refused:=tool-use")
    name = graph.start("intent_inference", "record", *told)
    probe.listen(Header, "/record/ready")
    assert probe.until(lambda: bool(probe.heard["/record/ready"]), 60.0), graph.log(name)
    publisher = probe.create_publisher(StableGrasp, "/intent/stable_grasp", LATCHED)
    assert probe.until(lambda: publisher.get_subscription_count() == 1)
    for second in (1, 2):
        publisher.publish(grasp(second * 1_000_000_000))
        assert probe.until(lambda second=second: f"row {second}:" in graph.log(name), 10.0)
    rows = read_grasps(table)
    assert rows.rows == 2
    assert rows.labels["pouring"].tolist() == [1.0, 1.0]
    assert rows.labels["tool-use"].tolist() == [0.0, 0.0]
    client = probe.create_client(Trigger, "/record/undo")
    assert client.wait_for_service(10.0)
    answer = client.call_async(Trigger.Request())
    assert probe.until(answer.done, 10.0)
    assert read_grasps(table).rows == 1


def test_without_a_task_the_recorder_says_what_is_missing(graph: Graph, tmp_path: Path) -> None:
    name = graph.start(
        "intent_inference", "record", *ros_arguments(f"out:={tmp_path / 'mine.csv'}")
    )
    assert graph.wait(name, 60.0) == 1
    assert "which tasks are shown" in graph.log(name)
