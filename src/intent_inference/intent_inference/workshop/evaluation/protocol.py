"""The paper's protocol and beyond it: repeated splits, unseen objects, held-out calibration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from intent_inference.network.conditional_tables import DirichletPrior
from intent_inference.network.probability_calibration import sigmoid
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import Features
from intent_inference.quantisation.soft_evidence import SoftEvidence
from intent_inference.quantisation.variables import OBJECT_CLASS, split_observed
from intent_inference.workshop.evaluation.baselines import boosting, class_only
from intent_inference.workshop.evaluation.scores import auc, auc_within, calibration_error, roc
from intent_inference.workshop.training.fitting import (
    NetworkRecipe,
    TrainingConfig,
    balancing_weights,
    train,
)
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked

Rows = NDArray[np.int64]

MASKS = ("full", "partial", "partial_fig5", "position")
"""Sets of observed variables that are scored; see `split_observed`."""
PAPER = NetworkRecipe("paper", "paper", prior=DirichletPrior(5.0, back_off=False), balanced=True)
"""Spanning tree, then greedy BIC; K by Davies-Bouldin and BIC; soft counts of balanced rows."""
HARD = replace(PAPER, hard=True)
"""The same, each value counted for and read as its likeliest state alone."""


@dataclass(frozen=True)
class ProtocolConfig(Checked):
    """What is run on every split."""

    training: TrainingConfig = field(default_factory=TrainingConfig)
    baselines: bool = True
    """Class only and gradient boosting, too."""
    recipes: bool = True
    """Of the baselines, the paper's recipe and hard discretisation, too."""
    share: float = 0.7
    """Share of the rows (or groups) for training, 0.1..0.9."""


@dataclass(frozen=True, eq=False)
class SplitTrial:
    """Held-out predictions of one split."""

    rows: dict[str, Rows]
    """Task to the test rows with known labels."""
    probability: dict[tuple[str, str, str], Array]
    """(method, task, mask) to probabilities of the task's test rows; methods "ours",
    "paper_recipe", "hard", "hard_ours", "class_only", "boosting"."""


def random_splits(
    table: GraspTable, trials: int, share: float, rng: np.random.Generator
) -> Iterator[tuple[Rows, Rows]]:
    """Yield training and test rows of repeated random splits."""
    count = round(share * table.rows)
    for _ in range(trials):
        order = rng.permutation(table.rows)
        yield order[:count], order[count:]


def group_splits(
    table: GraspTable, column: str, trials: int, share: float, rng: np.random.Generator
) -> Iterator[tuple[Rows, Rows]]:
    """Yield training and test rows that share no group (object); every class stays in training.

    Raises:
        ValueError: if the table has no such column or only one group.
    """
    if column not in table.columns:
        raise ValueError(f"expected a group column among {sorted(table.columns)}, got {column!r}")
    groups = table.columns[column]
    names = np.unique(groups)
    if len(names) < 2:
        raise ValueError(f"group column {column}: expected at least two groups")
    classes = table.features.get(OBJECT_CLASS, np.zeros(table.rows, dtype=str))
    kind = {name: str(classes[np.flatnonzero(groups == name)[0]]) for name in names}
    for _ in range(trials):
        held: list[str] = []
        for own in sorted(set(kind.values())):
            members = rng.permutation([name for name in names if kind[name] == own])
            held.extend(members[: max(round((1.0 - share) * len(members)), 0)])
        chosen = np.isin(groups, held if held else [str(rng.choice(names))])
        yield np.flatnonzero(~chosen), np.flatnonzero(chosen)


def folds(rows: int, parts: int, rng: np.random.Generator) -> Iterator[tuple[Rows, Rows]]:
    """Yield training and test rows; every row is a test row once."""
    part = rng.permutation(np.arange(rows) % parts)
    for p in range(parts):
        yield np.flatnonzero(part != p), np.flatnonzero(part == p)


def run_trial(
    table: GraspTable, split: tuple[Rows, Rows], seed: int, config: ProtocolConfig,
    masks: Sequence[str] = MASKS,
) -> SplitTrial:  # fmt: skip
    """Return the predictions for one split's test rows.

    Args:
        table: all grasps.
        split: training and test rows.
        seed: of balancing, K-means and folds.
        config: see there.
        masks: names of the sets of observed variables.
    """
    part, test = table.select(split[0]), table.select(split[1])
    training = replace(config.training, masks=tuple(masks))
    recipes = training.recipes
    if config.baselines and config.recipes:
        extra = (PAPER, HARD, *(replace(r, hard=True) for r in recipes))
        training = replace(training, compared=extra)
    model = train(part, np.random.default_rng(seed), training)
    rows = {task: np.flatnonzero(np.isfinite(test.labels[task])) for task in table.labels}
    observed = split_observed(model.variables)
    probability: dict[tuple[str, str, str], Array] = {}
    for mask in masks:
        if mask not in observed:
            continue
        hidden = tuple(v for v in model.variables if v not in observed[mask])
        whole = model.evidence(test.features)
        evidence = whole.without(model.bank, hidden)
        answers = {"ours": sigmoid(model.calibrated_log_odds(evidence))}
        if model.compared[0].members and mask in ("full", "partial"):
            answers.update(_recipes(model, evidence))
        for method, values in answers.items():
            for column, task in enumerate(model.tasks):
                probability[method, task, mask] = values[rows[task], column]
        if config.baselines and mask in ("full", "partial"):
            compared = _compared(part, test, observed[mask])
            for (method, task), values in compared.items():
                probability[method, task, mask] = values[rows[task]]
    return SplitTrial({task: split[1][own] for task, own in rows.items()}, probability)


