"""A node that is asked for help gives it and starts nothing."""

import re
import subprocess
from pathlib import Path

import pytest
from ament_index_python import get_package_prefix
from tests.conftest import ROOT

from intent_imitation.ros.graph import NODES

EXECUTABLES = [
    (package, name)
    for setup in sorted((ROOT / "src").glob("intent_*/setup.py"))
    for name, package in re.findall(r'"(\w+) = (intent_\w+)\.', setup.read_text())
]


def test_all_that_a_user_starts_is_asked_here() -> None:
    assert {name for _, name in EXECUTABLES} >= {*NODES, "replay", "demo", "record", "viewer"}


@pytest.mark.slow
@pytest.mark.parametrize(("package", "node"), EXECUTABLES)
def test_help_of_a_node_is_its_own(package: str, node: str) -> None:
    file = Path(get_package_prefix(package)) / "lib" / package / node
    done = subprocess.run([file, "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ")
    assert node in done.stdout.partition("\n")[0]
