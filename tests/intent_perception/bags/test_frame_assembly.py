"""Colour, depth and camera_info become frames whatever the order in which they arrive."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from intent_perception.bags.frame_assembly import FrameSynchroniser, SynchroniserConfig

PERIOD = 33_333_333


def message(stamp: int, **fields: Any) -> SimpleNamespace:
    sec, nanosec = divmod(stamp, 10**9)
    stamp_message = SimpleNamespace(sec=sec, nanosec=nanosec)
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp_message), **fields)


def color(stamp: int) -> SimpleNamespace:
    fields = {"encoding": "rgb8", "height": 2, "width": 3, "step": 9, "is_bigendian": 0}
    return message(stamp, **fields, data=bytes(18))


def depth(stamp: int, rows: int = 2) -> SimpleNamespace:
    fields = {"encoding": "16UC1", "height": rows, "width": 3, "step": 6, "is_bigendian": 0}
    return message(stamp, **fields, data=np.full(3 * rows, 1000, np.uint16).tobytes())


def info() -> SimpleNamespace:
    k = [5.0, 0.0, 1.0, 0.0, 5.0, 0.5, 0.0, 0.0, 1.0]
    return message(0, height=2, width=3, k=k, p=[0.0] * 12)


def ready() -> FrameSynchroniser:
    synchroniser = FrameSynchroniser(SynchroniserConfig())
    synchroniser.add_info(info())
    return synchroniser


def test_a_frame_has_the_stamp_of_its_depth_image() -> None:
    synchroniser = ready()
    assert synchroniser.add_color(color(10**9 + 4_000_000)) is None
    frame = synchroniser.add_depth(depth(10**9))
    assert frame is not None
    assert frame.stamp == 10**9
    assert frame.decoded().depth[0, 0] == 1.0


def test_images_wait_for_a_late_camera_info() -> None:
    synchroniser = FrameSynchroniser(SynchroniserConfig())
    synchroniser.add_color(color(10**9))
    synchroniser.add_depth(depth(10**9))
    assert synchroniser.missing == ("camera_info",)
    assert synchroniser.add_info(info()) is not None


def test_images_of_different_moments_make_no_frame() -> None:
    synchroniser = ready()
    synchroniser.add_color(color(10**9))
    assert synchroniser.add_depth(depth(10**9 + PERIOD)) is None


def test_a_lost_colour_image_costs_one_frame() -> None:
    synchroniser = ready()
    synchroniser.add_depth(depth(10**9))
    synchroniser.add_color(color(10**9 + PERIOD))
    assert synchroniser.add_depth(depth(10**9 + PERIOD)) is not None
    assert synchroniser.dropped == 1


def test_depth_out_of_order_is_dropped() -> None:
    synchroniser = ready()
    synchroniser.add_color(color(10**9 + PERIOD))
    synchroniser.add_depth(depth(10**9 + PERIOD))
    synchroniser.add_color(color(10**9))
    assert synchroniser.add_depth(depth(10**9)) is None


def test_after_the_clock_went_back_frames_flow_again() -> None:
    synchroniser = ready()
    synchroniser.add_color(color(10**12))
    synchroniser.add_depth(depth(10**12))
    synchroniser.add_color(color(10**9))
    assert synchroniser.add_depth(depth(10**9)) is not None
    assert synchroniser.jumps == 1


def test_a_depth_image_of_the_wrong_size_is_named_and_the_next_frame_is_good() -> None:
    synchroniser = ready()
    synchroniser.add_color(color(10**9))
    bad = synchroniser.add_depth(depth(10**9, rows=4))
    assert bad is not None
    with pytest.raises(ValueError, match="depth must be aligned"):
        bad.decoded()
    synchroniser.add_color(color(10**9 + PERIOD))
    assert synchroniser.add_depth(depth(10**9 + PERIOD)) is not None


def stamps_out(synchroniser: FrameSynchroniser, stamps: list[int]) -> list[int]:
    """Return the stamps of the frames that colour and depth of these stamps make."""
    found = []
    for stamp in stamps:
        synchroniser.add_color(color(stamp))
        frame = synchroniser.add_depth(depth(stamp))
        found += [frame.stamp] if frame is not None else []
    return found


def test_of_two_senders_the_one_with_the_older_clock_is_left_out() -> None:
    synchroniser = ready()
    camera = [10**12 + k * PERIOD for k in range(200)]
    stranger = [10**9 + k * PERIOD for k in range(200)]
    both = [stamp for pair in zip(camera, stranger, strict=True) for stamp in pair]
    assert stamps_out(synchroniser, both) == [camera[0], stranger[0], *camera[1:]]
    assert synchroniser.jumps == 1
    assert synchroniser.two_senders
    assert synchroniser.foreign == 2 * 199


def test_a_camera_info_of_the_older_clock_is_left_out_too() -> None:
    synchroniser = ready()
    stamps_out(synchroniser, [10**12, 10**9, 10**12 + PERIOD])
    strange = info()
    strange.k[0] = 9.0
    synchroniser.add_info(strange)
    synchroniser.add_color(color(10**12 + 2 * PERIOD))
    frame = synchroniser.add_depth(depth(10**12 + 2 * PERIOD))
    assert frame is not None
    assert frame.info.k[0] == 5.0


def test_when_the_newer_of_two_senders_ends_the_older_is_heard() -> None:
    synchroniser = ready()
    stamps_out(synchroniser, [10**12, 10**9, 10**12 + PERIOD])
    rest = [10**9 + k * PERIOD for k in range(1, 200)]
    heard = stamps_out(synchroniser, rest)
    assert len(heard) > 150
    assert heard[-1] == rest[-1]


def test_a_short_recording_in_a_loop_loses_nothing() -> None:
    synchroniser = ready()
    once = [10**12 + k * PERIOD for k in range(20)]
    assert stamps_out(synchroniser, once * 20) == once * 20
    assert synchroniser.foreign == 0
