"""The examples run, and are as short as they are said to be."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.conftest import ROOT
from tests.support.harness import cut_bag, shipped_bag

EXAMPLES = ROOT / "examples"
LINES = {"core": 25, "listener": 20, "recorder": 20, "pictures": 70}


@pytest.fixture(scope="module")
def short_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demonstration up to a moment after the grasp."""
    return cut_bag(
        shipped_bag("pour_bottle"), tmp_path_factory.mktemp("bags") / "short", slice(18, 64)
    )


def run(name: str, *arguments: str) -> str:
    command = [sys.executable, str(EXAMPLES / f"{name}.py"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", LINES)
def test_an_example_is_short(name: str) -> None:
    text = (EXAMPLES / f"{name}.py").read_text()
    body = text.partition('"""')[2].partition('"""')[2]
    code = [line for line in body.splitlines() if line.strip() and not line.startswith("# %%")]
    assert len(code) <= LINES[name]


@pytest.mark.slow
def test_the_core_goes_from_a_bag_to_a_plan(short_bag: Path) -> None:
    said = run("core", str(short_bag))
    assert "bottle_0" in said
    assert "pouring: the robot takes" in said


@pytest.mark.slow
def test_the_notebook_draws_its_pictures(short_bag: Path, tmp_path: Path) -> None:
    run("pictures", str(short_bag), str(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {
        "joints.png",
        "distances.png",
        "posterior.png",
    }
