"""Training: a table of grasps to the networks of every task (Sec. IV-B)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from intent_inference.network.conditional_tables import DirichletPrior, soft_counts
from intent_inference.network.probability_calibration import OddsCalibration, fit_calibration
from intent_inference.network.structure import TASK, Assignments, learn_structure
from intent_inference.network.task_model import Member, TaskModel, TaskNetworks
from intent_inference.quantisation.feature_table import (
    Features,
    count_rows,
    is_observed,
    select_rows,
)
from intent_inference.quantisation.quantiser import (
    Quantisation,
    QuantisationConfig,
    Quantiser,
    chosen_by_information,
    quantise,
)
from intent_inference.quantisation.variables import OBJECT_CLASS, split_observed
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked

Rows = NDArray[np.int64]

_FEWEST = 10


@dataclass(frozen=True)
class NetworkRecipe:
    """One network of the average."""

    structure: str
    """See `learn_structure`."""
    states: str
    """"information" (K by mutual information with the task), "paper" (Davies-Bouldin, BIC), or a
    number of states for every variable."""
    hard: bool = False
    """Each value counts for its likeliest state alone (a baseline)."""
    without: tuple[str, ...] = ()
    """Variables that this network leaves out: one that says little about a task adds noise, and the
    joined answer weighs the networks by task."""
    balanced: bool = False
    """Learn from as many grasps with the task as without (Table II) instead of from all."""
    prior: DirichletPrior = field(default_factory=DirichletPrior)

    @property
    def name(self) -> str:
        """Short name."""
        left_out = "".join(f" without {name}" for name in self.without)
        return f"{self.structure}/{self.states}{'/hard' if self.hard else ''}{left_out}"


DEFAULT_RECIPES = (
    NetworkRecipe("class-tan", "information"),
    NetworkRecipe("class-tan", "24"),
    NetworkRecipe("tan", "24"),
    NetworkRecipe("class-tan", "24", without=("dir",)),
)


@dataclass(frozen=True)
class TrainingConfig(Checked):
    """How a model is trained."""

    recipes: tuple[NetworkRecipe, ...] = DEFAULT_RECIPES
    """The networks of each task whose answers are joined."""
    quantisation: QuantisationConfig = field(default_factory=QuantisationConfig)
    folds: int = 5
    """Parts of the data for the held-out predictions that calibration needs, 2..100."""
    most_rows: int = 6000
    """Most rows per task; of more, the rarer label is kept; 10..10000000."""
    masks: tuple[str, ...] | None = None
    """Sets of observed variables to calibrate for (names of `split_observed`); None: all."""
    compared: tuple[NetworkRecipe, ...] = ()
    """Further networks that take no part in the answer (evaluation)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.recipes:
            raise ValueError("recipes: expected at least one network")


