"""How long frames waited is known, and what passed during a step is not taken for a pause."""

import time

import numpy as np
from tests.support.harness import SECOND, Probe

from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.ros.frame_subscription import FrameSubscription
from intent_perception.ros.node import IntentNode

BUSY = 0.1
"""Duration of a step [s]."""


class Restarted(IntentNode):
    """A node that counts how often it begins anew."""

    count = 0

    def reset(self) -> None:
        """Count."""
        self.count += 1


def frame(number: int) -> RgbdFrame:
    color, depth = np.zeros((480, 640, 3), np.uint8), np.ones((480, 640), np.float32)
    return RgbdFrame(number * SECOND // 30, color, depth, KINECT)


def busy(seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass


def test_a_frame_that_came_during_a_step_is_known_to_have_waited(probe: Probe) -> None:
    node, waited = IntentNode("slow"), list[float]()
    probe.run_with(node)

    def step(_: RgbdFrame) -> None:
        waited.append(frames.waited)
        busy(BUSY)

    frames = FrameSubscription(node, step)
    assert probe.until(probe.connected)
    for number in range(2):
        probe.send(frame(number))
    assert probe.until(lambda: len(waited) == 2)
    assert waited[1] > 0.5 * BUSY


def test_a_long_step_is_no_pause_but_a_gap_in_the_recording_is_one(probe: Probe) -> None:
    node, taken = Restarted("busy"), list[int]()
    probe.run_with(node)

    def step(_: RgbdFrame) -> None:
        taken.append(node.count)
        busy(2.5 if len(taken) == 1 else 0.0)

    FrameSubscription(node, step)
    assert probe.until(probe.connected)
    probe.send(frame(0))
    assert probe.until(lambda: len(taken) == 1)
    probe.send(frame(75))  # the camera went on while the step ran
    assert probe.until(lambda: len(taken) == 2)
    probe.send(frame(75 + 75))
    assert probe.until(lambda: len(taken) == 3)
    assert taken == [0, 0, 1]
