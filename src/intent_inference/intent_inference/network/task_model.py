"""The learnt model: task-specific soft-quantised Bayesian networks, BN^H or BN^R (Sec. II, IV)."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from intent_inference.network.bayesian_network import DiscreteNetwork, Schedule, compile_networks
from intent_inference.network.conditional_tables import (
    DirichletPrior,
    soft_counts,
    table_from_counts,
)
from intent_inference.network.probability_calibration import OddsCalibration, sigmoid
from intent_inference.network.structure import TASK, Parents
from intent_inference.quantisation.feature_table import Features, count_rows, select_variables
from intent_inference.quantisation.quantiser import Quantiser
from intent_inference.quantisation.soft_evidence import EvidenceBank, SoftEvidence
from intent_inference.quantisation.variables import ACTION, OBJECT, OBJECT_CLASS
from intent_perception.basics.arrays import Array

_SURE = 1e-12


@dataclass(frozen=True, eq=False)
class Member:
    """One network of a task: structure, states and soft counts."""

    recipe: str
    """How it was made: structure and choice of states, e.g. "tan/information"."""
    parents: Parents
    """Variable to parents; TASK is the task, states 0 (not afforded) and 1."""
    keys: dict[str, str]
    """Variable to the key of its quantiser in the model; `obcl` to itself."""
    counts: dict[str, Array]
    """Variable to its family's soft counts."""
    prior: DirichletPrior

    def network(self) -> DiscreteNetwork:
        """Return the network with the tables that its counts give.

        The task itself is as likely as not: how often simulated grasps afford a task is no
        prior of people's intentions; that is a setting of whoever asks.
        """
        names = tuple(self.parents)
        index = {name: i for i, name in enumerate(names)}
        tables = {name: table_from_counts(self.counts[name], self.prior) for name in names}
        if not self.parents[TASK]:
            tables[TASK] = np.full(2, 0.5)
        return DiscreteNetwork(
            names,
            tuple(tuple(index[p] for p in self.parents[name]) for name in names),
            tuple(tables[name] for name in names),
        )

    def with_rows(
        self, assignments: dict[str, Array], task: Array, weights: Array | None = None
    ) -> "Member":
        """Return the member after more labelled rows: sequential updating by added counts.

        Args:
            assignments: quantiser key to (N, K) soft assignment.
            task: (N, 2) one-hot label.
            weights: (N,) weight of each row.
        """
        own = {v: assignments[key] for v, key in self.keys.items()}
        own[TASK] = task
        counts = {
            v: self.counts[v] + soft_counts(own, v, parents, weights)
            for v, parents in self.parents.items()
        }
        return replace(self, counts=counts)


@dataclass(frozen=True, eq=False)
class TaskNetworks:
    """The networks of one task and how their answers are joined."""

    task: str
    members: tuple[Member, ...]
    calibrations: tuple[OddsCalibration, ...]
    """One per set of observed variables; the nearest is used."""

    def calibration(self, observed: frozenset[str]) -> OddsCalibration:
        """Return the calibration whose set of observed variables differs least."""
        return min(self.calibrations, key=lambda c: len(observed ^ frozenset(c.observed)))


