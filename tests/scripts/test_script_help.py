"""Scripts say what they do, and refuse at once where they cannot."""

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.script_runs import SCRIPTS, bash, copied_scripts

SOURCED = {"environment.sh", "graph.sh"}
CALLED = sorted(path.name for path in SCRIPTS.glob("*.sh") if path.name not in SOURCED)


SETTING_UP = {
    "setup.sh": (), "demo.sh": (), "run_graph.sh": (), "soak.sh": (), "test.sh": (),
    "env.sh": ("true",), "ros2.sh": ("node", "list"),
}  # fmt: skip
"""Scripts that set up what is missing, with what they cannot do without."""


@pytest.fixture
def foreign() -> Iterator[Path]:
    """A workspace in which nobody may write, where another user can reach it."""
    folder = Path(tempfile.mkdtemp())
    root = copied_scripts(folder / "clone")
    for path in (folder, root):
        path.chmod(0o555)
    yield root
    for path in (folder, root):
        path.chmod(0o755)
    shutil.rmtree(folder)


@pytest.mark.parametrize("script", CALLED)
def test_help_is_the_script_s_own_and_changes_nothing(script: str, tmp_path: Path) -> None:
    root = copied_scripts(tmp_path / "workspace")
    done = bash(str(root / "scripts" / script), "--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"usage: scripts/{script}" in done.stdout
    assert "set -euo" not in done.stdout
    assert [path.name for path in root.iterdir()] == ["scripts"]


@pytest.mark.parametrize("script", CALLED)
def test_the_help_names_every_option(script: str) -> None:
    cases = re.findall(r"^ *((?:--?[a-z-]+(?: \| )?)+)\)", (SCRIPTS / script).read_text(), re.M)
    said = bash(str(SCRIPTS / script), "--help").stdout
    options = {word for case in cases for word in case.split(" | ")} - {"-h", "--help"}
    assert {option for option in options if option not in said} == set()


@pytest.mark.parametrize("script", SETTING_UP)
def test_a_path_with_a_blank_is_refused_at_once(script: str, tmp_path: Path) -> None:
    root = copied_scripts(tmp_path / "my robots")
    done = bash(str(root / "scripts" / script), *SETTING_UP[script])
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert "has a blank" in line
    assert [path.name for path in root.iterdir()] == ["scripts"]


@pytest.mark.parametrize("script", SETTING_UP)
def test_a_clone_of_somebody_else_is_refused_at_once(script: str, foreign: Path) -> None:
    nobody = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
    command = ["bash", str(foreign / "scripts" / script), *SETTING_UP[script]]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd="/", **nobody)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert f"may not write into {foreign}" in line


def test_an_unknown_option_of_set_up_is_named() -> None:
    done = bash(str(SCRIPTS / "setup.sh"), "--fast")
    assert done.returncode == 1
    assert "unknown option --fast" in done.stderr
