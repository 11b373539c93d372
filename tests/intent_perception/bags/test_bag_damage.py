"""Damaged bags: what can be read is read, what is missing is said, every refusal has a remedy."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.intent_perception.bags.test_bag_files import frames, written

from intent_perception.bags.bag_files import BagWriter, read_frames, read_messages
from intent_perception.geometry.camera import KINECT, RgbdFrame


def noisy_bag(path: Path, count: int = 12, stamps: Callable[[int], int] | None = None) -> Path:
    """A bag of several chunks: noise does not compress."""
    rng = np.random.default_rng(0)
    color = rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)
    depth = rng.uniform(0.5, 1.0, (480, 640)).astype(np.float32)
    with BagWriter(path) as writer:
        for k in range(count):
            stamp = 10**9 + 33_000_000 * k if stamps is None else stamps(k)
            writer.write(RgbdFrame(stamp, color, depth, KINECT))
    return path


def flipped(bag: Path, share: float) -> Path:
    (file,) = bag.glob("*.mcap")
    content = bytearray(file.read_bytes())
    content[int(share * len(content))] ^= 1
    file.write_bytes(content)
    return bag


def test_a_flipped_bit_costs_the_frames_around_it_and_they_are_counted(tmp_path: Path) -> None:
    bag, said = flipped(noisy_bag(tmp_path / "bag"), 0.5), list[str]()
    read = [frame.stamp for frame in read_frames(bag, on_bad_frame=said.append)]
    assert 8 <= len(read) < 12
    assert any("messages of the bag" in text and "left out" in text for text in said)
    assert read[0] == 10**9
    assert read[-1] == 10**9 + 11 * 33_000_000


def test_a_flipped_bit_is_an_error_where_nobody_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is damaged"):
        list(read_frames(flipped(noisy_bag(tmp_path / "bag"), 0.5)))


def test_a_damaged_index_is_said(tmp_path: Path) -> None:
    bag = noisy_bag(tmp_path / "bag")
    (file,) = bag.glob("*.mcap")
    content = bytearray(file.read_bytes())
    content[-400] ^= 1
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"the index of .* is damaged"):
        list(read_frames(bag))


def test_one_message_that_is_none_costs_its_own_frame_only(tmp_path: Path) -> None:
    source, said = written(tmp_path / "bag", count=5), list[str]()
    with BagWriter(tmp_path / "other") as writer:
        for number, message in enumerate(read_messages(source)):
            cut = message.data[: len(message.data) // 2] if number == 7 else message.data
            writer.append_raw(type(message)(message.topic, message.type, message.received, cut))
    assert len(list(read_frames(tmp_path / "other", on_bad_frame=said.append))) == 4
    assert said


def test_a_bare_file_and_a_folder_without_metadata_are_read(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag")
    (file,) = bag.glob("*.mcap")
    whole = [frame.stamp for frame in read_frames(bag)]
    (bag / "metadata.yaml").unlink()
    assert [frame.stamp for frame in read_frames(bag)] == whole
    assert [frame.stamp for frame in read_frames(file)] == whole


def test_a_bag_of_ros_1_gets_the_command_that_converts_it(tmp_path: Path) -> None:
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(ValueError, match="rosbags-convert --src"):
        list(read_frames(tmp_path / "old.bag"))


def test_damaged_metadata_beside_one_whole_file_does_not_matter(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag")
    whole = [frame.stamp for frame in read_frames(bag)]
    (bag / "metadata.yaml").write_text("storage_identifier: [")
    assert [frame.stamp for frame in read_frames(bag)] == whole


def test_metadata_without_storage_gets_the_line_to_write(tmp_path: Path) -> None:
    bag = written(tmp_path / "bag")
    (bag / "bag_1.mcap").write_bytes((bag / "bag.mcap").read_bytes())
    text = (bag / "metadata.yaml").read_text()
    changed = text.replace("storage_identifier: mcap", "storage_identifier: ''")
    assert changed != text
    (bag / "metadata.yaml").write_text(changed)
    with pytest.raises(ValueError, match="storage_identifier: mcap"):
        list(read_frames(bag))
    (bag / "metadata.yaml").write_text(text)
    assert list(read_frames(bag))


@pytest.mark.parametrize("name", ["metadata.yaml", "bag.mcap", "more.mcap"])
def test_a_pipe_in_a_bag_does_not_hang(tmp_path: Path, name: str) -> None:
    bag = written(tmp_path / "bag")
    (bag / name).unlink(missing_ok=True)
    os.mkfifo(bag / name)
    with pytest.raises(ValueError, match="pipe"):
        list(read_frames(bag))


@pytest.mark.parametrize("stamps", [lambda _: 0, lambda k: 10**9 * (k // 2)])
def test_images_without_times_are_refused(tmp_path: Path, stamps: Callable[[int], int]) -> None:
    bag = noisy_bag(tmp_path / "bag", 8, stamps)
    with pytest.raises(ValueError, match="repeat their time stamps"):
        list(read_frames(bag, on_bad_frame=lambda _: None))


def test_images_without_a_partner_are_counted(tmp_path: Path) -> None:
    said = list[str]()
    with BagWriter(tmp_path / "bag") as writer:
        for number, message in enumerate(read_messages(written(tmp_path / "whole", count=6))):
            if number != 4:  # a colour image
                writer.append_raw(message)
    assert len(list(read_frames(tmp_path / "bag", on_bad_frame=said.append))) == 5
    assert any(text.startswith("1 images have no partner") for text in said)


def test_frames_of_the_helper_are_the_ones_written(tmp_path: Path) -> None:
    assert len(list(read_frames(written(tmp_path / "bag")))) == len(list(frames()))
