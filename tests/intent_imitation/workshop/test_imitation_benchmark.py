"""Each rate counts over the tables where it means something; joined data keep every grasp."""

from dataclasses import replace
from pathlib import Path

import pytest

from intent_imitation.workshop.practice.table_merge import join_tables
from intent_imitation.workshop.trials.imitation_benchmark import gain, rates
from intent_imitation.workshop.trials.trials import TableTrial
from intent_inference.workshop.simulation.grasp_table import read_rows, write_rows

CHOSEN = TableTrial(
    "pouring", True, False, False, False, 0.01,
    correct=True, class_only=False, held=True, rule=True, random_rule=0.5,
)  # fmt: skip
REFUSED = TableTrial("pouring", False, False, True, True, 0.01)


def test_choices_count_where_something_fits_and_refusals_where_nothing_does() -> None:
    wrong = replace(CHOSEN, correct=False, rule=False)
    found = rates([CHOSEN, wrong, REFUSED, replace(REFUSED, refused=False, held=True)])
    assert found["object_correct"] == pytest.approx(0.5)
    assert found["refusal_correct"] == pytest.approx(0.5)
    assert found["executed_hold"] == pytest.approx(1.0)
    assert found["executed_rule"] == pytest.approx(0.5)


def test_a_gain_is_what_is_won_of_what_chance_leaves_open() -> None:
    assert gain(0.9, 0.5) == pytest.approx(0.8)
    assert gain(0.5, 0.5) == pytest.approx(0.0)
    assert gain(0.9, None) is None


def test_a_joined_table_holds_the_rows_of_all(tmp_path: Path) -> None:
    for name, grasps in (("free", ["a", "b"]), ("practised", ["c"])):
        write_rows(tmp_path / f"{name}.csv", [{"object_id": grasp} for grasp in grasps])
    tables = [tmp_path / "free.csv", tmp_path / "practised.csv"]
    assert join_tables(tables, tmp_path / "robot.csv.gz") == 3
    found = [row["object_id"] for row in read_rows(tmp_path / "robot.csv.gz")]
    assert found == ["a", "b", "c"]
