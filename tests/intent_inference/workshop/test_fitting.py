"""Counts, structures, training and updating against pgmpy, pyAgrum and known truths."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.grasp_tables import made_up_grasps

from intent_inference.network.conditional_tables import (
    DirichletPrior,
    soft_counts,
    table_from_counts,
)
from intent_inference.network.structure import (
    TASK,
    SoftScore,
    chow_liu,
    learn_structure,
    naive_bayes,
    tree_augmented,
)
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_rows
from intent_inference.workshop.evaluation.scores import auc, calibration_error
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, assign, train
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_inference.workshop.training.updating import add_demonstrations

QUICK = TrainingConfig(
    recipes=(NetworkRecipe("tan", "information"), NetworkRecipe("class-tan", "6"))
)


@pytest.fixture(scope="module")
def model() -> TaskModel:
    return train(made_up_grasps(1500), np.random.default_rng(0), QUICK)


def one_hot_table(rows: int = 400, seed: int = 0) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Four dependent variables as one-hot assignments and as codes."""
    rng = np.random.default_rng(seed)
    task = rng.integers(0, 2, rows)
    a = np.where(rng.random(rows) < 0.8, task, rng.integers(0, 3, rows))
    b = np.where(rng.random(rows) < 0.7, a, rng.integers(0, 3, rows))
    c = np.where(rng.random(rows) < 0.6, 2 - b, rng.integers(0, 3, rows))
    codes = np.stack([task, a, b, c], axis=1)
    names = (TASK, "a", "b", "c")
    sizes = (2, 3, 3, 3)
    eyes = {n: np.eye(k)[codes[:, i]] for i, (n, k) in enumerate(zip(names, sizes, strict=True))}
    return eyes, codes


def test_soft_bic_of_certain_rows_is_pgmpys_bic() -> None:
    import pandas as pd
    from pgmpy.structure_score import BIC

    eyes, codes = one_hot_table()
    states = {n: list(range(v.shape[1])) for n, v in eyes.items()}
    reference = BIC(pd.DataFrame(codes, columns=list(eyes)), state_names=states)
    score = SoftScore(eyes)
    for variable, parents in (("a", (TASK,)), ("b", ("a", TASK)), ("c", ()), (TASK, ("c", "b"))):
        np.testing.assert_allclose(
            score.local(variable, parents), reference.local_score(variable, parents), rtol=1e-12
        )


def test_soft_tables_of_certain_rows_are_pgmpys() -> None:
    import pandas as pd
    from pgmpy.models import DiscreteBayesianNetwork
    from pgmpy.parameter_estimator import DiscreteBayesianEstimator

    eyes, codes = one_hot_table()
    states = {n: list(range(v.shape[1])) for n, v in eyes.items()}
    network = DiscreteBayesianNetwork([(TASK, "a"), (TASK, "b"), ("a", "b"), ("b", "c")])
    network.fit(
        pd.DataFrame(codes, columns=list(eyes)),
        estimator=DiscreteBayesianEstimator(
            state_names=states, prior_type="BDeu", equivalent_sample_size=5
        ),
    )
    prior = DirichletPrior(5.0, back_off=False)
    for variable, parents in (("a", (TASK,)), ("b", (TASK, "a")), ("c", ("b",))):
        ours = table_from_counts(soft_counts(eyes, variable, parents), prior)
        cpd = network.get_cpds(variable)
        order = [cpd.variables.index(p) for p in parents] + [0]
        np.testing.assert_allclose(ours, np.transpose(cpd.values, order), atol=1e-12)


def test_tree_is_pgmpys_chow_liu() -> None:
    import pandas as pd
    from pgmpy.estimators import TreeSearch

    eyes, codes = one_hot_table(2000)
    frame = pd.DataFrame(codes, columns=list(eyes))
    reference = TreeSearch(frame, root_node=TASK, n_jobs=1).estimate(
        "chow-liu", show_progress=False
    )
    ours = {(p, v) for v, parents in chow_liu(eyes).items() for p in parents}
    assert ours == set(reference.edges())


