"""How long frames waited is known: it tells the tracker when to hurry."""

import time

import numpy as np
from tests.support.harness import SECOND, Probe

from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.ros.frame_subscription import FrameSubscription
from intent_perception.ros.node import IntentNode

BUSY = 0.1
"""Duration of a step [s]."""


def frame(number: int) -> RgbdFrame:
    color, depth = np.zeros((480, 640, 3), np.uint8), np.ones((480, 640), np.float32)
    return RgbdFrame(number * SECOND // 30, color, depth, KINECT)


def test_a_frame_that_came_during_a_step_is_known_to_have_waited(probe: Probe) -> None:
    node, waited = IntentNode("slow"), list[float]()
    probe.run_with(node)

    def step(_: RgbdFrame) -> None:
        waited.append(frames.waited)
        end = time.monotonic() + BUSY
        while time.monotonic() < end:
            pass

    frames = FrameSubscription(node, step)
    assert probe.until(probe.connected)
    for number in range(2):
        probe.send(frame(number))
    assert probe.until(lambda: len(waited) == 2)
    assert waited[1] > 0.5 * BUSY
