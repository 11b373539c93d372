"""Set-up does what is new and no more, says each step, and takes ROS from where it is."""

import os
import pty
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.conftest import ROOT
from tests.support.script_runs import bash, copied_scripts

PYTHON = """#!/bin/bash
root=$(cd "$(dirname "$0")/../.." && pwd)
echo "python $*" >>"$root/asked"
case "$*" in
  "-m pip install "*) sleep "${SLOW:-0}" ;;
  "-m colcon build "*)
    for node in intent_perception/recognizer intent_imitation/imitation intent_tracking/tracker \\
      intent_tracking/grasp_detector intent_inference/inference; do
      file=$root/install/${node%/*}/lib/$node
      mkdir -p "$(dirname "$file")" "$root/install"
      printf '#!/bin/bash\\necho "%s $*" >>"%s/asked"\\n' "${node#*/}" "$root" >"$file"
      chmod +x "$file"
    done
    touch "$root/install/local_setup.bash" ;;
esac
"""
"""Stands for the virtual environment's Python: notes what it is asked, and builds empty nodes."""
SOURCES = (
    "src/p/package.xml", "src/p/setup.py", "src/p/config/p.yaml", "src/p/launch/p.py",
    "src/p/rviz/p.rviz", "msg_defs/m/package.xml", "colcon.meta",
    "src/intent_tracking/intent_tracking/hands/networks/network_files.py",
    "src/intent_perception/intent_perception/basics/kernels.py",
)  # fmt: skip
WHEELS = {"AMENT_PREFIX_PATH": ""}
SYSTEM = {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/somewhere/opt/ros/jazzy"}


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace whose Python, compilers and sources are stand-ins."""
    root = copied_scripts(tmp_path / "workspace")
    for file in SOURCES:
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text("@kernel\n")
    for file in ROOT.glob("requirements*.txt"):
        shutil.copy(file, root)
    for name in ("python", "c++", "cmake"):
        tool = root / ".venv" / "bin" / name
        tool.parent.mkdir(parents=True, exist_ok=True)
        tool.write_text(PYTHON)
        tool.chmod(0o755)
    (root / ".venv" / "share").mkdir()
    return root


def set_up(root: Path, *options: str, **environment: str) -> tuple[list[str], str]:
    """Set up; return what Python and the nodes were asked, and what was said on the way."""
    (root / "asked").write_text("")
    done = bash(str(root / "scripts" / "setup.sh"), *options, **{**WHEELS, **environment})
    assert done.returncode == 0, done.stderr
    return (root / "asked").read_text().splitlines(), done.stderr


def steps(said: str) -> list[str]:
    """Return the steps that were done, in order."""
    lines = [line for line in said.splitlines() if " done after " in line]
    return [line.removeprefix("setup: ").partition(" ")[0] for line in lines]


def test_every_step_is_said_with_its_time(workspace: Path) -> None:
    asked, said = set_up(workspace)
    assert steps(said) == ["install", "build", "hand-networks", "kernels"]
    rehearsed = {line.removesuffix(" --rehearse") for line in asked if line.endswith("--rehearse")}
    assert rehearsed == {"recognizer", "tracker", "grasp_detector", "inference", "imitation"}


def test_on_a_terminal_a_clock_runs_beside_the_step(workspace: Path) -> None:
    ours, theirs = pty.openpty()
    command = ["bash", str(workspace / "scripts" / "setup.sh")]
    environment = {**os.environ, **WHEELS, "SLOW": "1.5"}
    done = subprocess.run(command, env=environment, stderr=theirs, check=False, timeout=60)
    os.close(theirs)
    said = os.read(ours, 100_000).decode()
    os.close(ours)
    assert done.returncode == 0
    assert "\rsetup: install, 1 s" in said


def test_a_second_set_up_does_nothing(workspace: Path) -> None:
    set_up(workspace)
    assert set_up(workspace) == ([], "")


@pytest.mark.parametrize(
    ("file", "step"),
    [
        ("requirements.txt", "install"),
        ("src/p/package.xml", "build"),
        ("msg_defs/m/package.xml", "build"),
        ("src/intent_perception/intent_perception/basics/kernels.py", "kernels"),
    ],
)
def test_after_an_update_the_next_set_up_does_what_has_changed(
    workspace: Path, file: str, step: str
) -> None:
    set_up(workspace)
    with (workspace / file).open("a") as text:
        text.write("# another version\n")
    assert steps(set_up(workspace)[1]) == [step]


def test_dev_installs_what_tests_and_simulation_need(workspace: Path) -> None:
    assert not any("requirements-dev.txt" in line for line in set_up(workspace)[0])
    asked, said = set_up(workspace, "--dev")
    assert steps(said) == ["install-dev"]
    assert any("requirements-dev.txt" in line for line in asked)


def test_where_ros_is_installed_no_wheel_of_it_is(workspace: Path) -> None:
    (install,) = (line for line in set_up(workspace, **SYSTEM)[0] if " requirements.txt " in line)
    assert install.endswith(f"-r {workspace}/.venv/requirements-colcon.txt")
    listed = (workspace / ".venv" / "requirements-colcon.txt").read_text()
    assert "colcon-common-extensions==" in listed
    assert "\nros-" not in listed


def test_where_no_ros_is_installed_its_wheels_are(workspace: Path) -> None:
    (install,) = (line for line in set_up(workspace)[0] if " requirements.txt " in line)
    assert install.endswith("-r requirements-ros.txt")


@pytest.mark.parametrize(
    ("where", "prefix", "told"),
    [(SYSTEM, SYSTEM["AMENT_PREFIX_PATH"], ""), (WHEELS, "{root}/.venv", "1")],
    ids=["system", "wheels"],
)
def test_the_environment_leaves_an_installed_ros_as_it_is(
    workspace: Path, where: dict[str, str], prefix: str, told: str
) -> None:
    code = (
        f"source {workspace}/scripts/environment.sh; enter_venv; "
        'echo "$AMENT_PREFIX_PATH"; echo "${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-}"; command -v python'
    )
    done = bash("-c", code, **{"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "", **where})
    said = done.stdout.splitlines()
    assert said == [prefix.format(root=workspace), told, f"{workspace}/.venv/bin/python"]
