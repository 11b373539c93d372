"""The scripts fail with one sentence, and stop everything they started."""

import os
import signal
import subprocess
from pathlib import Path

import pytest
from tests.support.harness import shipped_bag

from intent_perception.bags.bag_files import BagWriter

SCRIPTS = Path(__file__).resolve().parent.parent.parent / "scripts"


def run(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = ["bash", str(SCRIPTS / script), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture
def truncated(tmp_path: Path) -> Path:
    """A bag whose recording was cut off."""
    (source,) = shipped_bag("robot_table").glob("*.mcap")
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / source.name).write_bytes(source.read_bytes()[:-1000])
    (bag / "metadata.yaml").write_bytes((source.parent / "metadata.yaml").read_bytes())
    return bag


def test_the_demo_refuses_a_truncated_bag_with_one_sentence(
    truncated: Path, tmp_path: Path
) -> None:
    done = run("demo.sh", str(truncated), "--out", str(tmp_path / "out"))
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert "is damaged or was not closed" in line


def test_the_demo_refuses_an_empty_bag_with_one_sentence(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag"):
        pass
    done = run("demo.sh", str(tmp_path / "bag"), "--out", str(tmp_path / "out"))
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert "is empty" in line


def test_an_unknown_option_is_named() -> None:
    done = run("demo.sh", "--fast")
    assert done.returncode == 1
    assert "unknown option --fast" in done.stderr


@pytest.mark.slow
def test_interrupting_the_graph_ends_every_node_within_two_seconds() -> None:
    command = ["bash", str(SCRIPTS / "run_graph.sh")]
    graph = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    children = f"/proc/{graph.pid}/task/{graph.pid}/children"
    nodes: list[int] = []
    while graph.poll() is None and len(nodes) < 5:  # the loop's own short sleeps come and go
        pids = map(int, Path(children).read_text().split())
        nodes = [pid for pid in pids if "/lib/intent_" in _command(pid)]
    os.kill(graph.pid, signal.SIGINT)
    assert graph.wait(3.0) == 130
    assert not any(_command(pid) for pid in nodes)


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    except OSError:
        return ""
