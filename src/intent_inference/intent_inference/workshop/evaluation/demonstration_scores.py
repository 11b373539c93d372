"""Networks trained on simulated grasps, judged on tracked demonstrations (Fig. 5, triangles).

The demonstrations are rendered, their pixels synthetic; objects, hands and seeds are not those
of training. `demonstrations.csv.gz` has one row per grasp as the detector saw it, labelled by the
label rules on the true grasp; `reaches.csv.gz` has the frames before it. Both are made once by
`python -m intent_inference.make_demonstrations`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_inference.intention.estimator import InferenceConfig, least_deviations
from intent_inference.intention.reach import ReachConfig, filtered, reach_deviations
from intent_inference.network.probability_calibration import sigmoid
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_variables
from intent_inference.quantisation.variables import ACTION, OBJECT, OBJECT_CLASS
from intent_inference.workshop.evaluation.baselines import class_only
from intent_inference.workshop.evaluation.scores import auc, auc_within, share_interval
from intent_inference.workshop.training.labelled_table import GraspTable, deviations_of, read_grasps
from intent_perception.basics.arrays import Array

_DRAWS = 500


def demonstration_figures(model: TaskModel, folder: Path, seed: int) -> dict[str, Any] | None:
    """Return the contract's `demonstrations`; None where the file is absent.

    Args:
        model: BN^H.
        folder: with demonstrations.csv.gz, reaches.csv.gz and human.csv.gz (for class only).
        seed: of the bootstrap.
    """
    path = folder / "demonstrations.csv.gz"
    if not path.is_file():
        return None
    table = read_grasps(path, model.tasks)
    figures = task_scores(model, table, seed)
    figures["count"] = table.rows
    figures["pixels"] = "synthetic"
    simulated = folder / "human.csv.gz"
    figures["class_only"] = None
    if simulated.is_file():
        figures["class_only"] = _class_only(model, table, read_grasps(simulated, model.tasks))
    figures["auc_mean_half_reach"] = None
    if (folder / "reaches.csv.gz").is_file():
        half = half_reach(model, folder / "reaches.csv.gz", table)
        figures.update(half)
    return figures


def task_scores(model: TaskModel, table: GraspTable, seed: int) -> dict[str, Any]:
    """Return how well the tasks of tracked grasps are told without C.

    Args:
        model: BN^H.
        table: the grasps; of one without any feature nothing is observed.
        seed: of the bootstrap.
    """
    observed = select_variables(table.features, (*OBJECT, *ACTION))
    deviations = least_deviations(observed, InferenceConfig(), deviations_of(table))
    probability = model.posterior(observed, deviations)
    classes = table.features[OBJECT_CLASS].astype(str)
    rng = np.random.default_rng(seed)
    tasks: dict[str, Any] = {}
    draws = np.zeros((len(model.tasks), _DRAWS))
    chosen = [_resampled(table, rng) for _ in range(_DRAWS)]
    for column, task in enumerate(model.tasks):
        labels, score = table.labels[task], probability[:, column]
        draws[column] = [_known_auc(labels[rows], score[rows]) for rows in chosen]
        rows = np.flatnonzero(np.isfinite(labels))
        labels, score = labels[rows], score[rows]
        said = score >= 0.5
        tasks[task] = {
            "positives": int((labels == 1.0).sum()),
            "negatives": int((labels == 0.0).sum()),
            "auc": auc(labels, score),
            "auc_ci": [float(v) for v in np.nanpercentile(draws[column], (2.5, 97.5))],
            "auc_within_class": auc_within(labels, score, classes[rows]),
            "true_positive_rate": float(said[labels == 1.0].mean()),
            "true_positive_ci": share_interval(said[labels == 1.0]),
            "false_positive_rate": float(said[labels == 0.0].mean()),
            "false_positive_ci": share_interval(said[labels == 0.0]),
        }
    mean = draws.mean(axis=0)
    return {
        "auc_mean": float(np.mean([own["auc"] for own in tasks.values()])),
        "auc_ci": [float(v) for v in np.nanpercentile(mean, (2.5, 97.5))],
        "auc_within_class": float(np.nanmean([t["auc_within_class"] for t in tasks.values()])),
        "tasks": tasks,
    }


def _resampled(table: GraspTable, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return rows drawn with replacement: whole objects, since their demonstrations are alike."""
    if "object_id" not in table.columns:
        return rng.integers(0, table.rows, table.rows)
    objects = table.columns["object_id"]
    names = np.unique(objects)
    drawn = rng.choice(names, len(names))
    return np.concatenate([np.flatnonzero(objects == name) for name in drawn])


def _known_auc(labels: Array, score: Array) -> float:
    known = np.isfinite(labels)
    return auc(labels[known], score[known])


def _class_only(model: TaskModel, table: GraspTable, simulated: GraspTable) -> float:
    values = []
    for task in model.tasks:
        known = np.isfinite(simulated.labels[task])
        part = simulated.select(known)
        score = class_only(part.features, part.labels[task], table.features)
        rows = np.isfinite(table.labels[task])
        values.append(auc(table.labels[task][rows], score[rows]))
    return float(np.nanmean(values))


def half_reach(model: TaskModel, path: Path, table: GraspTable) -> dict[str, Any]:
    """Return the AUC at half of the way from first motion to contact, by filtering over frames.

    Only frames up to the half are read.
    """
    frames = read_grasps(path, ())
    number = frames.columns["demonstration"].astype(str)
    progress = frames.columns["progress"].astype(np.float64)
    config = ReachConfig()
    gaps = frames.columns["gap"].astype(np.float64)
    stamps = frames.columns["stamp"].astype(np.float64)
    observed = select_variables(frames.features, (*OBJECT, *ACTION))
    deviations = reach_deviations(observed, gaps, np.zeros(26))
    fresh = model.calibrated_log_odds(model.evidence(observed, deviations))
    names = table.columns["demonstration"].astype(str)
    score = np.full((table.rows, len(model.tasks)), np.nan)
    for row, name in enumerate(names):
        own = np.flatnonzero((number == name) & (progress <= 0.5))
        own = own[np.argsort(stamps[own])]
        level: Array | None = None
        for frame, elapsed in zip(own, np.diff(stamps[own], prepend=stamps[own[:1]]), strict=True):
            level = filtered(level, fresh[frame], float(elapsed), config)
        if level is not None:
            score[row] = level
    values, within = [], []
    classes = table.features[OBJECT_CLASS].astype(str)
    for column, task in enumerate(model.tasks):
        rows = np.isfinite(table.labels[task]) & np.isfinite(score[:, column])
        labels, chance = table.labels[task][rows], sigmoid(score[rows, column])
        values.append(auc(labels, chance))
        within.append(auc_within(labels, chance, classes[rows]))
    return {
        "auc_mean_half_reach": float(np.nanmean(values)),
        "auc_within_class_half_reach": float(np.nanmean(within)),
        "half_reach_count": int(np.isfinite(score[:, 0]).sum()),
    }
