"""Every command explains itself, and does so without what only set-up's --dev installs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.conftest import ROOT

from intent_perception.basics.late_module import DEVELOPMENT

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
    "intent_perception.benchmark": ("--part", "peers"),
}
"""Commands that cannot work without a module of requirements-dev.txt."""
HIDING = f"""
import sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {DEVELOPMENT!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Hidden())
"""


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of an installation without --dev."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "sitecustomize.py").write_text(HIDING)
    paths = [str(folder), *map(str, (ROOT / "src").glob("intent_*"))]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def run(plain: dict[str, str], folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Run a command of the plain installation in a folder."""
    done = [sys.executable, *command]
    return subprocess.run(
        done, env=plain, cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.slow
@pytest.mark.parametrize("door", [*DOORS, str(ROOT / "bags" / "make.py")])
def test_help_works_everywhere(door: str, plain: dict[str, str], tmp_path: Path) -> None:
    command = (door,) if door.endswith(".py") else ("-m", door)
    done = run(plain, tmp_path, *command, "--help")
    assert (done.returncode, done.stderr) == (0, "")
    name = door.rsplit("/", 1)[-1] if door.endswith(".py") else door
    assert done.stdout.startswith(("usage: " + name, "usage: python -m " + name))


@pytest.mark.slow
@pytest.mark.parametrize("door", NEEDY)
def test_what_is_missing_is_said_with_the_remedy(
    door: str, plain: dict[str, str], tmp_path: Path
) -> None:
    done = run(plain, tmp_path, "-m", door, *NEEDY[door])
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.endswith("is not installed; run scripts/setup.sh --dev")
