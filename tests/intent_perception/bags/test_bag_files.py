"""Bags keep every pixel, and a damaged one is refused with its name."""

from pathlib import Path

import numpy as np
import pytest

from intent_perception.bags.bag_files import (
    BagWriter,
    image_topics,
    read_frames,
    read_messages,
    transcode,
)
from intent_perception.bags.bag_images import DEPTH_FORMATS
from intent_perception.geometry.camera import Camera, RgbdFrame

CAMERA = Camera(64, 48, 52.5, 52.5, 31.5, 23.5)
PERIOD = 33_333_333


def frames(count: int = 3) -> list[RgbdFrame]:
    rng = np.random.default_rng(0)
    result = []
    for index in range(count):
        millimetres = rng.integers(400, 2000, (48, 64)) * (rng.random((48, 64)) > 0.1)
        depth = millimetres.astype(np.float32) / np.float32(1000.0)
        color = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
        result.append(RgbdFrame(10**18 + index * PERIOD, color, depth, CAMERA))
    return result


def written(path: Path, count: int = 3, **options: str) -> Path:
    with BagWriter(path, **options) as writer:  # type: ignore[arg-type]
        for frame in frames(count):
            writer.write(frame)
    return path


@pytest.mark.parametrize("depth", DEPTH_FORMATS)
def test_every_depth_format_returns_the_written_depth_exactly(tmp_path: Path, depth: str) -> None:
    read = list(read_frames(written(tmp_path / "bag", depth=depth)))
    for got, expected in zip(read, frames(), strict=True):
        np.testing.assert_array_equal(got.depth, expected.depth)
        assert (got.stamp, got.camera) == (expected.stamp, expected.camera)


def test_raw_colour_is_returned_exactly(tmp_path: Path) -> None:
    for got, expected in zip(
        read_frames(written(tmp_path / "bag", color="raw")), frames(), strict=True
    ):
        np.testing.assert_array_equal(got.color, expected.color)


@pytest.mark.parametrize("depth", DEPTH_FORMATS)
def test_transcoding_depth_changes_no_value(tmp_path: Path, depth: str) -> None:
    bag = written(tmp_path / "bag")
    transcode(bag, tmp_path / "other", depth)
    for got, expected in zip(read_frames(tmp_path / "other"), read_frames(bag), strict=True):
        np.testing.assert_array_equal(got.depth, expected.depth)
        np.testing.assert_array_equal(got.color, expected.color)


def test_the_stamp_read_from_cdr_is_that_of_the_decoded_message(tmp_path: Path) -> None:
    for message in read_messages(written(tmp_path / "bag")):
        stamp = message.decoded().header.stamp
        assert message.stamp == stamp.sec * 10**9 + stamp.nanosec


def test_a_truncated_bag_is_refused_with_its_name_and_a_remedy(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag")
    (file,) = bag.glob("*.mcap")
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(ValueError, match=r"bag .*bag is damaged or was not closed.*reindex"):
        list(read_frames(bag))


def test_an_empty_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is empty"):
        list(read_frames(written(tmp_path / "bag", count=0)))


def test_a_folder_without_metadata_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is not a rosbag2 folder"):
        image_topics(tmp_path)
