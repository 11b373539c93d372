"""Whatever the graph publishes can be recorded, and reads back with rosbags."""

import threading
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from intent_msgs import msg as msgs
from rclpy.node import Node
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage, JointState
from std_msgs.msg import Header
from tests.ros.test_views import published
from tests.support.harness import Probe
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import MarkerArray

from intent_perception.ros.node import LATCHED
from intent_perception.ros.stand_in.bag_record import record
from intent_perception.ros.stand_in.ros2_command import message_class, plain

JOINTS = JointState(name=["thumb"], position=[0.5])
"""Its last field is an empty `float64[]`."""
MESSAGES: dict[str, Any] = {
    "intent/objects": msgs.RecognizedObjects(objects=[msgs.RecognizedObject(id="mug_0")]),
    "intent/shapes": msgs.ObjectShapes(shapes=[msgs.ObjectShape(id="thing_0")]),
    "intent/scene_state": msgs.SceneState(state=[0.1] * 26, hand_side="right"),
    "intent/hand/joint_states": JOINTS,
    "intent/stable_grasp": msgs.StableGrasp(object_id="mug_0"),
    "intent/task_posterior": msgs.TaskPosterior(tasks=["pouring"], probability=[0.5]),
    "intent/grasp_plan": msgs.GraspPlan(grasps=[msgs.RobotGrasp(pregrasp=JOINTS, grasp=JOINTS)]),
    "intent/markers": MarkerArray(),
    "intent/hand/markers": MarkerArray(),
    "intent/image/compressed": CompressedImage(format="jpeg", data=b"\xff\xd8"),
    "intent/hand_trajectory": JointTrajectory(
        joint_names=["thumb"], points=[JointTrajectoryPoint(positions=[0.5])]
    ),
    "tf": TFMessage(),
    "tf_static": TFMessage(transforms=[TransformStamped(child_frame_id="table")]),
    "/diagnostics": DiagnosticArray(status=[DiagnosticStatus(name="tracker", level=b"\x01")]),
    "tracker/ready": Header(frame_id="table"),
    "/clock": Clock(),
}
OPTIONAL = {"intent/moveit_grasps", "intent/detections"}
"""Of packages that an installation may lack."""


def test_no_topic_of_a_node_is_left_out_here() -> None:
    said = {topic for topic in published() if not topic.startswith("~/")}
    assert said - set(MESSAGES) - OPTIONAL == set()


def same(sent: Any, read: Any) -> bool:
    """Whether a message, as dictionaries and lists, is what rosbags has read."""
    if isinstance(sent, dict):
        return all(same(value, getattr(read, name)) for name, value in sent.items())
    if isinstance(sent, list):
        return len(sent) == len(read) and all(map(same, sent, list(read)))
    return bool(sent == read)


@pytest.mark.parametrize("empty", [False, True], ids=["filled", "empty"])
def test_every_topic_of_the_graph_reads_back_with_rosbags(
    probe: Probe, tmp_path: Path, empty: bool
) -> None:
    sent = {topic: type(m)() if empty else m for topic, m in MESSAGES.items()}
    for topic, message in sent.items():
        probe.create_publisher(type(message), topic, LATCHED).publish(message)
    ears = Node("ears")
    bag = tmp_path / "bag"
    recorder = threading.Thread(target=record, args=(ears, list(sent), bag, message_class, 3.0))
    recorder.start()
    probe.until(lambda: not recorder.is_alive(), timeout=20.0)
    recorder.join()
    ears.destroy_node()
    with AnyReader([bag]) as reader:
        read = {
            connection.topic: reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }
    assert set(read) == {f"/{topic.lstrip('/')}" for topic in sent}
    for topic, message in sent.items():
        assert same(plain(message), read[f"/{topic.lstrip('/')}"]), topic


def test_a_bag_that_exists_is_not_written_over(probe: Probe, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="exists"):
        record(probe, ["tf"], tmp_path, message_class, 0.1)
