"""A node that is interrupted while it starts ends without a word of Python's."""

import signal
import subprocess
import sys
import time

import pytest

NODES = {
    "recognizer": "intent_perception.ros.perception_nodes",
    "tracker": "intent_tracking.ros.tracking_nodes",
    "inference": "intent_inference.ros.inference_nodes",
}
pytestmark = pytest.mark.slow


@pytest.mark.parametrize("delay", [0.3, 1.0, 2.0, 3.0, 8.0])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", NODES)
def test_a_signal_ends_a_node_quietly_from_its_first_moment_on(
    name: str, number: int, delay: float
) -> None:
    command = [sys.executable, "-c", f"from {NODES[name]} import {name}; {name}()"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    time.sleep(delay)
    process.send_signal(number)
    _, said = process.communicate(timeout=120)
    assert "Traceback" not in said, said
    assert process.returncode in (0, 128 + number, -number)
