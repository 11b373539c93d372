"""What documents tell a user to type exists."""

import re
from pathlib import Path

import pytest
from tests.conftest import ROOT

DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "bags/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_script_and_its_options_exist(document: Path) -> None:
    text = document.read_text(encoding="utf-8").replace("\\\n", " ")
    for name, rest in re.findall(r"scripts/(\w+\.(?:sh|py))([^\n`#|)]*)", text):
        script = ROOT / "scripts" / name
        assert script.is_file(), f"{document.name} names {name}"
        if name in ("demo.sh", "run_graph.sh", "setup.sh", "soak.sh", "clean.sh"):
            known = script.read_text()
            assert [o for o in re.findall(r" (--[a-z-]+)", rest) if o not in known] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_command_without_ros_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for module in re.findall(r"python -m (intent_[a-z]+\.[a-z_]+)", text):
        package, name = module.split(".")
        assert (ROOT / "src" / package / package / f"{name}.py").is_file(), module


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_what_the_stand_in_for_ros2_is_asked_it_can_answer(document: Path) -> None:
    known = (ROOT / "scripts" / "ros2.sh").read_text()
    for words in re.findall(r"scripts/ros2\.sh ([a-z]+(?: [a-z]+)?)", document.read_text()):
        asked = "run" if words.startswith("run ") else words
        assert f"{asked}" in known, words


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        assert "://" in target or (document.parent / target).exists(), target
