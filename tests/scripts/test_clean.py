"""Cleaning removes what set-up and runs left, and nothing that a user put there."""

import fcntl
import hashlib
import json
import os
import time
from pathlib import Path

import pytest
from tests.support.script_runs import bash, copied_scripts

from intent_perception.basics import orphaned_files as orphaned_module

ORPHANED = "src/intent_perception/intent_perception/basics/orphaned_files.py"
"""What the script asks which files nobody holds."""


def put(file: Path, text: str = "x") -> Path:
    """Write a file and the folders above it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def own(folder: Path, **files: str) -> None:
    """Write files into a folder as a run does, with their list."""
    names = {name.replace("_", "."): text for name, text in files.items()}
    for name, text in names.items():
        put(folder / name, text)
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in names.items()}
    put(folder / ".own_files.json", json.dumps(digests, indent=1) + "\n")


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace that has been set up, built, and in which the demo ran."""
    root = copied_scripts(tmp_path / "workspace")
    for name in ("build", "install", "log"):
        put(root / name / "COLCON_IGNORE")
    put(root / ".venv" / "pyvenv.cfg")
    put(root / "src" / "p" / "p" / "__pycache__" / "a.nbi")
    own(root / "out" / "demo", report_html="report", result_json="{}")
    own(root / "bags" / "generated" / "pour", metadata_yaml="bag")
    (tmp_path / "shm").mkdir()
    put(root / ORPHANED, Path(orphaned_module.__file__).read_text())
    return root


def clean(root: Path, *options: str) -> str:
    """Run the script with a folder for shared memory and return what it said."""
    places = {"INTENT_SHARED_MEMORY": str(root.parent / "shm"), "TMPDIR": str(root.parent)}
    done = bash(str(root / "scripts" / "clean.sh"), *options, **places)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def files(root: Path) -> list[str]:
    """Return the files of a workspace, its scripts aside."""
    found = {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}
    return sorted(name for name in found - {ORPHANED} if not name.startswith("scripts/"))


def test_what_set_up_and_runs_left_is_gone(workspace: Path) -> None:
    assert clean(workspace).splitlines()[-1].startswith("freed: ")
    assert files(workspace) == []


def test_a_user_s_files_stay(workspace: Path) -> None:
    own_files = ["out/demo/notes.txt", "out/mine.csv", "bags/mine/a.mcap", "src/p/p/a.py"]
    for name in own_files:
        put(workspace / name)
    put(workspace / "out" / "demo" / "report.html", "with my own words")
    clean(workspace)
    assert files(workspace) == sorted([*own_files, "out/demo/report.html"])


def test_folders_that_colcon_did_not_make_stay(workspace: Path) -> None:
    (workspace / "log" / "COLCON_IGNORE").unlink()
    put(workspace / "log" / "diary.txt")
    clean(workspace)
    assert files(workspace) == ["log/diary.txt"]


def test_a_dry_run_says_the_same_and_removes_nothing(workspace: Path) -> None:
    before = files(workspace)
    said = clean(workspace, "--dry-run")
    assert files(workspace) == before
    assert said.splitlines()[:-1] == clean(workspace).splitlines()[:-1]


def test_shared_memory_goes_only_where_its_program_has_ended(workspace: Path) -> None:
    shared = workspace.parent / "shm"
    for name in ("dead", "dead_el", "live", "live_el", "port7411", "port7411_el"):
        put(shared / f"fastrtps_{name}")
    for name in ("port7411", "gone"):
        put(shared / f"sem.fastrtps_{name}_mutex")
    put(shared / "somebody_else")
    old = time.time() - 600
    for file in shared.iterdir():
        os.utime(file, (old, old))
    put(shared / "fastrtps_new")
    with (
        (shared / "fastrtps_live_el").open() as live,
        (shared / "fastrtps_port7411_el").open() as port,
    ):
        fcntl.flock(live, fcntl.LOCK_EX)
        fcntl.flock(port, fcntl.LOCK_SH)
        clean(workspace)
    left = {file.name.replace("fastrtps_", "") for file in shared.iterdir()}
    assert left == {
        *("live", "live_el", "port7411", "port7411_el", "sem.port7411_mutex"),
        *("somebody_else", "new"),
    }
