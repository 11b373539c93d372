import hashlib
import json
from pathlib import Path

import pytest

from intent_perception.basics.own_folder import LIST, OwnFolder
from intent_perception.basics.safe_files import write_text

OURS = ("result.json", "report.html")


def put(folder: OwnFolder, name: str, text: str) -> None:
    part = folder.path.parent / "part"
    write_text(part, text)
    folder.put(part, name)


def listing(folder: Path) -> dict[str, str]:
    return {f.name: f.read_text() for f in folder.iterdir() if f.name != LIST}


def test_files_of_an_earlier_run_are_replaced(tmp_path: Path) -> None:
    folder = OwnFolder(tmp_path / "out")
    put(folder, "result.json", "old")
    put(folder, "report.html", "old")
    OwnFolder(folder.path).clear(OURS)
    put(folder, "result.json", "new")
    assert listing(folder.path) == {"result.json": "new"}


def test_a_strangers_file_is_left_alone(tmp_path: Path) -> None:
    folder = OwnFolder(tmp_path / "out")
    put(folder, "result.json", "old")
    (folder.path / "thesis.tex").write_text("ten years")
    OwnFolder(folder.path).clear(OURS)
    assert listing(folder.path) == {"thesis.tex": "ten years"}


def test_a_stranger_under_an_own_name_is_refused_and_nothing_is_removed(tmp_path: Path) -> None:
    folder = OwnFolder(tmp_path / "out")
    put(folder, "report.html", "old")
    (folder.path / "result.json").write_text("of another program")
    with pytest.raises(ValueError, match="which is not from an earlier run"):
        OwnFolder(folder.path).clear(OURS)
    assert listing(folder.path) == {"report.html": "old", "result.json": "of another program"}


def test_an_own_file_that_was_changed_since_is_a_strangers(tmp_path: Path) -> None:
    folder = OwnFolder(tmp_path / "out")
    put(folder, "report.html", "old")
    (folder.path / "report.html").write_text("with my remarks")
    with pytest.raises(ValueError, match="changed since"):
        OwnFolder(folder.path).clear(OURS)
    with pytest.raises(ValueError, match="changed since"):
        put(folder, "report.html", "new")
    assert listing(folder.path) == {"report.html": "with my remarks"}


def test_a_list_that_names_files_outside_the_folder_is_not_followed(tmp_path: Path) -> None:
    outside = tmp_path / "kept"
    outside.write_text("x")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / LIST).write_text(json.dumps({"../kept": hashlib.sha256(b"x").hexdigest()}))
    OwnFolder(folder).clear(OURS)
    assert outside.exists()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(ValueError, match="is a file"):
        OwnFolder(tmp_path / "out")
