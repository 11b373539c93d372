"""In lockstep every frame gets one scene state, and the same depth gives the same bits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from intent_msgs.msg import RecognizedObjects, SceneState
from tests.support.harness import Graph, Probe, cut_bag, shipped_bag

from intent_perception.bags.bag_files import read_frames, transcode
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.ros.node import RESULTS

ROOT = Path(__file__).resolve().parent.parent.parent
LOCKSTEP = ROOT / "src" / "intent_imitation" / "config" / "lockstep.yaml"
FRAMES = slice(10, 30)  # the hand comes into view
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same frames with depth stored in three ways."""
    path = tmp_path_factory.mktemp("bags")
    cut_bag(shipped_bag("pour_bottle"), path / "compressedDepth", FRAMES)
    for depth in ("16UC1", "32FC1"):
        transcode(path / "compressedDepth", path / depth, depth)
    return path


@pytest.fixture(scope="module")
def runs(folder: Path) -> dict[str, dict[str, list[Any]]]:
    """What the nodes said about each of them: {depth format: {topic: messages}}."""
    return {bag.name: _heard(bag) for bag in sorted(folder.iterdir())}


def _heard(bag: Path) -> dict[str, list[Any]]:
    """Play a bag through recognizer and tracker in lockstep; return what they said."""
    rclpy.init()
    graph, probe = Graph(bag), Probe()
    try:
        probe.listen(SceneState, "/intent/scene_state", RESULTS)
        probe.listen(RecognizedObjects, "/intent/objects")
        transport = "compressedDepth" if bag.name == "compressedDepth" else "raw"
        parameters = ["--ros-args", "--params-file", str(LOCKSTEP)]
        parameters += ["-p", f"depth_transport:={transport}"]
        graph.start("intent_perception", "recognizer", *parameters)
        graph.start("intent_tracking", "tracker", *parameters)
        waits = ["--subscribers", "2", "--listeners", "2", "--wait", "240", "--timeout", "240"]
        player = graph.start("intent_perception", "replay", str(bag), "--lockstep", *waits)
        probe.until(lambda: not graph.alive(player), timeout=480.0)
        assert graph.wait(player) == 0, graph.log(player)
        probe.until(lambda: False, timeout=0.5)
        return probe.heard
    finally:
        graph.stop()
        probe.close()
        rclpy.try_shutdown()


def test_every_frame_gets_one_scene_state_with_the_stamp_of_its_depth(
    folder: Path, runs: dict[str, dict[str, list[Any]]]
) -> None:
    stamps = [frame.stamp for frame in read_frames(folder / "16UC1")]
    assert [stamp_of(state) for state in runs["16UC1"]["/intent/scene_state"]] == stamps


def test_a_scene_state_has_exactly_26_values_and_six_for_each_object(
    runs: dict[str, dict[str, list[Any]]],
) -> None:
    for state in runs["16UC1"]["/intent/scene_state"]:
        assert len(state.state) == 26 + 6 * len(state.object_ids) > 26
        assert len(state.state_std) == len(state.state)


def test_an_unseen_hand_is_nan_and_its_flag_is_down(
    runs: dict[str, dict[str, list[Any]]],
) -> None:
    first = runs["16UC1"]["/intent/scene_state"][0]
    assert not first.hand_visible
    assert np.isnan(first.state[:26]).all()


@pytest.mark.parametrize("other", ["32FC1", "compressedDepth"])
def test_the_same_millimetres_give_the_same_bits_in_every_depth_format(
    runs: dict[str, dict[str, list[Any]]], other: str
) -> None:
    for topic in ("/intent/objects", "/intent/scene_state"):
        assert len(runs["16UC1"][topic]) == len(runs[other][topic])
        for one, two in zip(runs["16UC1"][topic], runs[other][topic], strict=True):
            assert str(one) == str(two)
