"""The report of `evaluate`: Table II, AUC with deviations, ROC points, calibration, baselines."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.evaluation.protocol import (
    MASKS,
    ProtocolConfig,
    SplitTrial,
    folds,
    group_splits,
    held_out_calibration,
    random_splits,
    run_trial,
    trial_roc,
    trial_scores,
    unknown_class_auroc,
)
from intent_inference.workshop.evaluation.scores import ROC_GRID
from intent_inference.workshop.training.fitting import balanced_rows
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.basics.parameters import Checked

Scores = dict[tuple[str, str, str], dict[str, list[float]]]
Progress = Callable[[str], None]


@dataclass(frozen=True)
class ReportConfig(Checked):
    """How much is run."""

    trials: int = 30
    """Random 70/30 splits (Sec. IV-C); 1..1000."""
    group_trials: int = 10
    """Splits by unseen groups, 0..1000."""
    calibration_folds: int = 5
    """Parts for the calibration error; every row is predicted once; 2..100."""
    seed: int = 1000
    """Seed of all splits and trainings, 0..2147483647."""
    group: str = "object_id"
    """Column that tells which grasps share an object; without it that part is left out."""
    unknown: bool = True
    """Leave each class out once, for the unknown-object score."""


def evaluation_report(
    table: GraspTable, protocol: ProtocolConfig, config: ReportConfig, progress: Progress
) -> dict[str, Any]:
    """Return all figures as JSON-ready values.

    Args:
        table: labelled grasps, restricted to the variables that may be used.
        protocol: what runs on every split.
        config: how much is run.
        progress: is told what was done.
    """
    rng = np.random.default_rng(config.seed)
    report: dict[str, Any] = {"rows": table.rows, "table_2": table_2(table)}
    trials: list[SplitTrial] = []
    for number, split in enumerate(random_splits(table, config.trials, protocol.share, rng)):
        trials.append(run_trial(table, split, config.seed + number, protocol))
        progress(f"random split {number + 1} of {config.trials}: {_brief(table, trials[-1])}")
    scores = _collect(table, trials)
    report["tasks"] = _task_report(table, trials, scores)
    report["auc_mean"] = _means(scores, tuple(table.labels))
    report["unseen_objects"] = None
    if config.group in table.columns and config.group_trials:
        report["unseen_objects"] = _unseen(table, protocol, config, rng, progress)
    quiet = replace(protocol, baselines=False)
    parts = []
    for number, split in enumerate(folds(table.rows, config.calibration_folds, rng)):
        parts.append(run_trial(table, split, config.seed + number, quiet))
        progress(f"calibration part {number + 1} of {config.calibration_folds}")
    errors = held_out_calibration(table, parts)
    for (task, mask), value in errors.items():
        report["tasks"][task].setdefault("ece", {})[mask] = value
    report["unknown_auroc"] = report["unknown_auroc_by_class"] = None
    if config.unknown and OBJECT_CLASS in table.features:
        by_class = unknown_class_auroc(table, config.seed, quiet)
        progress("unknown classes")
        if by_class:
            report["unknown_auroc_by_class"] = by_class
            report["unknown_auroc"] = float(np.mean(list(by_class.values())))
    return report


def table_2(table: GraspTable) -> dict[str, dict[str, int]]:
    """Return the counts of Table II: all labelled grasps, and the balanced number used."""
    result = {}
    for task, labels in table.labels.items():
        positives, negatives = int((labels == 1.0).sum()), int((labels == 0.0).sum())
        used = len(balanced_rows(labels, np.random.default_rng(0))) // 2
        result[task] = {"positives": positives, "negatives": negatives, "balanced": used}
    return result


def _collect(table: GraspTable, trials: Sequence[SplitTrial]) -> Scores:
    scores: Scores = {}
    for trial in trials:
        for key, values in trial_scores(table, trial).items():
            for name, value in values.items():
                scores.setdefault(key, {}).setdefault(name, []).append(value)
    return scores


def _task_report(
    table: GraspTable, trials: Sequence[SplitTrial], scores: Scores
) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {}
    for task in table.labels:
        own: dict[str, Any] = {"auc": {}, "auc_within_class": {}, "baselines": {}, "roc": {}}
        for mask in MASKS:
            if ("ours", task, mask) not in scores:
                continue
            values = np.array(scores["ours", task, mask]["auc"])
            own["auc"][mask] = {"mean": float(values.mean()), "sd": float(values.std())}
            within = float(np.nanmean(scores["ours", task, mask]["within"]))
            own["auc_within_class"][mask] = within
            curves = np.stack([trial_roc(table, trial, task, mask) for trial in trials])
            own["roc"][mask] = {
                "false_positive_rate": ROC_GRID.tolist(),
                "true_positive_rate": curves.mean(axis=0).tolist(),
                "sd": curves.std(axis=0).tolist(),
            }
        for method, name, mask in scores:
            if name == task and method != "ours":
                mean = float(np.mean(scores[method, name, mask]["auc"]))
                own["baselines"].setdefault(method, {})[mask] = mean
        result[task] = own
    return result


def _means(scores: Scores, tasks: tuple[str, ...]) -> dict[str, dict[str, dict[str, float]]]:
    """Return method -> mask -> mean AUC and mean within-class AUC over the tasks."""
    result: dict[str, dict[str, dict[str, float]]] = {}
    for method, mask in sorted({(key[0], key[2]) for key in scores}):
        own = [scores[method, task, mask] for task in tasks if (method, task, mask) in scores]
        result.setdefault(method, {})[mask] = {
            "auc": float(np.mean([np.mean(s["auc"]) for s in own])),
            "within_class": float(np.nanmean([np.nanmean(s["within"]) for s in own])),
        }
    return result


def _brief(table: GraspTable, trial: SplitTrial) -> str:
    """Return the mean AUC (and ours within classes) of each method in one trial."""
    means = _means(_collect(table, [trial]), tuple(table.labels))
    figures = [f"{m} {mask} {v['auc']:.4f}" for m, own in means.items() for mask, v in own.items()]
    within = [f"{mask} {v['within_class']:.4f}" for mask, v in means["ours"].items()]
    return f"{', '.join(figures)}; within {', '.join(within)}"


def _unseen(
    table: GraspTable, protocol: ProtocolConfig, config: ReportConfig, rng: np.random.Generator,
    progress: Progress,
) -> dict[str, Any]:  # fmt: skip
    trials: list[SplitTrial] = []
    protocol = replace(protocol, recipes=False)
    splits = group_splits(table, config.group, config.group_trials, protocol.share, rng)
    for number, split in enumerate(splits):
        trials.append(run_trial(table, split, config.seed + number, protocol))
        done = f"split by {config.group} {number + 1} of {config.group_trials}"
        progress(f"{done}: {_brief(table, trials[-1])}")
    return _means(_collect(table, trials), tuple(table.labels))
