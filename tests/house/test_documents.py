"""What documents tell a user to type exists."""

import importlib.util
import os
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from tests.conftest import ROOT

from intent_imitation.planner.planner import PlannerConfig
from intent_imitation.ros.graph import NODES

DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "bags/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]


PACKAGES = sorted(path.name for path in (ROOT / "src").glob("intent_*"))


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


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_headings(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for target, anchor in re.findall(r"\]\(([^)#\s:]*)#([^)]+)\)", text):
        there = document.parent / target if target else document
        heads = re.findall(r"^#+ (.*)$", there.read_text(encoding="utf-8"), re.MULTILINE)
        slugs = [re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads]
        assert anchor in slugs, f"{target}#{anchor}"


def commands_named() -> set[tuple[str, ...]]:
    """Return every command without ROS that documents tell, with its options."""
    named = set()
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8").replace("\\\n", " ")
        for module, rest in re.findall(r"python -m (intent_\w+\.\w+)([^\n`#|;)]*)", text):
            sub = ["add"] if rest.split()[:1] == ["add"] else []
            for package in PACKAGES if module.startswith("intent_P.") else ("intent_P",):
                options = sorted(re.findall(r" (--[a-z-]+)", rest))
                named.add((module.replace("intent_P", package), *sub, *options))
    return named


@pytest.mark.slow
@pytest.mark.parametrize("named", sorted(commands_named()), ids=" ".join)
def test_commands_have_the_options_that_documents_give_them(named: tuple[str, ...]) -> None:
    options = [word for word in named if word.startswith("--")]
    command = [word for word in named if not word.startswith("--")]
    paths = os.pathsep.join(map(str, (ROOT / "src").glob("intent_*")))
    done = subprocess.run(
        [sys.executable, "-m", *command, "--help"], env={**os.environ, "PYTHONPATH": paths},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert [option for option in options if option not in done.stdout] == []


def test_the_readme_is_read_on_a_screen_and_a_half() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 95
    assert re.search(r"!\[[^\]]+\]\(docs/demo\.png\)", text)
    assert re.search(r"```bash\nscripts/demo\.sh .*\nscripts/test\.sh .*\n```", text)
    assert all(name in text.partition("```text")[2] for name in NODES)


def test_parameters_of_the_planner_that_are_explained_exist() -> None:
    text = (ROOT / "docs" / "own_hand.md").read_text(encoding="utf-8")
    table = text.partition("| parameter of `imitation` | is |")[2].partition("\n\n")[0]
    cells = [line.split("|")[1] for line in table.splitlines() if line.count("|") > 1]
    named = set(re.findall(r"`(\w+)`", " ".join(cells)))
    assert {"library", "network"} <= named <= {field.name for field in fields(PlannerConfig)}


def test_every_camera_recipe_names_all_three_topics() -> None:
    text = (ROOT / "docs" / "cameras.md").read_text(encoding="utf-8")
    for camera in ("RealSense", "Orbbec", "Azure Kinect", "OAK-D", "ZED"):
        row = next(line for line in text.splitlines() if line.startswith(f"| {camera}"))
        driver, *topics = (cell.strip() for cell in row.split("|")[2:-1])
        assert driver.startswith("`ros2 launch "), camera
        assert [topic.startswith("`/") for topic in topics] == [True] * 3, camera
    assert {"## Transports", "## The table and TF", "## DDS"} <= set(text.splitlines())


def test_a_version_is_that_of_every_package_and_of_the_changelog() -> None:
    found = {
        match
        for pattern, files in (
            (r"<version>(.*)</version>", "*/*/package.xml"),
            (r'^    version="(.*)",$', "src/*/setup.py"),
            (r"^version: (.*)$", "CITATION.cff"),
        )
        for path in ROOT.glob(files)
        for match in re.findall(pattern, path.read_text(), re.MULTILINE)
    }
    (version,) = found
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_every_page_is_reached_from_the_index_and_every_reader_from_the_readme() -> None:
    index, readme = (ROOT / "docs" / "index.md").read_text(), (ROOT / "README.md").read_text()
    for page in (ROOT / "docs").glob("*.md"):
        if page.stem != "index":
            assert f"\n{page.stem}\n" in index, page.stem
            assert f"docs/{page.name}" in readme, page.stem


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_parameters_and_executables_that_are_named_exist(document: Path) -> None:
    text = document.read_text(encoding="utf-8").replace("\\\n", " ")
    sources = "".join(path.read_text() for path in (ROOT / "src").glob("intent_*/intent_*/**/*.py"))
    for name in re.findall(r"-p (\w+):=", text):
        assert re.search(rf"^    {name}: ", sources, re.MULTILINE), name
    scripts = "".join(path.read_text() for path in (ROOT / "src").glob("intent_*/setup.py"))
    for package, executable in re.findall(r"ros2(?:\.sh)? run (intent_\w+) (\w+)", text):
        assert f'"{executable} = {package}.' in scripts, executable


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_launch_arguments_that_are_named_exist(document: Path) -> None:
    launch = (ROOT / "src/intent_imitation/launch/intent.launch.py").read_text()
    for line in re.findall(r"ros2 launch intent_imitation [^\n`]*", document.read_text()):
        for name in re.findall(r"(\w+):=", line):
            assert f'"{name}": (' in launch, name


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("myst_parser") is None, reason="scripts/setup.sh --dev brings Sphinx"
)
def test_the_documents_are_built_to_html_with_the_pages_of_the_interface(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-b", "html"]
    done = subprocess.run(
        [*command, str(ROOT / "docs"), str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "GraspPlanner" in (tmp_path / "api.html").read_text(encoding="utf-8")
