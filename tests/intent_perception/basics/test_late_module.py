"""A missing module is named together with what installs it, and before any work begins."""

import subprocess
import sys

import pytest

from intent_perception.basics.late_module import LateModule, need, remedy


def test_a_late_module_is_imported_with_its_first_attribute() -> None:
    sys.modules.pop("this_is_absent", None)
    late = LateModule("this_is_absent")
    with pytest.raises(ModuleNotFoundError):
        _ = late.anything
    assert LateModule("math").pi == pytest.approx(3.14159, abs=1e-5)


def test_need_refuses_what_is_not_installed() -> None:
    need("math", "json")
    with pytest.raises(ModuleNotFoundError, match="this_is_absent"):
        need("math", "this_is_absent")


@pytest.mark.parametrize(
    ("name", "command"),
    [("pybullet", "setup.sh --dev"), ("dask.array", "--dev"), ("cv2", "setup.sh")],
)
def test_the_remedy_is_the_command_that_installs_it(name: str, command: str) -> None:
    said = remedy(ModuleNotFoundError(f"No module named '{name}'", name=name))
    assert said.endswith(command)
    assert f"module {name.partition('.')[0]} is not installed" in said


def test_a_command_without_its_module_ends_in_one_sentence() -> None:
    code = "from intent_perception.basics.commands import command; command('this_is_absent')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.endswith("the Python module this_is_absent is not installed; run scripts/setup.sh")


def test_in_a_workspace_of_ones_own_the_remedy_is_rosdep(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", sys.base_prefix)
    assert remedy(ModuleNotFoundError(name="tf2_msgs")).endswith("-r requirements-rosdep.txt")
    assert remedy(ModuleNotFoundError(name="pybullet")).endswith("-r requirements-dev.txt")
