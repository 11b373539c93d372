"""Shown grasps become rows that `train add` takes, and timelines."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.demo_records import record

from intent_inference.intention.class_priors import ClassPriors
from intent_inference.intention.demonstration_log import DemonstrationLog
from intent_inference.network.model_file import load_model, save_model, shipped_model
from intent_inference.workshop.training import train_command
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.basics.safe_files import write_json
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures


def grasp(stamp: int = 1) -> StableGrasp:
    direction = np.array([0.0, 0.0, 0.0, 1.0])
    features = GraspFeatures(
        "mug", np.array([0.08, 0.11, 0.1]), np.array([0.3]), direction, np.array([0.0, -1.0, 0.0]),
        np.full(20, 0.3), None, None, None,
    )  # fmt: skip
    return StableGrasp(stamp, "mug_1", "mug_1", "mug", "right", features, None, np.eye(4))


@pytest.mark.parametrize("name", ["mine.csv", "mine.csv.gz"])
def test_rows_of_two_runs_stand_in_one_table_with_their_labels(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    DemonstrationLog(path).add(grasp(), {"pouring": 1})
    DemonstrationLog(path).add(grasp(), {"pouring": 0, "drinking": 1})
    table = read_grasps(path)
    assert table.rows == 2
    np.testing.assert_array_equal(table.labels["pouring"], [1.0, 0.0])
    np.testing.assert_array_equal(table.labels["drinking"], [np.nan, 1.0])
    np.testing.assert_allclose(table.features["fcon"], 0.3)


def test_train_add_takes_the_table(tmp_path: Path) -> None:
    path, model = tmp_path / "mine.csv.gz", tmp_path / "model.npz"
    DemonstrationLog(path).add(grasp(), {"pouring": 1})
    save_model(shipped_model(), model)
    assert train_command.main(["add", "--model", str(model), "--data", str(path)]) == 0
    assert load_model(model).description["added"] == "1"


def test_train_add_takes_what_observe_wrote_and_a_persons_habits(tmp_path: Path) -> None:
    seen, model, habits = (tmp_path / name for name in ("seen.json", "person.npz", "person.yaml"))
    features = {name: np.asarray(v).tolist() for name, v in asdict(grasp().features).items()}
    write_json(seen, {"grasps": [{"features": features}], "timeline": []})
    save_model(shipped_model(), model)
    command = ["add", "--model", str(model), "--data", str(seen), "--shown", "hand-over"]
    assert train_command.main([*command, "--person-priors", str(habits)]) == 0
    assert load_model(model).description["added"] == "1"
    usual, own = (priors.of("mug", ("hand-over",)) for priors in
                  (ClassPriors({}), ClassPriors.load(habits)))  # fmt: skip
    assert own[0] > usual[0]


def test_the_last_row_can_be_taken_back(tmp_path: Path) -> None:
    log = DemonstrationLog(tmp_path / "mine.csv")
    log.add(grasp(1), {"pouring": 1})
    log.add(grasp(2), {"pouring": 1})
    assert log.undo()
    assert read_grasps(tmp_path / "mine.csv").rows == 1
    assert log.undo()
    assert not log.undo()


def test_a_timeline_holds_the_frames_in_which_the_hand_was_tracked(tmp_path: Path) -> None:
    run = record(ObjectDatabase.load())
    log = DemonstrationLog(tmp_path / "mine.csv", tmp_path / "timelines")
    for state in run.states:
        log.note_state(state)
    log.add(grasp(run.grasps[0].stamp), {"pouring": 1})
    path = log.finish()
    assert path is not None
    arrays = np.load(path)
    assert arrays["joints"].shape == (10, 21, 3)  # of twelve frames two show no hand
    assert arrays["T_object"].shape == (10, 4, 4)
    assert (str(arrays["object_model"]), str(arrays["hand_side"])) == ("mug_1", "right")
    assert np.isfinite(arrays["joints"]).all()


def test_a_demonstration_ends_when_the_hand_has_left(tmp_path: Path) -> None:
    run = record(ObjectDatabase.load())
    log = DemonstrationLog(tmp_path / "mine.csv", tmp_path / "timelines")
    for state in run.states:
        log.note_state(state)
    log.add(grasp(), {"pouring": 1})
    log.note_state(replace(run.states[0], stamp=run.states[-1].stamp + 2_000_000_000))
    assert len(list((tmp_path / "timelines").iterdir())) == 1


def test_another_file_is_not_taken_for_a_table(tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="no table of grasps"):
        DemonstrationLog(tmp_path / "mine.csv")