@dataclass(frozen=True, eq=False)
class TaskModel:
    """p(task | object, action, constraint features) for several tasks, each by its own networks."""

    classes: tuple[str, ...]
    """States of `obcl`."""
    variables: tuple[str, ...]
    """Variables of Table I that were there in training."""
    quantisers: dict[str, Quantiser]
    """Key to quantiser, shared by the tasks."""
    networks: tuple[TaskNetworks, ...]
    description: dict[str, str]
    """Origin: data, seed, counts."""
    compared: tuple[TaskNetworks, ...] = ()
    """Networks that take no part in the answers (evaluation); not saved."""

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks, the columns of `posterior`."""
        return tuple(n.task for n in self.networks)

    @cached_property
    def bank(self) -> EvidenceBank:
        """All quantisers, laid out for one pass."""
        return EvidenceBank(self.quantisers, self.classes)

    @cached_property
    def _members(self) -> tuple[Member, ...]:
        return tuple(member for networks in self.networks for member in networks.members)

    @cached_property
    def _schedules(self) -> dict[str, Schedule]:
        return {}

    @cached_property
    def _usage(self) -> Array:
        """(M, Q) 1 where a member uses a block of the evidence's `log_scale`."""
        used = [
            [float(key in set(m.keys.values())) for key in self.bank.keys] for m in self._members
        ]
        return np.array(used)

    def _schedule(self, target: str, members: tuple[int, ...] | None = None) -> Schedule:
        """Return the compiled schedule of all (or some) members for a target, made once."""
        name = target if members is None else f"{target} of {members}"
        if name not in self._schedules:
            chosen = self._members if members is None else [self._members[i] for i in members]
            networks = [member.network() for member in chosen]
            starts = []
            for member, network in zip(chosen, networks, strict=True):
                start = [self._start_of(member, v) for v in network.names]
                starts.append(np.array(start, dtype=np.int64))
            self._schedules[name] = compile_networks(networks, target, starts)
        return self._schedules[name]

    def _start_of(self, member: Member, variable: str) -> int:
        # Two more entries behind the bank's carry the evidence about the task itself.
        return self.bank.length if variable == TASK else self.bank.starts[member.keys[variable]]

    def evidence(self, features: Features, deviations: Features | None = None) -> SoftEvidence:
        """Return soft evidence of a feature table, widened by its standard deviations."""
        known = select_variables(features, self.variables)
        if not known:
            rows = count_rows(features)
            known = {OBJECT_CLASS: np.full(rows, "")}
        return self.bank.evidence(known, deviations)

    def _query(
        self, target: str, evidence: SoftEvidence, task_value: int | None = None,
        members: tuple[int, ...] | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Return posterior (M, N, K) and log p(evidence[, task = value]) (M, N) of each member."""
        length = self.bank.length
        likelihoods = np.ones((evidence.rows, length + 2))
        likelihoods[:, :length] = evidence.likelihoods
        if task_value is not None:
            likelihoods[:, length + 1 - task_value] = 0.0
        posterior, log_evidence = self._schedule(target, members).query(likelihoods)
        usage = self._usage if members is None else self._usage[list(members)]
        return posterior, log_evidence + usage @ evidence.log_scale.T

    @cached_property
    def _nearest(self) -> dict[tuple[str, frozenset[str]], OddsCalibration]:
        return {}

    def _calibration(self, networks: TaskNetworks, observed: frozenset[str]) -> OddsCalibration:
        """Return the nearest calibration of a task, remembered."""
        key = (networks.task, observed)
        if key not in self._nearest:
            self._nearest[key] = networks.calibration(observed)
        return self._nearest[key]

    def log_odds(self, evidence: SoftEvidence) -> list[Array]:
        """Return each task's (N, M) log-odds of its networks, not calibrated."""
        posterior, _ = self._query(TASK, evidence)
        odds = np.log(posterior[:, :, 1] + _SURE) - np.log(posterior[:, :, 0] + _SURE)
        result, first = [], 0
        for networks in self.networks:
            result.append(odds[first : first + len(networks.members)].T)
            first += len(networks.members)
        return result

    def calibrated_log_odds(
        self, evidence: SoftEvidence, log_odds: list[Array] | None = None
    ) -> Array:
        """Return calibrated log-odds of each task, (N, T), for a balanced prior.

        `log_odds` are those of another engine; default: of the compiled schedule.
        """
        odds = log_odds if log_odds is not None else self.log_odds(evidence)
        result = np.empty((evidence.rows, len(self.networks)))
        for observed, rows in evidence.patterns():
            for column, networks in enumerate(self.networks):
                if networks.calibrations:
                    calibration = self._calibration(networks, observed)
                    result[rows, column] = calibration.apply(odds[column][rows])
                else:
                    result[rows, column] = odds[column][rows].mean(axis=1)
        return result

    def posterior(self, features: Features, deviations: Features | None = None) -> Array:
        """Return p(task | observed features), (N, T), columns as `tasks` (Sec. IV-C)."""
        return sigmoid(self.calibrated_log_odds(self.evidence(features, deviations)))

    def log_evidence(self, features: Features, deviations: Features | None = None) -> Array:
        """Return log p(observed features), (N,), the mean over all networks; low: unknown."""
        evidence = self.evidence(features, deviations)
        return self.log_evidence_of(evidence)

    def log_evidence_of(self, evidence: SoftEvidence) -> Array:
        """Return log p(evidence), (N,), the mean over all networks."""
        _, log_evidence = self._query(TASK, evidence)
        mean: Array = log_evidence.mean(axis=0)
        return mean

    def _of_task(self, task: str) -> tuple[int, ...]:
        if task not in self.tasks:
            raise ValueError(f"expected one of the tasks {self.tasks}, got {task!r}")
        first = 0
        for networks in self.networks:
            if networks.task == task:
                break
            first += len(networks.members)
        return tuple(range(first, first + len(networks.members)))

    def _log_joint(self, task: str, features: Features) -> tuple[Array, Array]:
        """Return log p(evidence, task = 1) and log p(evidence) of the task's networks, (M, N)."""
        members = self._of_task(task)
        posterior, log_evidence = self._query(TASK, self.evidence(features), None, members)
        return log_evidence + np.log(posterior[:, :, 1] + 1e-300), log_evidence

    def object_score(self, task: str, objects: Features) -> Array:
        """Return log p(o | t) - log p(o) of objects, (N,), higher is better (o*, Sec. II-A).

        Args:
            task: the goal t*.
            objects: (N) objects; variables other than O are ignored.
        """
        joint, alone = self._log_joint(task, select_variables(objects, OBJECT))
        prior = self._log_joint(task, {OBJECT_CLASS: np.array([""])})[0]
        score: Array = (joint - alone - prior).mean(axis=0)
        return score

    def grasp_score(self, task: str, grasps: Features, relative: bool = False) -> Array:
        """Return log p(a, c | o, t) of grasp candidates, (N,) (a*, Sec. II-A).

        Args:
            task: the goal t*.
            grasps: N candidates: O variables are conditions, A and C variables are scored.
            relative: subtract log p(a, c | o): how much better than for no task at all.
        """
        conditions = select_variables(grasps, OBJECT) or {
            OBJECT_CLASS: np.full(count_rows(grasps), "")
        }
        joint, alone = self._log_joint(task, grasps)
        given, given_alone = self._log_joint(task, conditions)
        score: Array = (joint - given).mean(axis=0)
        if relative:
            score = score - (alone - given_alone).mean(axis=0)
        return score

    def states_given_task(self, task: str, variable: str, features: Features) -> tuple[int, Array]:
        """Return p(variable's state | features, task) of the task's first network that has it.

        Returns:
            The member's index and the probabilities (K,) for the first row of the features.
        """
        for index in self._of_task(task):
            member = self._members[index]
            if variable in member.keys:
                others = {n: v for n, v in features.items() if n != variable}
                others = others or {OBJECT_CLASS: np.array([""])}
                evidence = self.evidence(others)
                posterior, _ = self._query(variable, evidence, 1, (index,))
                return index, posterior[0, 0]
        raise ValueError(f"expected a variable of {task}'s networks, got {variable!r}")

    def defuzzify(
        self, task: str, features: Features, variable: str, method: str = "component"
    ) -> Array:
        """Return a value (D,) of a variable for a task: Sec. II-C.

        Args:
            task: the goal.
            features: one row of what is known.
            variable: continuous variable of Table I to infer.
            method: "component": the likeliest centre of Eq. (2), on the manifold; "expected":
                Eq. (3), which averages modes and can leave the manifold (npos shorter than 1).
        """
        index, states = self.states_given_task(task, variable, features)
        quantiser = self.quantisers[self._members[index].keys[variable]]
        if method == "component":
            return np.asarray(quantiser.values_of(quantiser.mixture.likeliest(states)[None])[0])
        if method == "expected":
            mean = quantiser.mixture.expected(states)[None]
            return np.asarray(quantiser.standardisation.invert(mean)[0])
        raise ValueError(f"method: expected component or expected, got {method!r}")

    def sample(
        self, task: str, features: Features, count: int, rng: np.random.Generator,
        variables: tuple[str, ...] = ACTION,
    ) -> Features:  # fmt: skip
        """Return values drawn from p(a | o, t) by Eq. (2), on the manifold.

        Variables are drawn one after the other, each given those before it.

        Args:
            task: the goal.
            features: one row of what is known, e.g. the object.
            count: number of draws.
            rng: source of randomness.
            variables: continuous variables to draw.
        """
        drawn: dict[str, list[Array]] = {name: [] for name in variables if name in self.variables}
        for _ in range(count):
            known = {name: values[:1] for name, values in features.items()}
            for name in drawn:
                index, states = self.states_given_task(task, name, known)
                quantiser = self.quantisers[self._members[index].keys[name]]
                value = quantiser.values_of(quantiser.mixture.sample(states, 1, rng))
                known[name] = value
                drawn[name].append(value[0])
        return {name: np.stack(values) for name, values in drawn.items()}
