"""Compiled inference against brute force, pyAgrum and pgmpy."""

import numpy as np
import pytest

from intent_inference.network.bayesian_network import (
    DiscreteNetwork,
    compile_networks,
    compile_single,
)


def random_network(rng: np.random.Generator, size: int, most_states: int = 4) -> DiscreteNetwork:
    states = rng.integers(2, most_states + 1, size)
    parents, tables = [], []
    for v in range(size):
        count = int(rng.integers(0, min(v, 3) + 1))
        own = tuple(int(p) for p in rng.choice(v, count, replace=False)) if count else ()
        shape = (*(states[p] for p in own), states[v])
        tables.append(rng.dirichlet(np.ones(states[v]), size=shape[:-1]).reshape(shape))
        parents.append(own)
    return DiscreteNetwork(tuple(f"v{i}" for i in range(size)), tuple(parents), tuple(tables))


def random_evidence(rng: np.random.Generator, network: DiscreteNetwork, target: int) -> np.ndarray:
    """Soft evidence, one-hot evidence or none (ones) for each variable; none for the target."""
    blocks = []
    for v, states in enumerate(network.states):
        kind = rng.integers(3) if v != target else 0
        soft = rng.random(states) + 1e-3
        hard = np.eye(states)[rng.integers(states)]
        blocks.append((np.ones(states), soft, hard)[kind])
    return np.concatenate(blocks)


def brute_force(network: DiscreteNetwork, target: int, likelihood: np.ndarray) -> np.ndarray:
    joint = np.ones(network.states)
    ends = np.cumsum(network.states)
    for v, (parents, table) in enumerate(zip(network.parents, network.tables, strict=True)):
        axes = [*parents, v]
        shape = np.ones(len(network.states), dtype=int)
        shape[axes] = table.shape
        joint = joint * np.transpose(table, np.argsort(axes)).reshape(shape)
        own = np.ones(len(network.states), dtype=int)
        own[v] = network.states[v]
        joint = joint * likelihood[ends[v] - network.states[v] : ends[v]].reshape(own)
    return joint.sum(axis=tuple(i for i in range(joint.ndim) if i != target))


@pytest.mark.parametrize("seed", range(20))
def test_posterior_and_evidence_equal_the_brute_force_joint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    network = random_network(rng, int(rng.integers(1, 7)))
    target = int(rng.integers(len(network.names)))
    likelihood = random_evidence(rng, network, target)
    joint = brute_force(network, target, likelihood)
    posterior, log_evidence = compile_single(network, network.names[target]).query(likelihood)
    np.testing.assert_allclose(posterior[0, 0], joint / joint.sum(), atol=1e-12)
    np.testing.assert_allclose(log_evidence[0, 0], np.log(joint.sum()), atol=1e-10)


@pytest.mark.slow
def test_two_hundred_random_networks_agree_with_pyagrum() -> None:
    gum = pytest.importorskip("pyagrum")
    rng = np.random.default_rng(7)
    for _ in range(200):
        network = random_network(rng, 10)
        target = int(rng.integers(10))
        likelihood = random_evidence(rng, network, target)
        posterior, log_evidence = compile_single(network, network.names[target]).query(likelihood)
        reference = gum.BayesNet()
        for name, states in zip(network.names, network.states, strict=True):
            reference.add(gum.LabelizedVariable(name, name, int(states)))
        for v, parents in enumerate(network.parents):
            for p in parents:
                reference.addArc(p, v)
        for v, parents in enumerate(network.parents):
            for index in np.ndindex(*(network.states[p] for p in parents)):
                place = {network.names[p]: int(i) for p, i in zip(parents, index, strict=True)}
                reference.cpt(v)[place] = network.tables[v][index].tolist()
        inference = gum.LazyPropagation(reference)
        ends = np.cumsum(network.states)
        for v, states in enumerate(network.states):
            if v != target:
                inference.addEvidence(v, likelihood[ends[v] - states : ends[v]].tolist())
        inference.addTarget(target)
        inference.makeInference()
        np.testing.assert_allclose(posterior[0, 0], inference.posterior(target).tolist(), atol=1e-9)
        expected = np.log(inference.evidenceProbability())
        np.testing.assert_allclose(log_evidence[0, 0], expected, atol=1e-9)


@pytest.mark.slow
def test_random_networks_agree_with_pgmpys_junction_tree() -> None:
    from intent_inference.network.junction_tree import junction_tree_posterior

    rng = np.random.default_rng(11)
    for _ in range(10):
        network = random_network(rng, 7, most_states=3)
        target = int(rng.integers(7))
        likelihood = random_evidence(rng, network, target)
        posterior, _ = compile_single(network, network.names[target]).query(likelihood)
        reference = junction_tree_posterior(network, network.names[target], likelihood)
        np.testing.assert_allclose(posterior[0, 0], reference, atol=1e-9)


def test_scaling_a_likelihood_leaves_the_posterior_unchanged() -> None:
    rng = np.random.default_rng(3)
    network = random_network(rng, 6)
    likelihood = random_evidence(rng, network, 0)
    schedule = compile_single(network, "v0")
    scaled = likelihood.copy()
    scaled[-network.states[-1] :] *= 1e-150
    np.testing.assert_allclose(schedule.query(likelihood)[0], schedule.query(scaled)[0], rtol=1e-12)


def test_many_networks_and_rows_at_once_equal_one_at_a_time() -> None:
    rng = np.random.default_rng(6)
    first, second = (random_network(np.random.default_rng(s), 5, 3) for s in (1, 2))
    second = DiscreteNetwork(first.names, first.parents, tuple(
        rng.dirichlet(np.ones(t.shape[-1]), size=t.shape[:-1]) for t in first.tables
    ))  # fmt: skip
    starts = np.cumsum(first.states) - np.array(first.states)
    rows = np.stack([random_evidence(rng, first, 2) for _ in range(9)])
    together, _ = compile_networks([first, second], "v2", [starts, starts]).query(rows)
    for g, network in enumerate((first, second)):
        for n, row in enumerate(rows):
            alone, _ = compile_single(network, "v2").query(row)
            np.testing.assert_allclose(together[g, n], alone[0, 0], atol=1e-12)


def test_impossible_evidence_is_refused() -> None:
    table = np.array([[1.0, 0.0], [1.0, 0.0]])
    network = DiscreteNetwork(("a", "b"), ((), (0,)), (np.array([0.5, 0.5]), table))
    with pytest.raises(ValueError, match="probability zero"):
        compile_single(network, "a").query(np.array([1.0, 1.0, 0.0, 1.0]))
    with pytest.raises(ValueError, match="not negative"):
        compile_single(network, "a").query(np.array([1.0, -1.0, 0.0, 1.0]))
