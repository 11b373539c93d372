"""The paper's inference: pgmpy's junction tree (Sec. II-C), a reference that is slow to load."""

import numpy as np

from intent_inference.network.bayesian_network import DiscreteNetwork
from intent_inference.network.structure import TASK
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.soft_evidence import SoftEvidence
from intent_perception.basics.arrays import Array


def junction_tree_posterior(network: DiscreteNetwork, target: str, likelihoods: Array) -> Array:
    """Return p(target | soft evidence) by message passing on the junction tree.

    Args:
        network: the network.
        target: the variable asked for.
        likelihoods: (L,) likelihoods of the variables in order; those of the target count too.

    Returns:
        (states of the target,) probabilities.
    """
    from pgmpy.factors.discrete import TabularCPD
    from pgmpy.inference import BeliefPropagation
    from pgmpy.models import DiscreteBayesianNetwork

    model = DiscreteBayesianNetwork()
    states = network.states
    connected = _component(network, network.names.index(target))
    model.add_nodes_from([network.names[v] for v in sorted(connected)])
    for v, (parents, table) in enumerate(zip(network.parents, network.tables, strict=True)):
        if v not in connected:  # pgmpy's tree must be in one piece; the rest says nothing
            continue
        model.add_edges_from([(network.names[p], network.names[v]) for p in parents])
        flat = table.reshape(-1, states[v]).T
        model.add_cpds(
            TabularCPD(
                network.names[v], states[v], flat,
                evidence=[network.names[p] for p in parents],
                evidence_card=[states[p] for p in parents],
            )
        )  # fmt: skip
    virtual = []
    own = np.ones(states[network.names.index(target)])
    ends = np.cumsum(states)
    for v, name in enumerate(network.names):
        likelihood = likelihoods[ends[v] - states[v] : ends[v]]
        if name == target:
            own = likelihood
        elif v in connected and np.ptp(likelihood) > 0.0:
            # Scaled to sum one: values above one are refused, tiny ones give NaN.
            scaled = likelihood / likelihood.sum()
            virtual.append(TabularCPD(name, states[v], scaled[:, None]))
    inference = BeliefPropagation(model)
    result = inference.query([target], virtual_evidence=virtual or None, show_progress=False)
    posterior: Array = np.asarray(result.values, dtype=np.float64) * own
    return posterior / posterior.sum()


def _component(network: DiscreteNetwork, target: int) -> set[int]:
    """Return the variables that some path of edges joins to the target."""
    edges = [(p, v) for v, parents in enumerate(network.parents) for p in parents]
    found = {target}
    for _ in network.names:
        found |= {v for p, v in edges if p in found} | {p for p, v in edges if v in found}
    return found


def junction_tree_log_odds(model: TaskModel, evidence: SoftEvidence) -> list[Array]:
    """Return each task's (N, M) log-odds of its networks, as `TaskModel.log_odds` does."""
    result = []
    for networks in model.networks:
        odds = np.zeros((evidence.rows, len(networks.members)))
        for column, member in enumerate(networks.members):
            network = member.network()
            for row in range(evidence.rows):
                parts = [np.ones(2)]
                for name in network.names[1:]:
                    key = member.keys[name]
                    start = model.bank.starts[key]
                    parts.append(evidence.likelihoods[row, start : start + model.bank.sizes[key]])
                posterior = junction_tree_posterior(network, TASK, np.concatenate(parts))
                odds[row, column] = np.log(posterior[1]) - np.log(posterior[0])
        result.append(odds)
    return result
