"""Structures: which variable depends on which (Sec. IV-B.2, Fig. 4)."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from intent_inference.network.conditional_tables import soft_counts
from intent_inference.quantisation.quantiser import information_of, mutual_information
from intent_perception.basics.arrays import Array

Assignments = dict[str, Array]
"""Variable to (N, K) soft assignment; rows of zeros are unknown. The task is one of them."""
Parents = dict[str, tuple[str, ...]]
"""Variable to its parents: a directed acyclic graph."""

TASK = "task"
_MOST_PARENTS = 3


class SoftScore:
    """Bayesian information criterion of a family under soft counts, remembered."""

    def __init__(self, assignments: Assignments) -> None:
        self._assignments = assignments
        self._rows = len(next(iter(assignments.values())))
        self._known: dict[tuple[str, frozenset[str]], float] = {}

    def local(self, variable: str, parents: Sequence[str]) -> float:
        """Return the score of a variable given its parents; higher is better."""
        key = (variable, frozenset(parents))
        if key not in self._known:
            counts = soft_counts(self._assignments, variable, sorted(parents))
            counts = counts.reshape(-1, counts.shape[-1])
            total = counts.sum(axis=1, keepdims=True)
            used = counts > 1e-12
            share = np.where(used, counts / np.maximum(total, 1e-12), 1.0)
            likelihood = float(np.sum(np.where(used, counts, 0.0) * np.log(share)))
            free = counts.shape[0] * (counts.shape[1] - 1)
            self._known[key] = likelihood - 0.5 * np.log(self._rows) * free
        return self._known[key]

    def total(self, parents: Parents) -> float:
        """Return the score of a whole graph."""
        return sum(self.local(variable, chosen) for variable, chosen in parents.items())


def naive_bayes(assignments: Assignments) -> Parents:
    """Return the graph in which the task is the only parent of everything."""
    return {v: () if v == TASK else (TASK,) for v in assignments}


def maximum_spanning_tree(
    names: Sequence[str], root: str, weight: Callable[[str, str], float]
) -> Parents:
    """Return the tree of greatest total weight (Prim), edges pointing away from the root."""
    parents: Parents = {root: ()}
    best = {v: (weight(root, v), root) for v in names if v != root}
    while best:
        child = max(best, key=lambda v: best[v][0])
        parents[child] = (best.pop(child)[1],)
        for other, (value, _) in best.items():
            candidate = weight(child, other)
            if candidate > value:
                best[other] = (candidate, child)
    return parents


def chow_liu(assignments: Assignments, root: str = TASK) -> Parents:
    """Return the maximum-weight spanning tree by mutual information (the paper's initial DAG)."""
    return maximum_spanning_tree(
        list(assignments),
        root,
        lambda a, b: mutual_information(assignments[a], assignments[b]),
    )


def tree_augmented(assignments: Assignments, shared: Sequence[str] = (TASK,)) -> Parents:
    """Return a tree-augmented network: shared parents for all, and a tree among the others.

    Args:
        assignments: see there.
        shared: the common parents in order, the task first; each is a child of those before it.
            (TASK,) gives tree-augmented naive Bayes; (TASK, "obcl") lets every effect of the task
            depend on the object class.
    """
    others = [v for v in assignments if v not in shared]
    parents: Parents = {v: tuple(shared[:i]) for i, v in enumerate(shared)}
    if not others:
        return parents

    def information(a: str, b: str) -> float:
        joint = soft_counts(assignments, b, (*shared, a))
        tables = joint.reshape(-1, *joint.shape[-2:])
        shares = tables.sum(axis=(1, 2)) / max(float(tables.sum()), 1e-12)
        return float(
            sum(share * information_of(table) for share, table in zip(shares, tables, strict=True))
        )

    # The tree's first variable: the one that the task tells most about.
    first = max(others, key=lambda v: mutual_information(assignments[TASK], assignments[v]))
    tree = maximum_spanning_tree(others, first, information)
    for variable in others:
        parents[variable] = (*shared, *tree[variable])
    return parents


def hill_climb(
    assignments: Assignments, start: Parents, required: Sequence[tuple[str, str]] = ()
) -> Parents:
    """Return the graph where pgmpy's greedy search under the soft-count BIC ends (Sec. IV-B.2).

    Args:
        assignments: see there.
        start: the initial graph.
        required: edges (parent, child) that stay.
    """
    import pandas as pd
    from pgmpy.base import DAG
    from pgmpy.causal_discovery import ExpertKnowledge, HillClimbSearch

    names = list(assignments)
    # The search reads names and states here; every count comes from the soft score.
    frame = pd.DataFrame(
        {v: pd.Categorical.from_codes(shares.argmax(axis=1), categories=range(shares.shape[1]))
         for v, shares in assignments.items()}
    )  # fmt: skip
    graph = DAG()
    graph.add_nodes_from(names)
    graph.add_edges_from([(p, v) for v, chosen in start.items() for p in chosen])
    search = HillClimbSearch(
        scoring_method=pgmpy_score(frame, SoftScore(assignments)),
        start_dag=graph,
        max_indegree=_MOST_PARENTS,
        return_type="dag",
        show_progress=False,
        expert_knowledge=ExpertKnowledge(required_edges=list(required)) if required else None,
    )
    found = search.fit(frame).causal_graph_
    order = {v: i for i, v in enumerate(names)}
    return {
        v: tuple(sorted((str(p) for p in found.predecessors(v)), key=lambda p: order[p]))
        for v in names
    }


def pgmpy_score(frame: Any, score: SoftScore) -> Any:
    """Return a score object for pgmpy's searches that counts softly."""
    from pgmpy.structure_score import BIC

    class SoftBic(BIC):
        """BIC whose family counts are sums of products of soft assignments."""

        def _local_score(self, variable: str, parents: tuple[str, ...]) -> float:
            return score.local(variable, parents)

    return SoftBic(frame)


def learn_structure(assignments: Assignments, kind: str) -> Parents:
    """Return the graph of one of the recipes.

    Args:
        assignments: training rows, the task (TASK) among them.
        kind: "paper" (spanning tree, then greedy BIC), "task-kept" (greedy BIC from naive Bayes
            whose edges stay), "tan" (tree-augmented naive Bayes), "class-tan" (the same with the
            object class as a second common parent), "naive".

    Raises:
        ValueError: for another kind.
    """
    if kind == "paper":
        return hill_climb(assignments, chow_liu(assignments))
    if kind == "task-kept":
        required = [(TASK, v) for v in assignments if v != TASK]
        return hill_climb(assignments, naive_bayes(assignments), required)
    if kind == "tan":
        return tree_augmented(assignments)
    if kind == "class-tan":
        shared = (TASK, "obcl") if "obcl" in assignments else (TASK,)
        return tree_augmented(assignments, shared)
    if kind == "naive":
        return naive_bayes(assignments)
    raise ValueError(f"structure: expected paper, task-kept, tan, class-tan or naive, got {kind}")
