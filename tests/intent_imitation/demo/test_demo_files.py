"""What the demo writes, and what it makes of a truth.npz of any kind."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from tests.support import demo_records

from intent_imitation.demo.demo_result import write_all
from intent_imitation.demo.known_truth import truth_of
from intent_imitation.demo.report import write_report
from intent_imitation.demo.result_files import FILES, results_folder
from intent_perception.objects.database import ObjectDatabase


@pytest.fixture(scope="module")
def database() -> ObjectDatabase:
    return ObjectDatabase.load().select(demo_records.NAMES)


def test_a_whole_report_is_made_of_the_listed_files(
    database: ObjectDatabase, tmp_path: Path
) -> None:
    write_report(demo_records.record(database), tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == set(FILES) - {"result.json"}


STRANGE = {
    "no npz": b"hello",
    "other keys": {"times": np.arange(3)},
    "wrong shapes": {"stamps": np.arange(3), "joints_camera": np.zeros(3), "hand_in_view": 1},
}


@pytest.mark.parametrize("kind", STRANGE)
def test_a_strange_truth_is_named_and_left_aside_and_the_result_written(
    database: ObjectDatabase, tmp_path: Path, kind: str
) -> None:
    content, bag = STRANGE[kind], tmp_path / "bag"
    bag.mkdir()
    if isinstance(content, bytes):
        (bag / "truth.npz").write_bytes(content)
    else:
        np.savez(bag / "truth.npz", **content)
    printed = io.StringIO()
    record = demo_records.record(database, complete=False)
    write_all(record, str(bag), results_folder(tmp_path / "out"), printed)
    assert printed.getvalue().startswith("warning: ")
    assert "truth.npz" in printed.getvalue()
    assert json.loads((tmp_path / "out" / "result.json").read_text())["true_task"] is None
    assert (tmp_path / "out" / "report.html").is_file()


def test_a_second_run_replaces_the_results_of_the_first_and_nothing_else(
    database: ObjectDatabase, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    write_all(demo_records.record(database), "none", results_folder(out), io.StringIO())
    (out / "notes.txt").write_text("mine")
    empty = demo_records.record(database, complete=False)
    write_all(empty, "none", results_folder(out), io.StringIO())
    assert not (out / "grasp.png").exists()  # of the first run
    assert (out / "notes.txt").read_text() == "mine"


def test_the_truth_of_a_shipped_bag_is_understood() -> None:
    truth = truth_of("bags/pour_bottle", [])
    assert truth is not None
    assert truth.task == "pouring"
