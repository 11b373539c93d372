"""A node that is asked for help gives it and starts nothing."""

import subprocess
from pathlib import Path

import pytest
from ament_index_python import get_package_prefix

NODES = [
    ("intent_perception", "recognizer"),
    ("intent_perception", "calibrate"),
    ("intent_perception", "replay"),
    ("intent_tracking", "tracker"),
    ("intent_tracking", "grasp_detector"),
    ("intent_inference", "inference"),
    ("intent_imitation", "imitation"),
    ("intent_imitation", "demo"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("package", "node"), NODES)
def test_help_of_a_node_is_its_own(package: str, node: str) -> None:
    file = Path(get_package_prefix(package)) / "lib" / package / node
    done = subprocess.run([file, "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ")
    assert node in done.stdout.partition("\n")[0]
