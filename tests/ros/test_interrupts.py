"""A node that is interrupted while it starts ends without a word of Python's."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from intent_perception.ros.ros_domain import private_domain

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
    code = f"from {NODES[name]} import {name}; print('at the door', flush=True); {name}()"
    command = [sys.executable, "-c", code]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()  # what comes before is not ours
    time.sleep(delay)
    process.send_signal(number)
    _, said = process.communicate(timeout=120)
    assert "Traceback" not in said, said
    assert process.returncode in (0, 128 + number, -number)


def test_a_node_that_ends_takes_its_shared_memory_along() -> None:
    command = [sys.executable, "-c", f"from {NODES['inference']} import inference; inference()"]
    with private_domain(), subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        while "ready" not in (line := process.stderr.readline()):
            assert line, "it ended before it was ready"
        maps = Path(f"/proc/{process.pid}/maps").read_text()
        segments = {Path(name) for name in re.findall(r"/dev/shm/fastrtps_[0-9a-f]{8,}\b", maps)}
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert segments
    assert not [segment for segment in segments if segment.exists()]
