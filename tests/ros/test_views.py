"""What an operator opens exists: the topics of the RViz view, the picture, the page."""

import ast
import json
import time
import urllib.request
from pathlib import Path
from typing import Any
from urllib.error import HTTPError

import cv2
import numpy as np
import pytest
import yaml
from intent_msgs.msg import SceneState, TaskPosterior
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header
from tests.conftest import ROOT
from tests.support.demo_records import record
from tests.support.harness import Graph, Probe, ros_arguments
from visualization_msgs.msg import MarkerArray

from intent_imitation.ros.viewer_node import ViewerNode
from intent_inference.ros.convert import posterior_to_msg
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import LATCHED, RESULTS
from intent_tracking.ros.convert import state_to_msg

VIEW = ROOT / "src" / "intent_imitation" / "rviz" / "intent.rviz"


def published() -> set[str]:
    """Every topic that a node of ours names as a publisher."""
    found = set()
    for path in (ROOT / "src").glob("intent_*/intent_*/ros/*.py"):
        for call in ast.walk(ast.parse(path.read_text())):
            name = ast.unparse(call.func) if isinstance(call, ast.Call) else ""
            if name.endswith(("create_publisher", "LatestResult", "ResultOnDemand")):
                values = {a.value for a in call.args if isinstance(a, ast.Constant)}
                found |= {value for value in values if isinstance(value, str)}
    return found


def test_every_topic_of_the_rviz_view_is_published_and_heard_as_it_is_offered() -> None:
    displays = yaml.safe_load(VIEW.read_text())["Visualization Manager"]["Displays"]
    topics = {d["Topic"]["Value"]: d["Topic"] for d in displays if "Topic" in d}
    assert {topic[1:] for topic in topics} <= published()
    latched = {t for t, d in topics.items() if d["Durability Policy"] == "Transient Local"}
    assert latched == {"/intent/markers"}


def test_who_opens_rviz_later_is_told_the_objects_alone(probe: Probe) -> None:
    objects = LatestResult(probe, MarkerArray, "intent/markers")
    hand = probe.create_publisher(MarkerArray, "intent/hand/markers", 10)
    objects.publish(MarkerArray(markers=[]))
    for _ in range(30):
        hand.publish(MarkerArray())
    probe.listen(MarkerArray, "intent/markers")
    kept = probe.heard["intent/markers"]
    assert probe.until(lambda: len(kept) == 1)


def fetch(port: int, path: str, host: str = "") -> tuple[int, bytes]:
    """Ask the page."""
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}")
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=5.0) as answer:
            return answer.status, answer.read()
    except HTTPError as error:
        return error.code, error.read()


@pytest.mark.slow
def test_the_viewer_draws_only_while_somebody_looks_and_shows_page_and_picture(
    graph: Graph, probe: Probe, tmp_path: Path
) -> None:
    port = 18_765
    name = graph.start("intent_imitation", "viewer", *ros_arguments(f"port:={port}", "rate:=30.0"))
    probe.listen(Header, "/viewer/ready")
    assert probe.until(lambda: bool(probe.heard["/viewer/ready"]), 120.0), graph.log(name)
    probe.until(lambda: False, timeout=1.0)
    assert probe.count_subscribers("/rgb/image_rect_color") == 0  # nobody looks
    assert json.loads(fetch(port, "/state.json")[1])["tasks"] == []
    assert probe.until(lambda: probe.count_subscribers("/rgb/image_rect_color") == 1, 10.0)
    run = record(ObjectDatabase.load())
    states = probe.create_publisher(SceneState, "intent/scene_state", RESULTS)
    posteriors = probe.create_publisher(TaskPosterior, "intent/task_posterior", LATCHED)
    posteriors.publish(posterior_to_msg(run.posteriors[-1]))
    probe.listen(CompressedImage, "/intent/image/compressed", 1)

    def play() -> bool:
        play_once(probe, run, states)
        return bool(probe.heard["/intent/image/compressed"])

    assert probe.until(play, 20.0), graph.log(name)
    shown = probe.heard["/intent/image/compressed"][-1]
    picture = cv2.imdecode(np.frombuffer(bytes(shown.data), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (480, 640 + 260, 3)
    told = json.loads(fetch(port, "/state.json")[1])
    assert (told["object"], len(told["tasks"])) == ("mug 1", 5)
    assert fetch(port, "/image.jpg")[1][:2] == b"\xff\xd8"
    assert b"<canvas" in fetch(port, "/")[1]
    assert fetch(port, "/", host="elsewhere.example")[0] == 403
    assert fetch(port, "/etc/passwd")[0] == 404


def play_once(probe: Probe, run: Any, states: Any) -> None:
    """Send the last frame of a run, and its state, again."""
    frame, state = run.frames[-1], run.states[-1]
    probe.send(RgbdFrame(state.stamp, frame.color, frame.depth, frame.camera))
    states.publish(state_to_msg(state))
    probe.until(lambda: False, timeout=0.1)


def test_pictures_come_no_faster_than_the_rate(probe: Probe) -> None:
    node = ViewerNode()
    probe.run_with(node)
    probe.listen(CompressedImage, "/intent/image/compressed", 1)
    run = record(ObjectDatabase.load())
    states = probe.create_publisher(SceneState, "intent/scene_state", RESULTS)
    shown = probe.heard["/intent/image/compressed"]
    assert probe.until(lambda: probe.count_subscribers("/rgb/image_rect_color") == 1, 10.0)
    start, sent = time.monotonic(), 0
    while time.monotonic() - start < 2.0:
        frame, state = run.frames[-1], run.states[-1]
        probe.send(RgbdFrame(state.stamp, frame.color, frame.depth, frame.camera))
        states.publish(state_to_msg(state))
        probe.until(lambda: False, timeout=0.02)
        sent += 1
    lasted = time.monotonic() - start
    assert 1 <= len(shown) <= 8.0 * lasted + 2  # the node's default rate
    assert sent > len(shown)
