"""Discrete Bayesian networks under soft evidence, answered by a compiled elimination schedule.

Every variable carries a likelihood vector y_k = p(x | k) (virtual evidence, Sec. II-B.2); a
missing variable carries ones. Variables are eliminated one by one in an order that is fixed when
the network is compiled, so that a query is one pass over flat arrays (Sec. II-C; the paper runs a
junction tree).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_inference.network.elimination_kernel import run_schedule
from intent_perception.basics.arrays import Array

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DiscreteNetwork:
    """A directed acyclic graph with one conditional probability table per variable."""

    names: tuple[str, ...]
    """Variables; an index below is a position in this tuple."""
    parents: tuple[tuple[int, ...], ...]
    """Parents of each variable."""
    tables: tuple[Array, ...]
    """P(variable | parents), shape (states of each parent in order..., states of the variable)."""

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.parents) == len(self.tables):
            raise ValueError("expected one name, one parent tuple and one table per variable")
        for name, parents, table in zip(self.names, self.parents, self.tables, strict=True):
            expected = tuple(self.tables[p].shape[-1] for p in parents)
            if table.shape[:-1] != expected:
                raise ValueError(f"{name}: expected parent states {expected}, got {table.shape}")

    @property
    def states(self) -> tuple[int, ...]:
        """Number of states of each variable."""
        return tuple(table.shape[-1] for table in self.tables)


@dataclass(frozen=True, eq=False)
class Schedule:
    """Flat arrays of one or more compiled networks that share a vector of likelihoods."""

    buffer: Array
    """All constant tables, one after the other, then room for the messages of one query at a time:
    a schedule is not to be asked from two threads."""
    steps: Index
    """(S, 9): likelihood start, states, message start, message size, first factor, end of factors,
    first gate, end of gates, whether the only table is the variable's own (1 or 0)."""
    gates: Index
    """(E, 2) variables of a message other than the target: likelihood start, start of the map from
    message entry to state. Entries in states of likelihood zero are skipped."""
    factors: Index
    """(F, 4): start in the buffer, stride of the eliminated variable, start of the map from message
    entry to factor entry, the step that made it (-1: a table)."""
    maps: Index
    """Entries of a factor, or states of a gate, for each entry of the message made from it."""
    networks: Index
    """(G, 4): first step, end of steps, first final factor, end of final factors."""
    finals: Index
    """(H, 2): start in the buffer, stride of the target (0: a constant)."""
    target_states: int
    target_likelihood: Index
    """(G,) start of the target's own likelihoods, or -1."""

    def query(self, likelihoods: Array) -> tuple[Array, Array]:
        """Return the target's posterior and log p(evidence) of each network (Sec. II-C).

        Args:
            likelihoods: (N, L) likelihoods of all variables, laid out as when compiling; only
                ratios within a variable matter for the posterior.

        Returns:
            Posterior (G, N, states of the target), rows sum to one, and log evidence (G, N).

        Raises:
            ValueError: if a likelihood is negative, not finite, or all of a variable are zero.
        """
        likelihoods = np.ascontiguousarray(np.atleast_2d(likelihoods), dtype=np.float64)
        if not np.all(np.isfinite(likelihoods)) or np.any(likelihoods < 0.0):
            raise ValueError("expected likelihoods that are finite and not negative")
        posterior = np.empty((len(self.networks), len(likelihoods), self.target_states))
        evidence = np.empty((len(self.networks), len(likelihoods)))
        run_schedule(
            likelihoods, self.buffer, self.steps, self.gates, self.factors, self.maps,
            self.networks, self.finals, self.target_likelihood, posterior, evidence,
        )  # fmt: skip
        if np.any(np.isneginf(evidence)):
            raise ValueError("the evidence has probability zero under the network")
        return posterior, evidence


_WITH_CHILDREN = 64.0


@dataclass(frozen=True, eq=False)
class _Factor:
    scope: tuple[int, ...]
    shape: tuple[int, ...]
    maker: int
    """The step whose message this is, -1: a table."""
    start: int

    def strides(self) -> dict[int, int]:
        """Return how far apart two states of each variable lie in the flat table."""
        steps = np.cumprod((1, *self.shape[::-1]))[:-1][::-1]
        return dict(zip(self.scope, (int(s) for s in steps), strict=True))


