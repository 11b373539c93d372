"""Two graphs side by side, each in a namespace: all topics are their own, nothing mixes."""

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from intent_msgs.msg import GraspPlan, RecognizedObjects, SceneState, StableGrasp, TaskPosterior
from std_msgs.msg import Header
from tests.conftest import ROOT
from tests.ros.test_live_messages import grasp
from tests.support.harness import Graph, Probe, cut_bag, shipped_bag

from intent_imitation.ros.graph import NODES
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject
from intent_perception.recognition.recognizer import RecognizedObjects as Recognized
from intent_perception.ros.convert import objects_to_msg
from intent_perception.ros.node import LATCHED

SHARED = {"/rosout", "/parameter_events", "/diagnostics", "/tf_static", "/clock"}
"""What one machine has once: the log, the operator's view, the drivers' tree, the time."""
NAMING = (
    "create_publisher", "create_subscription", "create_service", "create_client", "listen",
    "listen_for_news", "listen_for_objects", "learn_shapes", "LatestResult",
)  # fmt: skip
"""What names a topic or a service."""


def test_no_node_names_a_topic_absolutely_but_what_is_shared() -> None:
    found = []
    for path in sorted((ROOT / "src").glob("intent_*/intent_*/ros/*.py")):
        if path.stem == "realtime_probe_node":  # in a domain of its own
            continue
        for call in ast.walk(ast.parse(path.read_text())):
            called = ast.unparse(call.func) if isinstance(call, ast.Call) else ""
            if called.rpartition(".")[2] in NAMING:
                words = {word.value for word in call.args if isinstance(word, ast.Constant)}
                found += [f"{path.name}: {w}" for w in words - SHARED if str(w).startswith("/")]
    assert found == []


def in_namespace(name: str, *more: str) -> list[str]:
    return ["--ros-args", "-r", f"__ns:=/{name}", *more]


def table_of(mug: str, frame: str) -> Any:
    """A table with one mug."""
    pose = make_pose(np.eye(3), np.array([0.0, 0.0, 0.05]))
    item = RecognizedObject(mug, mug, "mug", pose, 0.9, 1.0)
    return objects_to_msg(
        Recognized(1, (item,), np.eye(4)), ObjectDatabase.load(), table_frame=frame
    )


@pytest.mark.slow
def test_two_graphs_answer_their_own_grasps_alone(graph: Graph, probe: Probe) -> None:
    remapped = ("-r", "imitation/robot_objects:=intent/objects")
    mugs = {"left": "mug_0", "right": "mug_3"}
    for side in mugs:
        graph.start("intent_inference", "inference", *in_namespace(side))
        graph.start("intent_imitation", "imitation", *in_namespace(side, *remapped))
        for name in ("inference", "imitation"):
            probe.listen(Header, f"/{side}/{name}/ready")
        probe.listen(TaskPosterior, f"/{side}/intent/task_posterior")
        probe.listen(GraspPlan, f"/{side}/intent/grasp_plan")
    ready = [f"/{side}/{name}/ready" for side in mugs for name in ("inference", "imitation")]
    assert probe.until(lambda: all(probe.heard[topic] for topic in ready), timeout=240.0)
    for second, (side, mug) in enumerate(mugs.items(), start=1):
        tables = probe.create_publisher(RecognizedObjects, f"/{side}/intent/objects", LATCHED)
        tables.publish(table_of(mug, f"{side}_table"))
        grasps = probe.create_publisher(StableGrasp, f"/{side}/intent/stable_grasp", LATCHED)
        message = grasp(second * 1_000_000_000)
        message.object_id, message.header.frame_id = mug, f"{side}_table"
        grasps.publish(message)
    posteriors = {side: probe.heard[f"/{side}/intent/task_posterior"] for side in mugs}
    assert probe.until(lambda: all(posteriors.values()), timeout=20.0)
    for side, mug in mugs.items():
        (posterior,) = posteriors[side]
        assert (posterior.object_id, posterior.header.frame_id) == (mug, f"{side}_table")
        wanted = TaskPosterior(tasks=["hand-over"], probability=[0.9], best="hand-over")
        wanted.intends, wanted.stage = [0.9, 0.1], "GRASP"
        probe.create_publisher(TaskPosterior, f"/{side}/intent/task_posterior", LATCHED).publish(
            wanted
        )
    plans = {side: probe.heard[f"/{side}/intent/grasp_plan"] for side in mugs}
    assert probe.until(lambda: all(plans.values()), timeout=20.0)
    for side, mug in mugs.items():
        assert [choice.id for choice in plans[side][-1].objects] == [mug]
        assert plans[side][-1].header.frame_id == f"{side}_table"


@pytest.mark.slow
def test_every_topic_of_a_graph_is_in_its_namespace_and_frames_are_named_by_parameter(
    graph: Graph, probe: Probe, tmp_path: Path
) -> None:
    bag = cut_bag(shipped_bag("pour_bottle"), tmp_path / "bag", slice(10, 12))
    lockstep = str(ROOT / "src" / "intent_imitation" / "config" / "lockstep.yaml")
    named = ("-p", "table_frame:=left_table", "-p", "depth_transport:=compressedDepth")
    for name in ("recognizer", "tracker"):
        graph.start(NODES[name], name, *in_namespace("left", "--params-file", lockstep, *named))
    probe.listen(SceneState, "/left/intent/scene_state", 10)
    wait = ("--subscribers", "2", "--wait", "120", "--timeout", "120")
    player = graph.start(
        "intent_perception", "replay", str(bag), "--lockstep", *wait, *in_namespace("left")
    )
    states = probe.heard["/left/intent/scene_state"]
    assert probe.until(lambda: bool(states) or not graph.alive(player), timeout=150.0)
    assert states, graph.log(player)
    assert states[0].header.frame_id == "left_table"
    cameras = {"/rgb/image_rect_color", "/rgb/camera_info", "/depth_registered/image_rect"}
    topics = {name for name, _ in probe.get_topic_names_and_types()} - SHARED - cameras
    assert {topic for topic in topics if not topic.startswith("/left/")} == set()
