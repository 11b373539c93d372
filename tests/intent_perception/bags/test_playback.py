"""The player groups a bag's messages by frame and plays them on the nodes' topics."""

from pathlib import Path

import numpy as np

from intent_perception.bags.bag_files import BagWriter, image_topics, read_messages
from intent_perception.bags.playback import bundles, parse_options, target_topic, transports
from intent_perception.geometry.camera import Camera, RgbdFrame

CAMERA = Camera(64, 48, 52.5, 52.5, 31.5, 23.5)
PERIOD = 33_333_333


def written(path: Path, depth: str = "16UC1", count: int = 4) -> str:
    with BagWriter(path, depth=depth) as writer:
        for index in range(count):
            color = np.zeros((48, 64, 3), np.uint8)
            measured = np.ones((48, 64), np.float32)
            writer.write(RgbdFrame(10**18 + index * PERIOD, color, measured, CAMERA))
    return str(path)


def test_every_frame_is_one_bundle_with_the_stamp_of_its_depth(tmp_path: Path) -> None:
    played = list(bundles(written(tmp_path / "bag")))
    assert [bundle.stamp for bundle in played] == [10**18 + k * PERIOD for k in range(4)]
    assert all(len(bundle.messages) == 3 for bundle in played)


def test_bundles_together_are_the_bag(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag")
    played = [message for bundle in bundles(bag) for message in bundle.messages]
    assert played == list(read_messages(bag))


def test_a_start_offset_leaves_out_what_was_before_it(tmp_path: Path) -> None:
    played = list(bundles(written(tmp_path / "bag"), start_offset=0.05))
    assert [bundle.stamp for bundle in played] == [10**18 + k * PERIOD for k in (2, 3)]


def test_compressed_images_are_played_on_the_topics_of_their_transport(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag", depth="compressedDepth", count=1)
    targets = [target_topic(message, image_topics(bag)) for message in read_messages(bag)]
    assert targets == [
        "rgb/camera_info",
        "rgb/image_rect_color/compressed",
        "depth_registered/image_rect/compressedDepth",
    ]
    assert transports(bag) == ("compressed", "compressedDepth")


def test_the_options_have_the_defaults_of_ros2_bag_play() -> None:
    options = parse_options(["BAG"])
    assert (options.rate, options.loop, options.start_offset) == (1.0, False, 0.0)
