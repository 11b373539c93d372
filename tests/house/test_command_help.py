"""Every command explains itself, and does so without what only set-up's --dev installs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.conftest import ROOT
from tests.support.plain_installation import plain_environment

DOORS = sorted(
    f"{path.parent.name}.{path.stem}"
    for path in (ROOT / "src").glob("intent_*/intent_*/*.py")
    if path.stem != "__init__"
)
NEEDY = {
    "intent_inference.simulate": ("--hand", "schunk", "--out", "table.csv"),
    "intent_imitation.practise": ("--archive", "archive"),
    "intent_imitation.own_hand": ("hand.urdf", "--out", "hand"),
    "intent_imitation.benchmark": ("--part", "choices"),
    "intent_imitation.copying_picture": ("--out", "picture.png"),
    "intent_perception.parametric": ("--out", "objects"),
    "bags/make.py": ("pour_bottle",),
}
"""Commands that cannot work without a module of requirements-dev.txt."""
RUNTIME = (
    "intent_perception.recognition.recognizer", "intent_tracking.tracker.tracker",
    "intent_tracking.grasp.grasp_detector", "intent_inference.intention.estimator",
    "intent_imitation.planner.planner", "intent_imitation.live.live_picture",
)  # fmt: skip
"""What the nodes wrap."""
HEAVY = {"dask", "matplotlib", "open3d", "pandas", "pgmpy", "pybullet", "sklearn", "statsmodels"}
"""What is imported only where it works: in training, simulation and figures."""


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of an installation without --dev."""
    return plain_environment(tmp_path_factory.mktemp("plain"))


def run(plain: dict[str, str], folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Run a command of the plain installation in a folder."""
    done = [sys.executable, *command]
    return subprocess.run(
        done, env=plain, cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )


def started(door: str) -> tuple[str, ...]:
    """Return how Python starts a command."""
    return (str(ROOT / door),) if door.endswith(".py") else ("-m", door)


@pytest.mark.slow
@pytest.mark.parametrize("door", [*DOORS, "bags/make.py"])
def test_help_works_everywhere(door: str, plain: dict[str, str], tmp_path: Path) -> None:
    done = run(plain, tmp_path, *started(door), "--help")
    assert (done.returncode, done.stderr) == (0, "")
    name = door.rsplit("/", 1)[-1]
    assert done.stdout.startswith(("usage: " + name, "usage: python -m " + name))


@pytest.mark.slow
@pytest.mark.parametrize("door", NEEDY)
def test_what_is_missing_is_said_with_the_remedy(
    door: str, plain: dict[str, str], tmp_path: Path
) -> None:
    done = run(plain, tmp_path, *started(door), *NEEDY[door])
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.endswith("is not installed; run scripts/setup.sh --dev")


def test_installation_names_every_command_that_needs_dev() -> None:
    text = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert "scripts/setup.sh --dev " in text
    assert [door for door in NEEDY if door not in text] == []


@pytest.mark.slow
def test_what_a_robot_runs_loads_no_library_of_the_workshops(tmp_path: Path) -> None:
    code = (
        f"import {', '.join(RUNTIME)}, sys; "
        f"print(sorted({HEAVY!r} & {{name.partition('.')[0] for name in sys.modules}}))"
    )
    paths = os.pathsep.join(map(str, (ROOT / "src").glob("intent_*")))
    done = run({**os.environ, "PYTHONPATH": paths}, tmp_path, "-c", code)
    assert (done.stdout, done.stderr) == ("[]\n", "")
