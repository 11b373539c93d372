"""Model files and grasp tables: round trips, damage, any columns; the commands."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from tests.support.grasp_tables import made_up_grasps

from intent_inference.network.model_file import ModelFileError, load_model, save_model
from intent_inference.network.task_model import TaskModel
from intent_inference.workshop.evaluation import evaluate_command as evaluate
from intent_inference.workshop.training import train_command
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, train
from intent_inference.workshop.training.labelled_table import read_grasps


@pytest.fixture(scope="module")
def model() -> TaskModel:
    config = TrainingConfig(recipes=(NetworkRecipe("tan", "6"), NetworkRecipe("class-tan", "4")))
    return train(made_up_grasps(500), np.random.default_rng(0), config)


@pytest.fixture
def table_file(tmp_path: Path) -> Path:
    return write_table(tmp_path / "grasps.csv.gz", 500)


def write_table(path: Path, rows: int, seed: int = 0, extra_task: bool = False) -> Path:
    """A made-up table as `simulate` writes it, some cells empty."""
    table = made_up_grasps(rows, seed)
    columns: dict[str, list[str]] = {"object_id": table.columns["object_id"].tolist()}
    columns["object_class"] = table.features["obcl"].tolist()
    for name, values in table.features.items():
        if name == "obcl":
            continue
        for i in range(values.shape[1]):
            suffix = "" if values.shape[1] == 1 else f"_{'xyzw'[i] if name == 'dir' else i}"
            columns[f"{name}{suffix}"] = [f"{v:.5g}" for v in values[:, i]]
    columns["fvol"] = ["" if i % 7 == 0 else v for i, v in enumerate(columns["fvol"])]
    columns["margin_pouring"] = ["0.5"] * rows
    for task, labels in table.labels.items():
        columns[task] = ["" if i % 11 == 0 else f"{int(v)}" for i, v in enumerate(labels)]
    if extra_task:
        columns["drinking"] = [f"{int(v > 0.3)}" for v in table.features["npos"][:, 0]]
    lines = [",".join(columns)] + [",".join(cells) for cells in zip(*columns.values(), strict=True)]
    with gzip.open(path, "wt") as file:
        file.write("\n".join(lines) + "\n")
    return path


def test_a_saved_model_answers_the_same(model: TaskModel, tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    save_model(model, path)
    features = made_up_grasps(40, seed=1).features
    loaded = load_model(path)
    np.testing.assert_array_equal(model.posterior(features), loaded.posterior(features))
    assert loaded.tasks == model.tasks


def test_damaged_files_are_named(model: TaskModel, tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    save_model(model, path)
    whole = path.read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 40):
        path.write_bytes(whole[:size])
        with pytest.raises(ModelFileError, match="damaged"):
            load_model(path)
    path.write_bytes(whole[:500] + bytes(2000) + whole[2500:])
    with pytest.raises(ModelFileError):
        load_model(path)


def test_another_schema_version_is_named(model: TaskModel, tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    text = json.dumps({"schema": 0}).encode()
    np.savez(path, header=np.frombuffer(text, dtype=np.uint8))
    with pytest.raises(ModelFileError, match="schema version 0"):
        load_model(path)
    np.savez(path, other=np.zeros(3))
    with pytest.raises(ModelFileError, match="train it again"):
        load_model(path)


def test_a_table_may_have_empty_cells_and_any_columns(table_file: Path) -> None:
    table = read_grasps(table_file)
    assert set(table.labels) == {"pouring", "hand-over"}
    assert set(table.features) == {"obcl", "size", "conv", "dir", "npos", "fcon", "fvol"}
    assert np.isnan(table.features["fvol"][0, 0])
    assert np.isnan(table.labels["pouring"][0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "header"),
        ("size_0,size_1,size_2,pouring\n1,2,3\n", "line 2: expected 4 cells"),
        ("size_0,size_1,size_2,pouring\n1,x,3,1\n", "column size_1, line 2"),
        ("name,pouring\nbottle,1\n", "feature column"),
        ("conv,pouring\n0.5,2\n", "task columns"),
        ("dir_x,dir_y,pouring\n0,0,1\n", "dir_x, dir_y, dir_z, dir_w"),
    ],
)
def test_bad_tables_are_refused_with_the_place(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_grasps(path)


def test_a_cut_gzip_file_is_refused(table_file: Path) -> None:
    table_file.write_bytes(table_file.read_bytes()[:2000])
    with pytest.raises(ValueError, match="is damaged"):
        read_grasps(table_file)


@pytest.mark.slow
def test_commands_train_add_and_evaluate_with_a_fifth_task(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = write_table(tmp_path / "five.csv.gz", 500, extra_task=True)
    out = tmp_path / "model.npz"
    options = ["--structure", "tan/6,paper/paper"]
    assert train_command.main(["--data", str(data), "--out", str(out), *options]) == 0
    assert load_model(out).tasks == ("pouring", "hand-over", "drinking")
    more = write_table(tmp_path / "more.csv.gz", 30, seed=3)
    assert train_command.main(["add", "--model", str(out), "--data", str(more)]) == 0
    assert load_model(out).description["added"] == "30"
    command = ["--data", str(data), "--observe", "O,A", "--trials", "1", "--group-trials", "0"]
    capsys.readouterr()
    assert evaluate.main([*command, "--no-baselines", "--json", "-"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report["tasks"]) == {"pouring", "hand-over", "drinking"}
    assert report["tasks"]["drinking"]["auc"]["partial"]["mean"] > 0.7
    assert evaluate.main(["--data", str(data), "--observe", "shape"]) == 1
    assert train_command.main(["--data", str(tmp_path / "no.csv"), "--out", str(out)]) == 1


@pytest.mark.slow
def test_features_alone_suffice_without_object_class(tmp_path: Path) -> None:
    table = made_up_grasps(400)
    features = {k: table.features[k] for k in ("npos", "fvol")}
    bare = type(table)(features, table.labels, {})
    config = TrainingConfig(recipes=(NetworkRecipe("class-tan", "6"),))
    model = train(bare, np.random.default_rng(0), config)
    assert model.variables == ("npos", "fvol")
    assert np.isfinite(model.posterior(table.features)).all()
