"""Plans and objects in the words of MoveIt, vision_msgs and a gripper's controller."""

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovariance, Vector3, Vector3Stamped
from intent_msgs import msg as msgs
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tests.support.harness import Graph, Probe
from trajectory_msgs.msg import JointTrajectory

from intent_imitation.ros.bridge_messages import detections, hand_trajectory, moveit_grasps
from intent_imitation.ros.bridge_node import BridgeNode
from intent_perception.ros.node import LATCHED


class StandIn:
    """A message of a package that no wheel brings; another field than its own is refused."""

    __slots__: tuple[str, ...] = ()

    def __init__(self, **values: Any) -> None:
        for name, value in values.items():
            setattr(self, name, value)


class GripperTranslation(StandIn):
    """Stands for moveit_msgs/GripperTranslation."""

    __slots__ = ("desired_distance", "direction", "min_distance")

    def __init__(self) -> None:
        super().__init__(direction=Vector3Stamped(), desired_distance=0.0, min_distance=0.0)


class Grasp(StandIn):
    """Stands for moveit_msgs/Grasp."""

    __slots__ = (
        "allowed_touch_objects", "grasp_pose", "grasp_posture", "grasp_quality", "id",
        "max_contact_force", "post_grasp_retreat", "post_place_retreat", "pre_grasp_approach",
        "pre_grasp_posture",
    )  # fmt: skip


class BoundingBox3D(StandIn):
    """Stands for vision_msgs/BoundingBox3D."""

    __slots__ = ("center", "size")


class Detection3D(StandIn):
    """Stands for vision_msgs/Detection3D."""

    __slots__ = ("bbox", "header", "id", "results")

    def __init__(self, header: Any) -> None:
        super().__init__(header=header, bbox=BoundingBox3D(center=Pose(), size=Vector3()))


class Detection3DArray(StandIn):
    """Stands for vision_msgs/Detection3DArray."""

    __slots__ = ("detections", "header")


class ObjectHypothesis(StandIn):
    """Stands for vision_msgs/ObjectHypothesis."""

    __slots__ = ("class_id", "score")


class ObjectHypothesisWithPose(StandIn):
    """Stands for vision_msgs/ObjectHypothesisWithPose."""

    __slots__ = ("hypothesis", "pose")

    def __init__(self) -> None:
        super().__init__(hypothesis=ObjectHypothesis(), pose=PoseWithCovariance())


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


class Told:
    """A publisher of messages that the middleware does not know."""

    def __init__(self) -> None:
        self.messages: list[Any] = []

    def publish(self, message: Any) -> None:
        self.messages.append(message)


class BridgeWithPackages(BridgeNode):
    """The node where moveit_msgs and vision_msgs are installed."""

    def __init__(self) -> None:
        self.told: dict[str, Told] = {}
        super().__init__()

    def create_publisher(self, kind: Any, topic: str, *more: Any) -> Any:
        if issubclass(kind, StandIn):
            return self.told.setdefault(topic, Told())
        return super().create_publisher(kind, topic, *more)


def test_where_the_packages_are_installed_plans_and_objects_are_told_to_them(
    probe: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, messages in (("moveit_msgs", MOVEIT), ("vision_msgs", VISION)):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(msg=messages))
        monkeypatch.setitem(sys.modules, f"{name}.msg", messages)
    node = BridgeWithPackages()
    probe.run_with(node)
    probe.create_publisher(msgs.GraspPlan, "/intent/grasp_plan", LATCHED).publish(plan())
    mug = msgs.RecognizedObject(id="mug_1", model="mug_1", object_class="mug", confidence=0.8)
    seen = msgs.RecognizedObjects(objects=[mug])
    probe.create_publisher(msgs.RecognizedObjects, "/intent/objects", LATCHED).publish(seen)
    grasps = node.told["intent/moveit_grasps"].messages
    found = node.told["intent/detections"].messages
    assert probe.until(lambda: len(grasps) == 2 and len(found) == 1, 10.0), probe.warnings
    assert [grasp.id for grasp in grasps] == ["mug_1_1", "mug_1_2"]
    assert found[0].detections[0].bbox.size.z > 0.05  # of the shipped mug [m]


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
