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
