"""The import rules hold: each kind of forbidden import is planted and refused by the linter."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted((ROOT / "src").glob("intent_*"))
FAULTS = {
    "image on a film": (
        "intent_tracking/image/tile.py",
        "intent_tracking.workshop.person.body.skin",
    ),
    "recogniser on a peer": (
        "intent_perception/recognition/detection.py",
        "intent_perception.workshop.figures.peer_open3d",
    ),
    "hash table on an object's maker": (
        "intent_perception/recognition/proposal/pair_hash.py",
        "intent_perception.workshop.things.vessels",
    ),
    "planner on the benchmark's judge": (
        "intent_imitation/planner/collision.py",
        "intent_imitation.workshop.trials.simulated_judge",
    ),
    "network on its scores": (
        "intent_inference/quantisation/soft_evidence.py",
        "intent_inference.workshop.evaluation.scores",
    ),
    "node on the workshop": (
        "intent_tracking/ros/tracker_node.py",
        "intent_tracking.workshop.person.filming.film",
    ),
    "another package's workshop": (
        "intent_imitation/planner/plan.py",
        "intent_inference.workshop.simulation.labels",
    ),
    "core on ROS": ("intent_tracking/fit/pso.py", "rclpy"),
    "core on a package's ROS folder": (
        "intent_inference/intention/reach.py",
        "intent_perception.ros.convert",
    ),
    "against the flow of data": (
        "intent_perception/geometry/camera.py",
        "intent_tracking.scene.scene_state",
    ),
    "scene on what is recognised in it": (
        "intent_perception/scene/table_plane.py",
        "intent_perception.recognition.recognizer",
    ),
    "image on the tracker": (
        "intent_tracking/image/appearance.py",
        "intent_tracking.tracker.tracker",
    ),
    "quantisation on the network": (
        "intent_inference/quantisation/mixture.py",
        "intent_inference.network.task_model",
    ),
    "planner on the demo": ("intent_imitation/planner/plan.py", "intent_imitation.demo.report"),
}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("house")
    shutil.copy(ROOT / "pyproject.toml", folder)
    for source in SOURCES:
        shutil.copytree(
            source / source.name,
            folder / "src" / source.name,
            ignore=lambda _, names: [n for n in names if n in ("share", "__pycache__")],
        )
    return folder


def refusal(house: Path) -> str:
    """Return what the linter objects to; empty if nothing."""
    environment = {**os.environ, "PYTHONPATH": str(house / "src")}
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"]
    done = subprocess.run(
        [*command, "--no-logo", "--no-cache"],
        cwd=house,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return "" if done.returncode == 0 else done.stdout + done.stderr


@pytest.mark.slow
def test_the_house_as_it_stands_is_accepted(house: Path) -> None:
    assert refusal(house) == ""


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_refused(house: Path, fault: str) -> None:
    name, imported = FAULTS[fault]
    file = house / "src" / name
    sound = file.read_text()
    try:
        file.write_text(f"{sound}\n\nimport {imported}\n")
        said = refusal(house)
        assert "BROKEN" in said
        assert name.removesuffix(".py").replace("/", ".") in said
    finally:
        file.write_text(sound)


@pytest.mark.slow
def test_a_folder_without_a_place_is_refused(house: Path) -> None:
    folder = house / "src" / "intent_tracking" / "attic"
    folder.mkdir()
    (folder / "__init__.py").write_text('"""Nobody knows where this belongs."""\n')
    try:
        assert "attic" in refusal(house)
    finally:
        shutil.rmtree(folder)
