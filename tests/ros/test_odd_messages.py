"""No message on the graph's topics ends a node, whatever is in it."""

import json
from typing import Any

import pytest
from intent_msgs import msg as msgs
from rclpy.node import Node
from std_msgs.msg import Header
from tests.support.harness import Probe

from intent_imitation.ros.convert import plan_from_msg
from intent_inference.ros.convert import posterior_from_msg
from intent_perception.ros.convert import objects_from_msg
from intent_perception.ros.node import guarded
from intent_tracking.ros.convert import grasp_from_msg, state_from_msg

READERS = {
    msgs.RecognizedObjects: objects_from_msg,
    msgs.SceneState: state_from_msg,
    msgs.StableGrasp: grasp_from_msg,
    msgs.TaskPosterior: posterior_from_msg,
    msgs.GraspPlan: plan_from_msg,
}


def odd(kind: Any) -> Any:
    """A message with a time that there is not."""
    message = kind()
    message.header.stamp.sec = -5
    return message


@pytest.mark.parametrize("kind", READERS, ids=lambda kind: kind.__name__)
def test_a_message_with_an_impossible_time_costs_one_warning(probe: Probe, kind: Any) -> None:
    node, taken = Node("listener"), []
    read = READERS[kind]
    take = guarded(node, "/odd", lambda message: taken.append(read(message)))
    probe.run_with(node)
    take(odd(kind))
    assert probe.until(lambda: bool(probe.warnings))
    assert "left out one message on /odd" in json.dumps(probe.warnings)
    assert taken == []


def test_whatever_a_callback_raises_the_next_message_is_taken(probe: Probe) -> None:
    node, taken = Node("listener"), []
    probe.run_with(node)

    def read(message: Any) -> None:
        taken.append(message.stamp.sec)
        if message.stamp.sec == 1:
            raise IndexError("odd")

    take = guarded(node, "/odd", read)
    for seconds in (1, 2):
        header = Header()
        header.stamp.sec = seconds
        take(header)
    assert taken == [1, 2]