def test_greedy_search_reaches_pyagrums_bic() -> None:
    gum = pytest.importorskip("pyagrum")
    import pandas as pd

    eyes, codes = one_hot_table(2000)
    learner = gum.BNLearner(pd.DataFrame(codes, columns=list(eyes)).astype(str))
    learner.useScoreBIC()
    learner.useGreedyHillClimbing()
    learner.useNoPrior()
    other = learner.learnBN()
    names = [other.variable(i).name() for i in other.nodes()]
    found = {names[v]: tuple(names[p] for p in other.parents(v)) for v in range(len(names))}
    score = SoftScore(eyes)
    ours = score.total(learn_structure(eyes, "paper"))
    assert ours >= score.total(found) - 1e-6 * abs(ours)


def test_every_recipe_gives_an_acyclic_graph_over_all_variables() -> None:
    eyes, _ = one_hot_table()
    for kind in ("paper", "task-kept", "tan", "naive"):
        parents = learn_structure(eyes, kind)
        assert set(parents) == set(eyes)
        done: set[str] = set()
        while len(done) < len(parents):
            ready = {v for v in parents if v not in done and set(parents[v]) <= done}
            assert ready, f"{kind} has a cycle: {parents}"
            done |= ready
    assert all(TASK in p for v, p in tree_augmented(eyes).items() if v != TASK)
    assert naive_bayes(eyes)["a"] == (TASK,)
    with pytest.raises(ValueError, match="structure"):
        learn_structure(eyes, "star")


def test_tables_of_a_known_network_are_recovered_as_rows_grow() -> None:
    truth = np.array([[0.7, 0.2, 0.1], [0.1, 0.3, 0.6]])
    errors = []
    for rows in (100, 10000):
        rng = np.random.default_rng(0)
        parent = rng.integers(0, 2, rows)
        child = (rng.random(rows)[:, None] > np.cumsum(truth[parent], axis=1)).sum(axis=1)
        eyes = {"p": np.eye(2)[parent], "c": np.eye(3)[child]}
        table = table_from_counts(soft_counts(eyes, "c", ("p",)), DirichletPrior())
        errors.append(np.abs(table - truth).max())
    assert errors[1] < 0.02 < errors[0]


def test_rows_with_unknown_cells_count_where_they_are_known() -> None:
    eyes, _ = one_hot_table(50)
    eyes["a"] = eyes["a"].copy()
    eyes["a"][:20] = 0.0
    assert soft_counts(eyes, "a", (TASK,)).sum() == pytest.approx(30.0)
    assert soft_counts(eyes, "b", (TASK,)).sum() == pytest.approx(50.0)


def test_adding_in_parts_equals_adding_at_once(model: TaskModel) -> None:
    more = made_up_grasps(60, seed=5)
    once = add_demonstrations(model, more)
    parts = model
    for start in range(0, 60, 20):
        parts = add_demonstrations(parts, more.select(np.arange(start, start + 20)))
    for first, second in zip(once.networks, parts.networks, strict=True):
        for a, b in zip(first.members, second.members, strict=True):
            for v in a.parents:
                np.testing.assert_allclose(
                    table_from_counts(a.counts[v], a.prior),
                    table_from_counts(b.counts[v], b.prior),
                    atol=1e-12,
                )


def test_adding_equals_counting_all_grasps_at_once(model: TaskModel) -> None:
    first, more = made_up_grasps(70, seed=4), made_up_grasps(60, seed=5)
    added = add_demonstrations(model, more)
    for networks, grown in zip(model.networks, added.networks, strict=True):
        for member, after in zip(networks.members, grown.members, strict=True):
            rows = []
            for table in (first, more):
                own = assign(table.features, model.quantisers, model.classes)
                labels = np.eye(2)[table.labels[networks.task].astype(int)]
                rows.append({v: own[key] for v, key in member.keys.items()} | {TASK: labels})
            both = {v: np.concatenate([part[v] for part in rows]) for v in rows[0]}
            for v, parents in member.parents.items():
                batch = soft_counts(both, v, parents) - soft_counts(rows[0], v, parents)
                assert after.counts[v] - member.counts[v] == pytest.approx(batch, abs=1e-9)


