"""Splits, scores, baselines, and the tracked demonstrations' figures."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate
from tests.support.grasp_tables import made_up_grasps

from intent_inference.network.task_model import TaskModel
from intent_inference.workshop.evaluation.baselines import boosting, class_only
from intent_inference.workshop.evaluation.demonstration_scores import demonstration_figures
from intent_inference.workshop.evaluation.protocol import (
    ProtocolConfig,
    folds,
    group_splits,
    hardened_evidence,
    random_splits,
    run_trial,
    trial_scores,
    unknown_class_auroc,
)
from intent_inference.workshop.evaluation.scores import (
    ROC_GRID,
    auc,
    auc_within,
    calibration_error,
    roc,
    share_interval,
)
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, train
from intent_inference.workshop.training.labelled_table import read_grasps

QUICK = ProtocolConfig(training=TrainingConfig(recipes=(NetworkRecipe("tan", "6"),)))


@pytest.fixture(scope="module")
def model() -> TaskModel:
    return train(made_up_grasps(500), np.random.default_rng(0), QUICK.training)


def test_auc_equals_scikit_learns_with_ties() -> None:
    from sklearn.metrics import roc_auc_score

    rng = np.random.default_rng(0)
    labels = rng.integers(0, 2, 300).astype(float)
    score = np.round(rng.random(300) + 0.3 * labels, 1)
    assert auc(labels, score) == pytest.approx(roc_auc_score(labels, score), abs=1e-12)
    area = float(integrate.trapezoid(roc(labels, score), ROC_GRID))
    assert area == pytest.approx(auc(labels, score), abs=0.01)


def test_knowing_the_group_alone_scores_a_half_within_groups() -> None:
    rng = np.random.default_rng(1)
    groups = rng.choice(["mug", "knife"], 200)
    labels = (rng.random(200) < np.where(groups == "mug", 0.9, 0.1)).astype(float)
    score = (groups == "mug").astype(float)
    assert auc(labels, score) > 0.8
    assert auc_within(labels, score, groups) == pytest.approx(0.5)


def test_a_perfect_forecaster_has_hardly_any_calibration_error() -> None:
    rng = np.random.default_rng(2)
    chance = rng.random(20000)
    labels = (rng.random(20000) < chance).astype(float)
    assert calibration_error(labels, chance) < 0.02
    assert calibration_error(labels, np.clip(chance + 0.2, 0, 1)) > 0.1


def test_the_interval_of_a_share_holds_the_truth_19_times_of_20() -> None:
    rng = np.random.default_rng(4)
    inside = 0
    for hits in rng.random((2000, 40)) < 0.85:
        low, high = share_interval(hits)
        inside += low <= 0.85 <= high
    assert 0.93 <= inside / 2000 <= 0.98


@pytest.mark.parametrize("count", range(1, 80))
def test_the_interval_of_a_share_contains_it_to_the_last_bit(count: int) -> None:
    assert share_interval(np.ones(count, bool))[1] == 1.0
    assert share_interval(np.zeros(count, bool))[0] == 0.0


def test_splits_by_object_share_no_object_and_keep_every_class() -> None:
    table = made_up_grasps(300)
    rng = np.random.default_rng(3)
    for train_rows, test_rows in group_splits(table, "object_id", 3, 0.7, rng):
        items = table.columns["object_id"]
        assert not set(items[train_rows]) & set(items[test_rows])
        assert set(table.features["obcl"][train_rows]) == set(table.features["obcl"])
        assert len(test_rows) > 30


def test_folds_predict_every_row_once() -> None:
    rows = np.concatenate([test for _, test in folds(101, 5, np.random.default_rng(4))])
    assert sorted(rows.tolist()) == list(range(101))


def test_hardened_evidence_names_one_state_per_block(model: TaskModel) -> None:
    evidence = model.evidence(made_up_grasps(20, seed=5).features)
    hard = hardened_evidence(model, evidence)
    for key in model.bank.keys:
        start = model.bank.starts[key]
        block = hard.likelihoods[:, start : start + model.bank.sizes[key]]
        np.testing.assert_array_equal(block.sum(axis=1), 1.0)


@pytest.mark.slow
def test_a_trial_scores_ours_and_every_baseline_on_the_same_rows() -> None:
    table = made_up_grasps(500)
    split = next(random_splits(table, 1, 0.7, np.random.default_rng(6)))
    scores = trial_scores(table, run_trial(table, split, 0, QUICK))
    methods = {key[0] for key in scores if key[1:] == ("pouring", "full")}
    assert methods == {"ours", "hard", "hard_ours", "paper_recipe", "class_only", "boosting"}
    assert scores["ours", "pouring", "full"]["auc"] > scores["class_only", "pouring", "full"]["auc"]


def test_baselines_read_any_subset_of_variables() -> None:
    table = made_up_grasps(200)
    labels = table.labels["pouring"]
    alone = class_only(table.features, labels, table.features)
    assert len(np.unique(alone)) <= 3
    chance = boosting(table.features, labels, table.features, ("npos", "fvol"))
    assert auc(labels, chance) > 0.8


def test_a_class_left_out_of_training_has_low_evidence() -> None:
    values = unknown_class_auroc(made_up_grasps(600), 0, QUICK)
    assert set(values) == {"bottle", "mug", "hammer"}
    assert min(values.values()) > 0.9


def test_demonstrations_are_scored_from_their_files(model: TaskModel, tmp_path: Path) -> None:
    assert demonstration_figures(model, tmp_path, 0) is None
    table = made_up_grasps(80, seed=7)
    for name, count in (("demonstrations", 1), ("reaches", 3)):
        tail = "" if name == "reaches" else ",pouring,hand-over"
        lines = ["demonstration,progress,stamp,gap,object_class,size_0,size_1,size_2,"
                 "npos_0,npos_1,npos_2,dir_x,dir_y,dir_z,dir_w,"
                 + ",".join(f"fcon_{i}" for i in range(20)) + tail]  # fmt: skip
        for row in range(table.rows):
            for frame in range(count):
                cells = [row, 0.2 * frame, 0.03 * frame, 0.3 - 0.05 * frame]
                cells += [table.features["obcl"][row], *table.features["size"][row]]
                cells += [*table.features["npos"][row], *table.features["dir"][row]]
                cells += [*table.features["fcon"][row]]
                if tail:
                    cells += [int(table.labels[t][row]) for t in ("pouring", "hand-over")]
                lines.append(",".join(str(c) for c in cells))
        with gzip.open(tmp_path / f"{name}.csv.gz", "wt") as file:
            file.write("\n".join(lines) + "\n")
    assert read_grasps(tmp_path / "reaches.csv.gz", ()).rows == 240
    figures = demonstration_figures(model, tmp_path, 0)
    assert figures is not None
    assert figures["count"] == 80
    assert figures["auc_ci"][0] <= figures["auc_mean"] <= figures["auc_ci"][1]
    assert figures["half_reach_count"] == 80
    assert figures["tasks"]["pouring"]["auc"] > 0.7
