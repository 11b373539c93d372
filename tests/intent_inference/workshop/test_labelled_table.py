"""A table says all it holds: what cannot be used is refused with its place, or named."""

from pathlib import Path

import numpy as np
import pytest
from tests.intent_inference.network.test_model_file import write_table

from intent_inference.workshop.training import train_command
from intent_inference.workshop.training.labelled_table import read_grasps

HEAD = "object_class,conv,npos_0,npos_1,npos_2,fcon_0,pouring\n"
ROWS = ["mug,0.5,0,0,1,0.3,1", "mug,0.5,0,1,0,0.3,0", "mug,0.5,1,0,0,0.3,", "mug,0.5,1,0,0,0,1"]


def read(tmp_path: Path, text: str) -> object:
    path = tmp_path / "table.csv"
    path.write_text(text)
    return read_grasps(path)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        ("yes", r"pouring, line 3: expected 0, 1 or empty, got 'yes'"),
        ("TRUE", r"pouring, line 3: .* write 1 where"),
        ("2", r"pouring, line 3"),
    ],
)
def test_a_label_of_another_form_is_refused_with_its_place(
    tmp_path: Path, cell: str, message: str
) -> None:
    rows = [ROWS[0], ROWS[1][:-1] + cell, *ROWS[2:]]
    with pytest.raises(ValueError, match=message):
        read(tmp_path, HEAD + "\n".join(rows))


@pytest.mark.parametrize("word", ["TRUE", "yes"])
def test_a_whole_column_of_words_is_no_column_without_labels(tmp_path: Path, word: str) -> None:
    rows = [row.rsplit(",", 1)[0] + f",{word}" for row in ROWS]
    with pytest.raises(ValueError, match=f"expected 0, 1 or empty, got '{word}'"):
        read(tmp_path, HEAD + "\n".join(rows))


@pytest.mark.parametrize(("mark", "word"), [(";", "semicolons"), ("\t", "tabs")])
def test_other_marks_between_columns_are_named(tmp_path: Path, mark: str, word: str) -> None:
    with pytest.raises(ValueError, match=f"between commas, got {word}"):
        read(tmp_path, (HEAD + "\n".join(ROWS)).replace(",", mark))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.3,1", "45,1", "fcon, line 2.*in degrees"),
        ("mug,0.5,0,0,1,0.3,1", "mug,inf,0,0,1,0.3,1", "column conv, line 2: expected a number"),
        ("mug,0.5,0,0,1,0.3,1", "mug,1e300,0,0,1,0.3,1", "conv, line 2.*out of range"),
        ("0,0,1,0.3,1", "0,0,0,0.3,1", "npos, line 2.*unit vector"),
        (",pouring", ",conv", "column 'conv' stands there twice"),
        ("mug,0.5,0,0,1", "m" * 200_000 + ",0.5,0,0,1", "line 2: field larger"),
    ],
)
def test_impossible_cells_are_refused_with_their_place(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read(tmp_path, (HEAD + "\n".join(ROWS)).replace(old, new, 1))


@pytest.mark.slow
def test_training_names_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = write_table(tmp_path / "t.csv.gz", 500)
    table = read_grasps(data)
    from intent_perception.basics.checked_files import read_text

    lines = read_text(data).splitlines()
    lines = [lines[0] + ",always,remark", *(f"{line},1,nice" for line in lines[1:])]
    path = tmp_path / "more.csv"
    path.write_text("\n".join(lines))
    command = ["--data", str(path), "--out", str(tmp_path / "m.npz"), "--structure", "paper/paper"]
    assert train_command.main(command) == 0
    said = capsys.readouterr().err
    assert f"task always: {table.rows} grasps afford it and 0 do not" in said
    assert "columns remark" in said


def test_tables_that_the_package_ships_are_read_whole() -> None:
    for name in ("human", "schunk", "demonstrations", "reaches"):
        path = Path("src/intent_inference/intent_inference/share/data") / f"{name}.csv.gz"
        if path.is_file():
            assert np.isfinite(read_grasps(path, () if name == "reaches" else None).rows)
