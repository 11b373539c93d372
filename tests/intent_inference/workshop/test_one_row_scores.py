"""One labelled row moves p of its own grasp most, and the more the more it weighs."""

import numpy as np
import pytest

from intent_inference import SHARE
from intent_inference.network.model_file import shipped_model
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_variables
from intent_inference.quantisation.variables import ACTION, OBJECT
from intent_inference.workshop.training.labelled_table import GraspTable, read_grasps
from intent_inference.workshop.training.one_row_scores import (
    one_row_figures,
    row_moves,
    told_chances,
)
from intent_perception.basics.arrays import Array

TASK = "hand-over"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def told() -> tuple[TaskModel, GraspTable, Array]:
    """Forty tracked demonstrations, and what the shipped model says of them without C."""
    model = shipped_model()
    grasps = read_grasps(SHARE / "data" / "demonstrations.csv.gz", model.tasks)
    features = select_variables(grasps.features, (*OBJECT, *ACTION))
    table = GraspTable(features, grasps.labels, grasps.columns).select(np.arange(40))
    return model, table, told_chances(model, table)


def test_a_heavier_row_moves_its_grasp_further_and_the_others_less(
    told: tuple[TaskModel, GraspTable, Array],
) -> None:
    model, table, before = told
    row = int(np.argmin(np.abs(before[:, model.tasks.index(TASK)] - 0.5)))
    moves = [row_moves(model, table, before, TASK, row, weight) for weight in (1.0, 10.0, 100.0)]
    own = [move for move, _ in moves]
    assert own == sorted(own)
    assert all(others < 0.5 * mine for mine, others in moves)


def test_rows_are_those_of_which_the_model_is_not_sure() -> None:
    figures = one_row_figures(shipped_model(), SHARE / "data", 1, seed=0)
    assert figures is not None
    assert figures[TASK]["rows"] == 1
    assert figures["pouring"] == {
        "rows": 0,
        **{f"weight_{w}": {"that_grasp": None, "others": None} for w in (1, 10, 100)},
    }
