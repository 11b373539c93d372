"""Where a sourced /opt/ros/jazzy brings ROS, scripts and nodes take it from there."""

import os
import subprocess
import sys
from importlib.metadata import Distribution, distributions
from pathlib import Path

import pytest
from ament_index_python import get_package_prefix
from tests.support.script_runs import copied_scripts

SITE = Path("lib/python3.12/site-packages")
pytestmark = pytest.mark.slow


def wheels_of_ros() -> list[Distribution]:
    """Return what pip has installed of ROS."""
    found = distributions(path=[str(Path(sys.prefix) / SITE)])
    return [wheel for wheel in found if wheel.metadata["Name"].startswith("ros-")]


def laid_out(prefix: Path) -> set[str]:
    """Lay the wheels of ROS out as an installation; return their names in site-packages."""
    names = set()
    for wheel in wheels_of_ros():
        for file in wheel.files or ():
            source = Path(os.path.normpath(Path(sys.prefix) / SITE / file))
            target = prefix / source.relative_to(sys.prefix)
            if source.is_relative_to(Path(sys.prefix) / SITE):
                names.add(source.relative_to(Path(sys.prefix) / SITE).parts[0])
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                target.symlink_to(source)
    return names


def without_ros(venv: Path, names: set[str]) -> None:
    """Make a virtual environment of this one's packages, those of ROS left out."""
    (venv / SITE).mkdir(parents=True)
    (venv / "bin").mkdir()
    base = Path(sys._base_executable)  # type: ignore[attr-defined]
    (venv / "bin" / "python").symlink_to(base)
    (venv / "pyvenv.cfg").write_text(f"home = {base.parent}\n")
    for entry in (Path(sys.prefix) / SITE).iterdir():
        if entry.name not in names and entry.suffix != ".pth":
            (venv / SITE / entry.name).symlink_to(entry)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built workspace beside a folder opt/ros/jazzy, with an environment without ROS."""
    if not wheels_of_ros():
        pytest.skip("ROS is installed here already: the other tests run with it")
    folder = tmp_path_factory.mktemp("system")
    root = copied_scripts(folder / "workspace")
    without_ros(root / ".venv", laid_out(folder / "opt" / "ros" / "jazzy"))
    (root / "install").symlink_to(Path(get_package_prefix("intent_msgs")).parent)
    return root


def sourced(root: Path) -> dict[str, str]:
    """Return the environment of a shell that has sourced the installation."""
    prefix = root.parent / "opt" / "ros" / "jazzy"
    libraries = [*map(str, (prefix / SITE).glob("ros_*.libs")), str(prefix / "lib")]
    here = str(Path(sys.prefix) / "bin")
    path = [part for part in os.environ["PATH"].split(os.pathsep) if part != here]
    return {
        "HOME": os.environ.get("HOME", str(root)), "PATH": os.pathsep.join(path),
        "ROS_DISTRO": "jazzy", "ROS_VERSION": "2", "ROS_PYTHON_VERSION": "3",
        "ROS_DOMAIN_ID": os.environ.get("ROS_DOMAIN_ID", "0"),
        "AMENT_PREFIX_PATH": str(prefix), "PYTHONPATH": str(prefix / SITE),
        "LD_LIBRARY_PATH": os.pathsep.join(libraries),
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",  # what the wheels' start-up hook would look for
    }  # fmt: skip


def inside(root: Path, command: str) -> subprocess.CompletedProcess[str]:
    """Run a command as scripts/env.sh would, the set-up left out."""
    enter = f"set -euo pipefail; source {root}/scripts/environment.sh; enter_venv; enter_overlay"
    return subprocess.run(
        ["bash", "-c", f"{enter}; {command}"],
        env=sourced(root), capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


def test_ros_comes_from_the_installation_and_all_else_from_the_environment(
    workspace: Path,
) -> None:
    code = "import numpy, rclpy, intent_msgs.msg; print(rclpy.__file__); print(numpy.__file__)"
    done = inside(workspace, f"python -c '{code}'")
    assert done.returncode == 0, done.stderr
    ros, other = done.stdout.split()
    assert ros.startswith(str(workspace.parent / "opt" / "ros" / "jazzy"))
    assert other.startswith(str(workspace / ".venv"))


@pytest.mark.parametrize(
    ("package", "node"), [("intent_perception", "recognizer"), ("intent_imitation", "imitation")]
)
def test_a_node_gets_ready_on_the_installation(workspace: Path, package: str, node: str) -> None:
    file = Path(get_package_prefix(package)) / "lib" / package / node
    done = inside(workspace, f"python {file} --rehearse")
    assert done.returncode == 0, done.stderr
