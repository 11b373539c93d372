"""The node that plans says nothing of what is over."""

from typing import Any

import numpy as np
import pytest
from intent_msgs.msg import GraspPlan, RecognizedObjects, TaskPosterior
from std_msgs.msg import Header
from tests.support.harness import Graph, Probe, ros_arguments

from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject
from intent_perception.recognition.recognizer import RecognizedObjects as Recognized
from intent_perception.ros.convert import header_at, objects_to_msg
from intent_perception.ros.node import LATCHED

POSTERIORS, PLANS = "/intent/task_posterior", "/intent/grasp_plan"
pytestmark = pytest.mark.slow


def concluded(second: int) -> Any:
    """What inference says of a grasp that means to hand over."""
    told = TaskPosterior(tasks=["hand-over"], probability=[0.9], best="hand-over", stage="GRASP")
    told.header, told.intends = header_at(second * 1_000_000_000, "table"), [0.9, 0.1]
    return told


def started(graph: Graph, probe: Probe) -> Any:
    """Start the node before a table with a mug; return the publisher of posteriors.

    A conclusion is out already when it starts.
    """
    posteriors = probe.create_publisher(TaskPosterior, POSTERIORS, LATCHED)
    posteriors.publish(concluded(1))
    pose = make_pose(np.eye(3), np.array([0.0, 0.0, 0.05]))
    mug = Recognized(1, (RecognizedObject("mug_0", "mug_0", "mug", pose, 0.9, 1.0),), np.eye(4))
    tables = probe.create_publisher(RecognizedObjects, "/robot/objects", LATCHED)
    tables.publish(objects_to_msg(mug, ObjectDatabase.load()))
    probe.until(lambda: False, timeout=0.2)
    remapped = ("-r", "imitation/robot_objects:=/robot/objects")
    name = graph.start("intent_imitation", "imitation", *ros_arguments(), *remapped)
    probe.listen(Header, "/imitation/ready")
    probe.listen(GraspPlan, PLANS)
    assert probe.until(lambda: bool(probe.heard["/imitation/ready"]), 240.0), graph.log(name)
    return posteriors


def test_a_restarted_node_does_not_plan_for_an_earlier_conclusion(
    graph: Graph, probe: Probe
) -> None:
    posteriors = started(graph, probe)
    probe.until(lambda: False, timeout=1.0)
    posteriors.publish(concluded(9))
    plans = probe.heard[PLANS]
    assert probe.until(lambda: bool(plans), timeout=20.0)
    assert [plan.header.stamp.sec for plan in plans] == [9]


def test_another_reach_takes_the_plan_back(graph: Graph, probe: Probe) -> None:
    posteriors = started(graph, probe)
    posteriors.publish(concluded(9))
    assert probe.until(lambda: bool(probe.heard[PLANS]), timeout=20.0)
    reach = concluded(10)
    reach.preliminary, reach.stage = True, "REACH"
    posteriors.publish(reach)
    probe.until(lambda: False, timeout=1.0)
    late: list[Any] = []
    probe.create_subscription(GraspPlan, PLANS, late.append, LATCHED)
    probe.until(lambda: False, timeout=1.0)
    assert late == []