def _recipes(model: TaskModel, evidence: SoftEvidence) -> dict[str, Array]:
    """Return the probabilities (N, T) of the recipes compared: PAPER, HARD, then ours but hard."""
    sharp = hardened_evidence(model, evidence)
    paper = _part(model, slice(0, 1)).log_odds(evidence)
    hard = _part(model, slice(1, None)).log_odds(sharp)
    return {
        "paper_recipe": sigmoid(np.stack([own[:, 0] for own in paper], axis=1)),
        "hard": sigmoid(np.stack([own[:, 0] for own in hard], axis=1)),
        "hard_ours": sigmoid(np.stack([own[:, 1:].mean(axis=1) for own in hard], axis=1)),
    }


def _part(model: TaskModel, members: slice) -> TaskModel:
    """Return the model of some of the compared networks."""
    networks = tuple(replace(own, members=own.members[members]) for own in model.compared)
    return TaskModel(model.classes, model.variables, model.quantisers, networks, {})


def hardened_evidence(model: TaskModel, evidence: SoftEvidence) -> SoftEvidence:
    """Return the evidence with one state, the likeliest, in each block (hard discretisation)."""
    likelihoods = evidence.likelihoods.copy()
    for position, key in enumerate(model.bank.keys):
        start, size = model.bank.starts[key], model.bank.sizes[key]
        seen = evidence.observed.get(model.bank.variables[position], np.zeros(evidence.rows, bool))
        block = likelihoods[seen, start : start + size]
        if position > 0:
            weights = model.quantisers[key].mixture.weights
            block = block * weights
        likelihoods[seen, start : start + size] = np.eye(size)[block.argmax(axis=1)]
    return SoftEvidence(likelihoods, np.zeros_like(evidence.log_scale), evidence.observed)


def _compared(
    part: GraspTable, test: GraspTable, variables: tuple[str, ...]
) -> dict[tuple[str, str], Array]:
    """Return predictions (N,) of the models that are no networks."""
    result = {}
    for task, labels in part.labels.items():
        rows = np.flatnonzero(np.isfinite(labels))
        own: Features = part.select(rows).features
        if OBJECT_CLASS in own:
            result["class_only", task] = class_only(own, labels[rows], test.features)
        result["boosting", task] = boosting(own, labels[rows], test.features, variables)
    return result


def trial_scores(
    table: GraspTable, trial: SplitTrial
) -> dict[tuple[str, str, str], dict[str, float]]:
    """Return AUC and within-class AUC of every (method, task, mask) of a trial."""
    classes = table.features.get(OBJECT_CLASS, np.zeros(table.rows, dtype=str)).astype(str)
    result = {}
    for key, probability in trial.probability.items():
        rows = trial.rows[key[1]]
        labels = table.labels[key[1]][rows]
        result[key] = {
            "auc": auc(labels, probability),
            "within": auc_within(labels, probability, classes[rows]),
        }
    return result


def trial_roc(table: GraspTable, trial: SplitTrial, task: str, mask: str) -> Array:
    """Return our ROC curve of a trial on `ROC_GRID`."""
    labels = table.labels[task][trial.rows[task]]
    return roc(labels, trial.probability["ours", task, mask])


def held_out_calibration(
    table: GraspTable, trials: Sequence[SplitTrial]
) -> dict[tuple[str, str], float]:
    """Return the calibration error of (task, mask); every row is predicted once.

    Rows are weighed so that both labels have the same total, as the posteriors assume.
    """
    result = {}
    keys = {key[1:] for trial in trials for key in trial.probability if key[0] == "ours"}
    for task, mask in sorted(keys):
        labels = np.concatenate([table.labels[task][trial.rows[task]] for trial in trials])
        chance = np.concatenate([trial.probability["ours", task, mask] for trial in trials])
        result[task, mask] = calibration_error(labels, chance, balancing_weights(labels))
    return result


def unknown_class_auroc(table: GraspTable, seed: int, config: ProtocolConfig) -> dict[str, float]:
    """Return, per class left out of training, how well -log p(evidence) tells it from the rest.

    The class is not observed; the known grasps are held out from training, too.
    """
    classes = table.features[OBJECT_CLASS].astype(str)
    result = {}
    for name in sorted(set(classes.tolist()) - {""}):
        rng = np.random.default_rng(seed)
        known = rng.permutation(np.flatnonzero(classes != name))
        count = round(config.share * len(known))
        part = table.select(known[:count])
        labels = {t: v for t, v in part.labels.items() if len(set(v[np.isfinite(v)])) == 2}
        part = replace(part, labels=labels)
        if not labels:
            continue
        training = replace(config.training, masks=())
        model = train(part, rng, training)
        other = np.flatnonzero(classes == name)
        test = table.select(np.concatenate([known[count:], other]))
        features = {v: x for v, x in test.features.items() if v != OBJECT_CLASS}
        score = -model.log_evidence(features)
        truth = np.concatenate([np.zeros(len(known) - count), np.ones(len(other))])
        result[name] = auc(truth, score)
    return result
