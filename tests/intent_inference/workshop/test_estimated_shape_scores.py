"""Demonstrations tracked by estimated shapes are judged with those that were lost."""

import json
from pathlib import Path

import pytest

from intent_inference import SHARE
from intent_inference.network.model_file import shipped_model
from intent_inference.workshop.evaluation.estimated_shape_scores import estimated_shape_figures
from intent_inference.workshop.training.labelled_table import read_grasps

DATA = SHARE / "data"
COUNT = 241


def archive_of(folder: Path, lost: int) -> Path:
    """Write films whose estimates are as good as the true shape, but for every `lost`-th."""
    table = read_grasps(DATA / "demonstrations.csv.gz", shipped_model().tasks)
    for row in range(table.rows):
        cells = {name: str(values[row]) for name, values in table.columns.items()}
        gone = bool(lost) and row % lost == 0
        stored = {"grasp": None if gone else cells, "reach": [], "reason": "gone" if gone else ""}
        (folder / f"{cells['demonstration']}.json").write_text(json.dumps(stored))
    return folder


def test_estimates_that_are_as_good_as_the_true_shape_are_judged_like_it(tmp_path: Path) -> None:
    figures = estimated_shape_figures(shipped_model(), DATA, archive_of(tmp_path, 0), COUNT, 0)
    assert figures is not None
    assert figures["auc_mean"] == pytest.approx(figures["auc_mean_true_shape"])
    assert (figures["count"], figures["class_right"], figures["lost"]) == (COUNT, 1.0, {})


def test_a_lost_demonstration_counts_as_one_without_evidence(tmp_path: Path) -> None:
    figures = estimated_shape_figures(shipped_model(), DATA, archive_of(tmp_path, 3), COUNT, 0)
    assert figures is not None
    assert figures["lost"] == {"gone": 81}
    assert figures["auc_mean"] < figures["auc_mean_true_shape"] - 0.05


def test_demonstrations_of_a_sample_are_spread_evenly(tmp_path: Path) -> None:
    figures = estimated_shape_figures(shipped_model(), DATA, archive_of(tmp_path, 0), 60, 0)
    assert figures is not None
    assert (figures["count"], figures["of"]) == (60, COUNT)
