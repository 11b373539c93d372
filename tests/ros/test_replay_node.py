"""`replay` plays a bag as `ros2 bag play` does: in time, looped, with a clock, paused."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tests.support.harness import SECOND, Graph, Probe

from intent_perception.bags.bag_files import BagWriter
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.ros.node import LATCHED

COLOR, INFO = "/rgb/image_rect_color", "/rgb/camera_info"
COUNT, PERIOD = 4, SECOND // 10
START = 50 * SECOND
STAMPS = [START + index * PERIOD for index in range(COUNT)]
pytestmark = pytest.mark.slow


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Four small frames, a tenth of a second apart."""
    camera = Camera(32, 24, 30.0, 30.0, 16.0, 12.0)
    color, depth = np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32)
    frame = RgbdFrame(START, color, depth, camera)
    with BagWriter(tmp_path / "bag", color="raw") as writer:
        for stamp in STAMPS:
            writer.write(replace(frame, stamp=stamp))
    return tmp_path / "bag"


def play(graph: Graph, bag: Path, *options: str) -> str:
    return graph.start("intent_perception", "replay", str(bag), "--subscribers", "1", *options)


def stamps(probe: Probe, topic: str = COLOR) -> list[int]:
    return [stamp_of(message) for message in probe.heard[topic]]


@pytest.fixture
def listening(probe: Probe) -> Probe:
    """A probe that hears colour and camera_info."""
    probe.listen(Image, COLOR, 10)
    probe.listen(CompressedImage, "/depth_registered/image_rect/compressedDepth", 10)
    probe.listen(CameraInfo, INFO, 10)
    return probe


def test_in_a_loop_the_bag_starts_again(bag: Path, graph: Graph, listening: Probe) -> None:
    name = play(graph, bag, "--loop", "--rate", "4")
    assert listening.until(lambda: len(stamps(listening)) >= 2 * COUNT + 1)
    assert graph.alive(name)
    assert stamps(listening)[: 2 * COUNT + 1] == [*STAMPS, *STAMPS, START]


def test_the_clock_shows_the_stamps(bag: Path, graph: Graph, listening: Probe) -> None:
    listening.listen(Clock, "/clock", 10)
    name = play(graph, bag, "--clock")
    assert listening.until(lambda: not graph.alive(name))
    listening.until(lambda: len(listening.heard["/clock"]) == COUNT, timeout=2.0)
    clocks = [m.clock.sec * SECOND + m.clock.nanosec for m in listening.heard["/clock"]]
    assert clocks == STAMPS


def test_an_offset_leaves_the_first_frames_out(bag: Path, graph: Graph, listening: Probe) -> None:
    name = play(graph, bag, "--start-offset", "0.15")
    assert listening.until(lambda: not graph.alive(name))
    listening.until(lambda: len(stamps(listening, INFO)) >= 2, timeout=2.0)
    assert stamps(listening) == STAMPS[2:]
    assert stamps(listening, INFO) == STAMPS[2:]


def test_the_rate_stretches_time(bag: Path, graph: Graph, listening: Probe) -> None:
    arrived: list[float] = []
    listening.create_subscription(Image, COLOR, lambda _: arrived.append(time.monotonic()), 10)
    play(graph, bag, "--rate", "0.25")
    assert listening.until(lambda: len(arrived) == COUNT)
    assert arrived[-1] - arrived[0] > 0.9 * (COUNT - 1) * PERIOD / SECOND / 0.25


def test_a_paused_player_waits_for_resume(bag: Path, graph: Graph, listening: Probe) -> None:
    play(graph, bag, "--start-paused")
    resume = listening.create_client(Trigger, "/replay/resume")
    assert listening.until(resume.service_is_ready)
    listening.until(lambda: bool(stamps(listening)), timeout=1.0)
    assert not stamps(listening)
    resume.call_async(Trigger.Request())
    assert listening.until(lambda: stamps(listening) == STAMPS)


def test_where_nobody_listens_nothing_is_played_and_the_remedy_is_named(
    bag: Path, graph: Graph, probe: Probe
) -> None:
    name = play(graph, bag, "--wait", "1")
    assert probe.until(lambda: not graph.alive(name))
    assert graph.wait(name) != 0
    assert "start the nodes first" in graph.log(name)


def test_a_node_that_is_not_ready_is_waited_for(bag: Path, graph: Graph, listening: Probe) -> None:
    ready = listening.create_publisher(Header, "/tracker/ready", LATCHED)
    name = play(graph, bag, "--await", "tracker", "--timeout", "3")
    listening.until(lambda: False, timeout=3.0)
    assert stamps(listening) == []
    ready.publish(Header())
    assert listening.until(lambda: not graph.alive(name))
    assert stamps(listening) == STAMPS