def balanced_rows(labels: Array, rng: np.random.Generator, most: int | None = None) -> Rows:
    """Return as many positives as negatives, shuffled (Table II); unknown labels are left out.

    Raises:
        ValueError: if one of the labels does not occur.
    """
    positives, negatives = np.flatnonzero(labels == 1.0), np.flatnonzero(labels == 0.0)
    count = min(len(positives), len(negatives))
    if most is not None:
        count = min(count, most // 2)
    if count == 0:
        raise ValueError("expected grasps with and without the task, got only one kind")
    chosen = [rng.choice(rows, count, replace=False) for rows in (positives, negatives)]
    return rng.permutation(np.concatenate(chosen))


def training_rows(labels: Array, rng: np.random.Generator, most: int) -> Rows:
    """Return the rows with known labels, shuffled; of more than `most` the rarer label stays."""
    positives, negatives = np.flatnonzero(labels == 1.0), np.flatnonzero(labels == 0.0)
    rare, common = sorted((positives, negatives), key=len)
    rare = rng.permutation(rare)[: max(most // 2, most - len(common))]
    common = rng.permutation(common)[: most - len(rare)]
    return rng.permutation(np.concatenate([rare, common]))


def balancing_weights(labels: Array) -> Array:
    """Return weights (N,) of mean 1 that give both labels the same total."""
    share = float(labels.mean())
    weights: Array = np.where(labels == 1.0, 0.5 / share, 0.5 / (1.0 - share))
    return weights


def quantise_table(
    features: Features, rng: np.random.Generator, config: QuantisationConfig
) -> dict[str, Quantisation]:
    """Return the quantisation of every continuous variable that has enough known values."""
    result = {}
    for name, values in features.items():
        if name != OBJECT_CLASS:
            known = values[is_observed(features, name)]
            if len(known) >= 10:
                result[name] = quantise(name, known, rng, config)
    return result


def class_assignment(features: Features, classes: Sequence[str]) -> Array:
    """Return the one-hot object class of each row, (N, classes); zeros where unknown."""
    names = np.asarray(features[OBJECT_CLASS], dtype=str)
    one_hot: Array = (names[:, None] == np.array(classes)[None]).astype(np.float64)
    return one_hot


def assign(
    features: Features, quantisers: dict[str, Quantiser], classes: Sequence[str]
) -> Assignments:
    """Return quantiser key to soft assignment (N, K) of a feature table."""
    result = {}
    if classes and OBJECT_CLASS in features:
        result[OBJECT_CLASS] = class_assignment(features, classes)
    for key, quantiser in quantisers.items():
        name = quantiser.variable
        result[key] = quantiser.responsibilities(features[name], is_observed(features, name))
    return result


def hardened(assignments: Assignments) -> Assignments:
    """Return assignments to the likeliest state alone."""
    return {
        key: (shares == shares.max(axis=1, keepdims=True)) * (shares > 0.0).astype(np.float64)
        for key, shares in assignments.items()
    }


def train(
    table: GraspTable, rng: np.random.Generator, config: TrainingConfig | None = None
) -> TaskModel:
    """Return the model of all tasks of a table.

    Args:
        table: labelled grasps.
        rng: subsets, K-means starts and folds.
        config: see there.

    Raises:
        ValueError: if a task has only one label, or no variable has ten known values.
    """
    config = config or TrainingConfig()
    quantisations = quantise_table(table.features, rng, config.quantisation)
    classes: tuple[str, ...] = ()
    if OBJECT_CLASS in table.features:
        classes = tuple(sorted(set(table.features[OBJECT_CLASS].tolist()) - {""}))
    if not quantisations and not classes:
        raise ValueError("expected at least one variable with ten known values")
    quantisers = {
        f"{name}/{count}": quantiser
        for name, quantisation in quantisations.items()
        for count, quantiser in quantisation.quantisers.items()
    }
    assignments = assign(table.features, quantisers, classes)
    variables = tuple(
        n for n in table.features if n in quantisations or (n == OBJECT_CLASS and classes)
    )
    fitted: list[tuple[TaskNetworks, Rows]] = []
    compared = []
    for task, labels in usable_labels(table).items():
        rows = training_rows(labels, rng, config.most_rows)
        own = {key: shares[rows] for key, shares in assignments.items()}
        networks = fit_networks(task, own, labels[rows], quantisations, config.recipes, rng)
        fitted.append((networks, rows))
        compared.append(fit_networks(task, own, labels[rows], quantisations, config.compared, rng))
    everything = [*compared, *(networks for networks, _ in fitted)]
    used = {key for networks in everything for m in networks.members for key in m.keys.values()}
    model = TaskModel(
        classes=classes,
        variables=variables,
        quantisers={key: q for key, q in quantisers.items() if key in used},
        networks=tuple(networks for networks, _ in fitted),
        description={"rows": str(table.rows)},
        compared=tuple(compared),
    )
    masks = split_observed(variables)
    if config.masks is not None:
        masks = {name: masks[name] for name in config.masks if name in masks}
    calibrated = tuple(
        replace(
            networks,
            calibrations=calibrations_of(
                model, networks, select_rows(table.features, rows),
                {key: assignments[key][rows] for key in used},
                table.labels[networks.task][rows], rng, config.folds, masks,
            ),
        )
        for networks, rows in fitted
    )  # fmt: skip
    return replace(model, networks=calibrated)


def usable_labels(table: GraspTable) -> dict[str, Array]:
    """Return the tasks with enough grasps of both kinds.

    Raises:
        ValueError: if there is none.
    """
    counts = {t: (int((v == 1.0).sum()), int((v == 0.0).sum())) for t, v in table.labels.items()}
    usable = {t: v for t, v in table.labels.items() if min(counts[t]) >= _FEWEST}
    if not usable:
        raise ValueError(
            f"expected a task with {_FEWEST} grasps that afford it and {_FEWEST} that do not, got "
            + ", ".join(f"{task} {yes}/{no}" for task, (yes, no) in counts.items())
        )
    return usable


def fit_networks(
    task: str,
    assignments: Assignments,
    labels: Array,
    quantisations: dict[str, Quantisation],
    recipes: Sequence[NetworkRecipe],
    rng: np.random.Generator,
) -> TaskNetworks:
    """Return one task's networks, not yet calibrated.

    Args:
        task: its name.
        assignments: quantiser key to (N, K) soft assignment of the training rows.
        labels: (N,) 0 or 1.
        quantisations: variable to its quantisers.
        recipes: one network each.
        rng: of balanced subsets.
    """
    members = []
    for recipe in recipes:
        rows = balanced_rows(labels, rng) if recipe.balanced else np.arange(len(labels))
        one_hot = np.eye(2)[labels[rows].astype(np.int64)]
        # Structure and states see both labels as equally frequent.
        even = one_hot * balancing_weights(labels[rows])[:, None]
        used = {key: shares[rows] for key, shares in assignments.items()}
        keys = {
            name: f"{name}/{_states(name, quantisation, used, even, recipe.states)}"
            for name, quantisation in quantisations.items()
            if name not in recipe.without or len(quantisations) == 1
        }
        if OBJECT_CLASS in used:
            keys = {OBJECT_CLASS: OBJECT_CLASS, **keys}
        own = {v: used[key] for v, key in keys.items()}
        if recipe.hard:
            own = hardened(own)
        parents = learn_structure({TASK: even, **own}, recipe.structure)
        own = {TASK: one_hot, **own}
        counts = {v: soft_counts(own, v, chosen) for v, chosen in parents.items()}
        members.append(Member(recipe.name, parents, keys, counts, recipe.prior))
    return TaskNetworks(task, tuple(members), ())


def _states(
    name: str, quantisation: Quantisation, assignments: Assignments, task: Array, choice: str
) -> int:
    available = quantisation.quantisers
    if choice == "paper":
        return min(quantisation.criterion, key=lambda k: quantisation.criterion[k])
    if choice == "information":
        return chosen_by_information({k: assignments[f"{name}/{k}"] for k in available}, task)
    return min(available, key=lambda k: abs(k - int(choice)))


def calibrations_of(
    model: TaskModel,
    networks: TaskNetworks,
    features: Features,
    assignments: Assignments,
    labels: Array,
    rng: np.random.Generator,
    folds: int,
    masks: dict[str, tuple[str, ...]],
) -> tuple[OddsCalibration, ...]:
    """Return the calibration for every set of observed variables, from held-out predictions.

    Structure and states are kept; each part's rows are taken out of the counts before it is
    predicted, which is exact because counts add.
    """
    if not masks:
        return ()
    rows = count_rows(features)
    part = rng.permutation(np.arange(rows) % folds)
    odds = {mask: np.zeros((rows, len(networks.members))) for mask in masks}
    one_hot = np.eye(2)[labels.astype(np.int64)]
    for fold in range(folds):
        held = np.flatnonzero(part == fold)
        own = {key: shares[held] for key, shares in assignments.items()}
        members = tuple(
            member.with_rows(own, one_hot[held], np.full(len(held), -1.0))
            for member in networks.members
        )
        partial = replace(model, networks=(replace(networks, members=members),))
        evidence = partial.evidence(select_rows(features, held))
        for mask, observed in masks.items():
            hidden = tuple(v for v in model.variables if v not in observed)
            seen = evidence.without(partial.bank, hidden)
            odds[mask][held] = partial.log_odds(seen)[0]
    weights = balancing_weights(labels)
    return tuple(
        fit_calibration(masks[mask], values, labels, weights) for mask, values in odds.items()
    )
