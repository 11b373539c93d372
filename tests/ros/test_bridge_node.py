"""Plans and objects in the words of MoveIt, vision_msgs and a gripper's controller."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Pose, PoseStamped, Vector3, Vector3Stamped
from intent_msgs import msg as msgs
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tests.support.harness import Graph, Probe
from trajectory_msgs.msg import JointTrajectory

from intent_imitation.ros.bridge_messages import detections, hand_trajectory, moveit_grasps
from intent_perception.ros.node import LATCHED


class Grasp(SimpleNamespace):
    """Stands for moveit_msgs/Grasp, which no wheel brings; the fields are its own."""


class GripperTranslation(SimpleNamespace):
    """Stands for moveit_msgs/GripperTranslation."""

    def __init__(self) -> None:
        super().__init__(direction=Vector3Stamped(), desired_distance=0.0, min_distance=0.0)


class Detection3DArray(SimpleNamespace):
    """Stands for vision_msgs/Detection3DArray."""


class Detection3D(SimpleNamespace):
    """Stands for vision_msgs/Detection3D."""

    def __init__(self, header: Any) -> None:
        super().__init__(header=header, bbox=SimpleNamespace(center=Pose(), size=Vector3()))


class ObjectHypothesisWithPose(SimpleNamespace):
    """Stands for vision_msgs/ObjectHypothesisWithPose."""

    def __init__(self) -> None:
        super().__init__(
            hypothesis=SimpleNamespace(class_id="", score=0.0), pose=SimpleNamespace(pose=Pose())
        )


MOVEIT = SimpleNamespace(Grasp=Grasp, GripperTranslation=GripperTranslation)
VISION = SimpleNamespace(
    Detection3DArray=Detection3DArray,
    Detection3D=Detection3D,
    ObjectHypothesisWithPose=ObjectHypothesisWithPose,
)


def plan() -> Any:
    header = Header(frame_id="table")

    def joints(value: float) -> Any:
        return JointState(header=header, name=["left", "right"], position=[value, -value])

    grasps = [
        msgs.RobotGrasp(
            object_id="mug_1", wrist_pose=PoseStamped(header=header), score=score,
            approach=Vector3(x=1.0), pregrasp=joints(0.0), grasp=joints(0.5),
        )
        for score in (0.9, 0.4)
    ]  # fmt: skip
    return msgs.GraspPlan(header=header, task="pouring", grasps=grasps)


def test_a_gripper_opens_to_the_pregrasp_and_then_closes() -> None:
    way = hand_trajectory(plan().grasps[0], 2.5)
    assert way.joint_names == ["left", "right"]
    assert [list(point.positions) for point in way.points] == [[0.0, -0.0], [0.5, -0.5]]
    times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in way.points]
    assert times == [1.0, 3.5]


def test_every_grasp_of_a_plan_becomes_one_of_moveit_best_first() -> None:
    first, second = moveit_grasps(plan(), MOVEIT)
    assert (first.id, second.id) == ("mug_1_1", "mug_1_2")
    assert first.grasp_quality > second.grasp_quality
    assert first.pre_grasp_approach.direction.vector.x == 1.0
    assert first.pre_grasp_approach.direction.header.frame_id == "table"
    assert first.post_grasp_retreat.direction.vector.z == 1.0
    assert list(first.grasp_posture.points[0].positions) == [0.5, -0.5]
    assert first.allowed_touch_objects == ["mug_1"]


def test_objects_become_detections_with_boxes() -> None:
    item = msgs.RecognizedObject(id="mug", model="mug_1", object_class="mug", confidence=0.8)
    thing = msgs.RecognizedObject(id="thing", confidence=0.5)
    found = detections(
        msgs.RecognizedObjects(objects=[item, thing]), {"mug_1": np.array([0.1, 0.2, 0.3])}, VISION
    ).detections
    assert [d.results[0].hypothesis.class_id for d in found] == ["mug", "unknown"]
    assert (found[0].bbox.size.x, found[0].bbox.size.z) == (0.1, 0.3)
    assert found[0].results[0].hypothesis.score == pytest.approx(0.8)


@pytest.mark.slow
def test_the_bridge_says_what_is_missing_and_moves_the_gripper(graph: Graph, probe: Probe) -> None:
    name = graph.start("intent_imitation", "bridge")
    probe.listen(Header, "/bridge/ready")
    assert probe.until(lambda: bool(probe.heard["/bridge/ready"]), 60.0), graph.log(name)
    probe.listen(JointTrajectory, "/intent/hand_trajectory")
    probe.create_publisher(msgs.GraspPlan, "/intent/grasp_plan", LATCHED).publish(plan())
    assert probe.until(lambda: bool(probe.heard["/intent/hand_trajectory"]), 10.0), graph.log(name)
    missing = "moveit_msgs is not installed" in graph.log(name)
    offered = any("moveit_grasps" in topic for topic, _ in probe.get_topic_names_and_types())
    assert missing != offered