def test_soft_counts_are_products_of_shares_summed_over_rows() -> None:
    rng = np.random.default_rng(3)
    shares = {"soft": rng.dirichlet(np.ones(4), 50), "other": rng.dirichlet(np.ones(3), 50)}
    shares |= {
        "crisp": np.eye(2)[rng.integers(0, 2, 50)],
        "sure": np.eye(3)[rng.integers(0, 3, 50)],
    }
    shares["crisp"][:5] = 0.0
    weights = rng.random(50)
    for child, (a, b) in {"soft": ("other", "crisp"), "sure": ("crisp", "other")}.items():
        expected = np.einsum("n,na,nb,nc->abc", weights, shares[a], shares[b], shares[child])
        assert soft_counts(shares, child, (a, b), weights) == pytest.approx(expected, abs=1e-12)
    expected = np.einsum("na,nc->ac", shares["crisp"], shares["sure"])
    assert soft_counts(shares, "sure", ("crisp",)) == pytest.approx(expected, abs=1e-12)


def test_demonstrations_move_the_posterior_towards_their_label(model: TaskModel) -> None:
    grasps = made_up_grasps(200, seed=9)
    never = GraspTable(grasps.features, {"pouring": np.zeros(200)}, {})
    taught = add_demonstrations(model, never, weight=5.0)
    column = model.tasks.index("pouring")
    before = model.posterior(grasps.features)[:, column].mean()
    assert taught.posterior(grasps.features)[:, column].mean() < before


def test_held_out_grasps_are_ranked_well_with_and_without_constraints(model: TaskModel) -> None:
    test = made_up_grasps(800, seed=1)
    full = model.posterior(test.features)
    partial = model.posterior({k: v for k, v in test.features.items() if k != "fvol"})
    for column, task in enumerate(model.tasks):
        assert auc(test.labels[task], full[:, column]) > 0.85
        assert auc(test.labels[task], partial[:, column]) > 0.7
        assert calibration_error(test.labels[task], full[:, column]) < 0.15


def test_shuffled_labels_teach_nothing() -> None:
    table = made_up_grasps(1500)
    rng = np.random.default_rng(0)
    shuffled = replace(table, labels={"pouring": rng.permutation(table.labels["pouring"])})
    nothing = train(shuffled, rng, replace(QUICK, masks=("full",)))
    test = made_up_grasps(3000, seed=1)
    score = nothing.posterior(test.features)[:, 0]
    labels = rng.permutation(test.labels["pouring"])
    assert abs(auc(labels, score) - 0.5) < 0.03


def test_opposite_quaternions_give_the_same_posterior(model: TaskModel) -> None:
    features = made_up_grasps(50, seed=2).features
    turned = {**features, "dir": -features["dir"]}
    np.testing.assert_allclose(model.posterior(features), model.posterior(turned), atol=1e-9)


def test_unknown_values_equal_absent_ones(model: TaskModel) -> None:
    features = made_up_grasps(20, seed=3).features
    blank = {**features, "npos": np.full((20, 3), np.nan), "obcl": np.full(20, "")}
    absent = {k: v for k, v in features.items() if k not in ("npos", "obcl")}
    np.testing.assert_allclose(model.posterior(blank), model.posterior(absent), atol=1e-12)