class _Compiler:
    """Collects the flat arrays while networks are eliminated one after the other."""

    def __init__(self) -> None:
        self.tables: list[Array] = []
        self.table_size = 0
        self.message_size = 0
        self.steps: list[list[int]] = []
        self.gates: list[list[int]] = []
        self.factors: list[list[int]] = []
        self.maps: list[Index] = []
        self.map_size = 0
        self.networks: list[list[int]] = []
        self.finals: list[list[int]] = []

    def add(self, network: DiscreteNetwork, target: int, starts: Index) -> None:
        """Eliminate all variables of a network but the target, cheapest message first."""
        states = network.states
        live: list[_Factor] = []
        for variable, (parents, table) in enumerate(
            zip(network.parents, network.tables, strict=True)
        ):
            live.append(_Factor((*parents, variable), table.shape, -1, self.table_size))
            self.tables.append(np.ascontiguousarray(table, dtype=np.float64).ravel())
            self.table_size += table.size
        first_step = len(self.steps)
        remaining = [v for v in range(len(states)) if v != target]
        while remaining:
            variable = min(remaining, key=lambda v: _cost(v, live, states))
            remaining.remove(variable)
            used = [f for f in live if variable in f.scope]
            live = [f for f in live if variable not in f.scope]
            live.append(self._eliminate(variable, used, states, starts, target))
        first_final = len(self.finals)
        for factor in live:
            stride = factor.strides().get(target, 0)
            self.finals.append([int(factor.maker >= 0), factor.start, stride])
        self.networks.append([first_step, len(self.steps), first_final, len(self.finals)])

    def _eliminate(
        self, variable: int, used: list[_Factor], states: tuple[int, ...], starts: Index,
        target: int,
    ) -> _Factor:  # fmt: skip
        largest = max(used, key=lambda f: len(f.scope))
        order = dict.fromkeys([*largest.scope, *(v for f in used for v in f.scope)])
        scope = tuple(v for v in order if v != variable)
        shape = tuple(states[v] for v in scope)
        size = int(np.prod(shape, dtype=np.int64))
        grid = np.indices(shape).reshape(len(shape), size) if shape else np.zeros((0, 1), np.int64)
        first = len(self.factors)
        for factor in used:
            strides = factor.strides()
            entries = np.zeros(size, dtype=np.int64)
            for position, other in enumerate(scope):
                entries += grid[position] * strides.get(other, 0)
            self.factors.append(
                [
                    int(factor.maker >= 0),
                    factor.start,
                    strides[variable],
                    self.map_size,
                    factor.maker,
                ]
            )
            self.maps.append(entries)
            self.map_size += size
        message = _Factor(scope, shape, len(self.steps), self.message_size)
        tables = [f.scope[-1] for f in used if f.maker < 0]
        first_gate = len(self.gates)
        for position, other in enumerate(scope):
            if other != target:
                self.gates.append([int(starts[other]), self.map_size])
                self.maps.append(grid[position].astype(np.int64))
                self.map_size += size
        self.steps.append([
            int(starts[variable]), states[variable], message.start, size, first, len(self.factors),
            first_gate, len(self.gates), int(tables == [variable]),
        ])  # fmt: skip
        self.message_size += size
        return message


def _cost(variable: int, live: Sequence[_Factor], states: tuple[int, ...]) -> float:
    """Return the entries that eliminating a variable takes; more where its children are left.

    From the leaves up, what is known narrows every message, and where nothing is known below a
    variable its message is all ones.
    """
    used = [f for f in live if variable in f.scope]
    scope = {v for f in used for v in f.scope}
    children = any(f.maker < 0 and f.scope[-1] != variable for f in used)
    return float(np.prod([states[v] for v in scope])) * (_WITH_CHILDREN if children else 1.0)


def compile_networks(
    networks: Sequence[DiscreteNetwork],
    target: str,
    starts: Sequence[Index],
) -> Schedule:
    """Return one schedule that answers p(target | evidence) in all the networks.

    Args:
        networks: G networks that contain the target with the same number of states.
        target: the variable asked for.
        starts: per network (V,): where the likelihoods of each of its variables begin in the shared
            vector; -1 only for the target (no evidence about it).

    Raises:
        ValueError: if the target's states differ or a variable has no likelihoods.
    """
    compiler = _Compiler()
    target_starts = []
    sizes = {network.states[network.names.index(target)] for network in networks}
    if len(sizes) != 1:
        raise ValueError(f"{target}: expected the same number of states everywhere, got {sizes}")
    for network, start in zip(networks, starts, strict=True):
        index = network.names.index(target)
        if any(s < 0 for v, s in enumerate(start) if v != index):
            raise ValueError("expected likelihoods for every variable but the target")
        compiler.add(network, index, start)
        target_starts.append(int(start[index]))
    steps = np.array(compiler.steps, dtype=np.int64).reshape(-1, 9)
    steps[:, 2] += compiler.table_size
    return Schedule(
        buffer=np.concatenate([*compiler.tables, np.zeros(compiler.message_size)]),
        steps=steps,
        gates=np.array(compiler.gates, dtype=np.int64).reshape(-1, 2),
        factors=_placed(compiler.factors, 5, compiler.table_size),
        maps=np.concatenate(compiler.maps) if compiler.maps else np.zeros(0, np.int64),
        networks=np.array(compiler.networks, dtype=np.int64),
        finals=_placed(compiler.finals, 3, compiler.table_size),
        target_states=sizes.pop(),
        target_likelihood=np.array(target_starts, dtype=np.int64),
    )


def _placed(rows: list[list[int]], width: int, tables: int) -> Index:
    """Return factor rows without their message flag, messages placed behind the tables."""
    table = np.array(rows, dtype=np.int64).reshape(-1, width)
    table[:, 1] += tables * table[:, 0]
    return np.ascontiguousarray(table[:, 1:])


def compile_single(network: DiscreteNetwork, target: str) -> Schedule:
    """Return the schedule of one network whose likelihood vector is its variables in order."""
    ends = np.cumsum(network.states)
    starts = (ends - np.array(network.states)).astype(np.int64)
    return compile_networks([network], target, [starts])
