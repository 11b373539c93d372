"""The recognizer node answers once, survives bad frames and says what it is waiting for."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from intent_msgs.msg import RecognizedObjects
from rclpy.node import Node
from rclpy.parameter import Parameter
from tests.support.harness import SECOND, Graph, Probe, ros_arguments

from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.ros.convert import objects_from_msg
from intent_perception.ros.declared import declared
from intent_perception.ros.frame_subscription import InputConfig
from intent_perception.ros.recognizer_node import RecognizerNode
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

PERIOD = SECOND // 30


@cache
def scene() -> RgbdFrame:
    """A bottle and a hammer on a table."""
    database = ObjectDatabase.load()
    models = [database["bottle_2"], database["hammer_0"]]
    frame = tabletop_scene(models, np.random.default_rng(0)).frame
    return replace(frame, stamp=1_000 * SECOND)


@pytest.fixture
def node(probe: Probe) -> RecognizerNode:
    probe.listen(RecognizedObjects, "/intent/objects")
    recognizer = RecognizerNode()
    probe.run_with(recognizer)
    assert probe.until(probe.connected)
    return recognizer


def later(frames: int) -> RgbdFrame:
    return replace(scene(), stamp=scene().stamp + frames * PERIOD)


def answered(probe: Probe) -> bool:
    return any(message.complete for message in probe.heard["/intent/objects"])


@pytest.mark.usefixtures("node")
def test_the_objects_on_the_table_are_published_with_the_stamp_of_the_depth(probe: Probe) -> None:
    probe.send(scene())
    assert probe.until(lambda: answered(probe))
    objects = objects_from_msg(probe.heard["/intent/objects"][-1])
    assert {item.object_class for item in objects.objects} == {"bottle", "hammer"}
    assert objects.stamp == scene().stamp


@pytest.mark.usefixtures("node")
@pytest.mark.parametrize(
    ("depth", "reason"),
    [
        (np.ones((240, 320), np.float32), "depth must be aligned"),
        (np.full((480, 640), np.nan, np.float32), "holds no measurement"),
        (np.zeros((480, 640), np.uint8), "expected rows of at least"),
    ],
    ids=["wrong size", "all NaN", "wrong row length"],
)
def test_a_bad_frame_costs_one_warning_and_the_next_good_one_is_answered(
    probe: Probe, depth: np.ndarray, reason: str
) -> None:
    for index in range(3):
        probe.send(later(index), depth)
    assert probe.until(lambda: bool(probe.warnings))
    probe.send(later(3))
    assert probe.until(lambda: answered(probe))
    (warning,) = probe.warnings
    assert reason in warning


@pytest.mark.usefixtures("node")
def test_a_camera_info_that_never_comes_is_named_once(probe: Probe) -> None:
    probe.send(scene(), info=False)
    assert probe.until(lambda: bool(probe.warnings))
    probe.until(lambda: len(probe.warnings) > 1, timeout=2.5)
    (warning,) = probe.warnings
    assert "waiting for camera_info" in warning


@pytest.mark.usefixtures("node")
def test_after_a_jump_back_of_the_clock_the_node_answers_again(probe: Probe) -> None:
    probe.send(later(300))
    assert probe.until(lambda: answered(probe))
    probe.send(scene())
    assert probe.until(lambda: sum(m.complete for m in probe.heard["/intent/objects"]) == 2)


@pytest.mark.usefixtures("node")
def test_two_cameras_of_two_clocks_cost_one_warning_and_the_newer_is_followed(
    probe: Probe,
) -> None:
    for index in range(6):
        probe.send(later(300_000 + 10 * index))
        probe.send(later(index))
        probe.until(lambda: False, timeout=0.2)
    newest = later(300_000 + 50).stamp
    assert probe.until(lambda: bool(probe.warnings))
    (warning,) = probe.warnings
    assert "images of two clocks come on /" in warning
    assert "(1 publishers)" in warning
    stamps = [stamp_of(message) for message in probe.heard["/intent/objects"]]
    assert newest >= stamps[-1] >= later(300_000).stamp


def test_a_wrong_parameter_ends_the_node_with_one_sentence(graph: Graph) -> None:
    name = graph.start(
        "intent_perception", "recognizer", *ros_arguments("models:=/no/such/file.yaml")
    )
    assert graph.wait(name) == 1
    assert "an object database (YAML file or folder)" in graph.log(name)
    assert "Traceback" not in graph.log(name)


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("queue:=-3", "expected parameter queue in 1..1000, got -3"),
        ("queue:=abc", "expected parameter queue as an integer in 1..1000, got 'abc'"),
        ("change.edge:=7.0", "expected parameter change.edge in 0..1 [m], got 7.0"),
        ("color_transport:=jpeg", "as 'raw' or 'compressed', got 'jpeg'"),
    ],
)
def test_a_parameter_out_of_range_ends_the_node_with_one_sentence(
    graph: Graph, setting: str, sentence: str
) -> None:
    name = graph.start("intent_perception", "recognizer", *ros_arguments(setting))
    assert graph.wait(name) == 1
    said = [line for line in graph.log(name).splitlines() if "FATAL" in line]
    assert len(said) == 1
    assert sentence in said[0]
    assert "Traceback" not in graph.log(name)


def test_ranges_and_types_are_declared_and_an_integer_will_do_for_a_number(probe: Probe) -> None:
    node = Node("camera", parameter_overrides=[Parameter("silence", value=3)])
    probe.run_with(node)
    assert declared(node, InputConfig()).silence == node.get_parameter("silence").value == 3.0
    silence, queue = (node.describe_parameter(name) for name in ("silence", "queue"))
    assert silence.type == Parameter.Type.DOUBLE.value
    assert (silence.floating_point_range[0].to_value, queue.integer_range[0].to_value) == (
        3600.0,
        1000,
    )
    assert queue.read_only
    assert not queue.dynamic_typing


def test_a_folder_that_is_no_bag_is_refused_with_one_sentence(graph: Graph, tmp_path: Path) -> None:
    name = graph.start("intent_perception", "replay", str(tmp_path))
    assert graph.wait(name) == 1
    assert "is not a rosbag2 folder" in graph.log(name)