def test_evidence_equals_the_mixtures_own_likelihoods(model: TaskModel) -> None:
    features = made_up_grasps(30, seed=4).features
    deviation = {"npos": np.full((30, 3), 0.1), "dir": np.full((30, 4), 0.05)}
    evidence = model.evidence(features, deviation)
    for position, key in enumerate(model.bank.keys[1:], start=1):
        quantiser = model.quantisers[key]
        expected = quantiser.log_likelihoods(
            features[quantiser.variable], deviation.get(quantiser.variable)
        )
        block = evidence.likelihoods[:, model.bank.starts[key] :][:, : quantiser.states]
        with np.errstate(divide="ignore"):
            ours = np.log(block) + evidence.log_scale[:, position : position + 1]
        near = expected > expected.max(axis=1, keepdims=True) - 24.9
        np.testing.assert_allclose(ours[near], expected[near], atol=1e-8)


def test_wide_evidence_says_less(model: TaskModel) -> None:
    features = made_up_grasps(200, seed=6).features
    wide = {"npos": np.full((200, 3), 3.0), "dir": np.full((200, 4), 2.0)}
    sure = np.abs(model.posterior(features) - 0.5).mean()
    assert np.abs(model.posterior(features, wide) - 0.5).mean() < sure


def test_extreme_values_give_finite_posteriors(model: TaskModel) -> None:
    features = select_rows(made_up_grasps(5).features, np.arange(2))
    features = {**features, "size": np.full((2, 3), 1e5), "fcon": np.full((2, 20), 1e3)}
    assert np.isfinite(model.posterior(features)).all()
    assert np.isfinite(model.log_evidence(features)).all()


def test_an_object_unlike_all_others_has_low_evidence(model: TaskModel) -> None:
    features = made_up_grasps(100, seed=7).features
    shape = {"size": features["size"], "conv": features["conv"]}
    strange = {"size": features["size"] * [1.0, 6.0, 0.2], "conv": features["conv"]}
    assert model.log_evidence(shape).mean() > model.log_evidence(strange).mean() + 5.0


def test_scores_of_objects_and_grasps_agree_with_the_posterior(model: TaskModel) -> None:
    grasps = made_up_grasps(300, seed=8)
    objects = {k: grasps.features[k] for k in ("obcl", "size", "conv")}
    affords = model.object_score("pouring", objects)
    assert (
        affords[grasps.features["obcl"] != "hammer"].min()
        > affords[grasps.features["obcl"] == "hammer"].max()
    )
    relative = model.grasp_score("pouring", grasps.features, relative=True)
    mugs = grasps.features["obcl"] == "mug"
    assert auc(grasps.labels["pouring"][mugs], relative[mugs]) > 0.75
    with pytest.raises(ValueError, match="expected one of the tasks"):
        model.grasp_score("juggling", grasps.features)


def test_sampled_grasps_lie_on_their_manifolds_and_suit_the_task(model: TaskModel) -> None:
    mug = {k: v[:1] for k, v in made_up_grasps(1).features.items() if k in ("obcl", "size")}
    mug["obcl"] = np.array(["mug"])
    drawn = model.sample("pouring", mug, 40, np.random.default_rng(0), ("npos", "dir"))
    np.testing.assert_allclose(np.linalg.norm(drawn["npos"], axis=1), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(drawn["dir"], axis=1), 1.0, atol=1e-9)
    assert drawn["npos"][:, 2].mean() < 0.0
    value = model.defuzzify("pouring", mug, "npos")
    np.testing.assert_allclose(np.linalg.norm(value), 1.0, atol=1e-9)


def test_a_fifth_task_is_one_more_label_column() -> None:
    table = made_up_grasps(600)
    drinking = (table.features["npos"][:, 0] > 0.3).astype(float)
    drinking[:50] = np.nan
    more = replace(table, labels={**table.labels, "drinking": drinking})
    fitted = train(more, np.random.default_rng(0), QUICK)
    assert fitted.tasks == ("pouring", "hand-over", "drinking")
    test = made_up_grasps(300, seed=1)
    chance = fitted.posterior(test.features)[:, 2]
    assert auc((test.features["npos"][:, 0] > 0.3).astype(float), chance) > 0.8
