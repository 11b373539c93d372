"""Simulated grasps of one object: candidates, the choice of which to shake, the shake test."""

import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from intent_inference.simulation.autograsp import Fate
from intent_inference.simulation.candidates import Candidate, CandidateSource, FilterConfig
from intent_inference.simulation.contacts import Contacts
from intent_inference.simulation.grasping_hand import GraspingHand
from intent_inference.simulation.labels import TASKS, label_grasp
from intent_inference.simulation.simulated_grasp import SimulatedGrasp
from intent_inference.simulation.stability import ShakeConfig, ShakenGrasp, ShakeTest
from intent_inference.simulation.task_object import TaskObject
from intent_perception.objects import ObjectModel


@dataclass(frozen=True)
class GenerationConfig:
    """How grasps of one object are generated."""

    per_round: int = 40
    """Candidates that are looked at before some of them are shaken."""
    shaken_per_round: int = 12
    """Candidates shaken in a round."""
    tries_per_round: int = 1500
    """Hypotheses tried in a round at most."""
    unguided: float = 0.25
    """Share of the shaken candidates that are drawn at random, whatever they might afford."""
    shake: ShakeConfig = field(default_factory=ShakeConfig)
    filter: FilterConfig = field(default_factory=FilterConfig)

    def __post_init__(self) -> None:
        if not 0 < self.shaken_per_round <= self.per_round <= self.tries_per_round:
            raise ValueError(f"expected shaken <= looked at <= tried per round, got {self}")


@dataclass(eq=False)
class Tally:
    """How many accepted grasps afford each task and use each pre-shape."""

    tasks: Counter[str] = field(default_factory=Counter)
    preshapes: Counter[str] = field(default_factory=Counter)

    def add(self, preshape: str, afforded: tuple[str, ...]) -> None:
        """Count one accepted grasp."""
        self.preshapes[preshape] += 1
        self.tasks.update(afforded)

    def worth(self, preshape: str, afforded: tuple[str, ...]) -> float:
        """Return how much a grasp would add: rare tasks and rare pre-shapes count most."""
        rare_tasks = sum(1.0 / (1.0 + self.tasks[task]) for task in afforded)
        return rare_tasks + 1.0 / (4.0 + self.preshapes[preshape])


class GraspGenerator:
    """Generates grasps of one object; a context manager (it owns physics engines)."""

    def __init__(
        self,
        target: TaskObject,
        hand: GraspingHand,
        rng: np.random.Generator,
        config: GenerationConfig | None = None,
    ) -> None:
        self.target, self.hand, self._rng = target, hand, rng
        self._config = config or GenerationConfig()
        self._source = CandidateSource(target, hand, rng, self._config.filter)
        self._test = ShakeTest(hand, target.model, self._config.shake)
        self._tally = Tally()
        self.seconds: Counter[str] = Counter()

    def __enter__(self) -> "GraspGenerator":
        return self

    def __exit__(self, *error: object) -> None:
        self._test.__exit__(*error)

    @property
    def fates(self) -> Counter[Fate]:
        """What became of all tries so far."""
        return self._source.fates

    def remember(self, grasps: Iterable[SimulatedGrasp]) -> None:
        """Count grasps of an earlier run, so that the choice goes on where it stopped."""
        for grasp in grasps:
            if grasp.held:
                labels = label_grasp(
                    self.target,
                    self.hand,
                    grasp.T_object_hand,
                    grasp.joints,
                    grasp.contacts,
                    with_forces=False,
                )
                self._tally.add(grasp.preshape, tuple(t for t in TASKS if labels[t].afforded))

    def round(self, shake_all: bool = False) -> list[SimulatedGrasp]:
        """Return the next grasps, held or lost; none if no candidate was found."""
        config = self._config
        start = time.process_time()
        candidates = self._source.take(config.per_round, config.tries_per_round)
        tried = time.process_time()
        chosen = candidates if shake_all else self._choose(candidates)
        labelled = time.process_time()
        grasps = [self._shaken(candidate) for candidate in chosen]
        self.seconds["try"] += tried - start
        self.seconds["choose"] += labelled - tried
        self.seconds["shake"] += time.process_time() - labelled
        return grasps

    def _choose(self, candidates: list[Candidate]) -> list[Candidate]:
        """Return the candidates that are worth a shake, most valuable ones by their quick labels."""
        config = self._config
        free = round(config.unguided * config.shaken_per_round)
        order = self._rng.permutation(len(candidates))
        chosen = [candidates[index] for index in order[:free]]
        rest = [candidates[index] for index in order[free:]]
        afforded = [self._afforded(candidate) for candidate in rest]
        planned = Tally(Counter(self._tally.tasks), Counter(self._tally.preshapes))
        while rest and len(chosen) < config.shaken_per_round:
            worth = [
                planned.worth(c.grasp.preshape, a) for c, a in zip(rest, afforded, strict=True)
            ]
            best = int(np.argmax(worth))
            chosen.append(rest.pop(best))
            planned.add(chosen[-1].grasp.preshape, afforded.pop(best))
        return chosen

    def _afforded(self, candidate: Candidate) -> tuple[str, ...]:
        labels = label_grasp(
            self.target,
            self.hand,
            candidate.grasp.T_object_hand,
            candidate.grasp.joints,
            candidate.contacts,
            with_forces=False,
        )
        return tuple(task for task in TASKS if labels[task].afforded)

    def _shaken(self, candidate: Candidate) -> SimulatedGrasp:
        result = self._test.run(candidate.grasp)
        self.fates[Fate.NOT_SHAKEN] -= 1
        self.fates[Fate.ACCEPTED if result.held else Fate.SHAKEN_OFF] += 1
        if result.held:
            self._tally.add(candidate.grasp.preshape, self._afforded(candidate))
        return _simulated(self.target.model.name, candidate, result)


def plan_grasps(
    model: ObjectModel,
    hand: GraspingHand,
    rng: np.random.Generator,
    count: int,
    config: GenerationConfig | None = None,
    most_rounds: int = 40,
) -> tuple[SimulatedGrasp, ...]:
    """Return up to `count` grasps of an object that passed the static filter and the shake.

    Args:
        model: an object with volume.
        hand: the hand.
        rng: source of the hypotheses.
        count: grasps wanted.
        config: see `GenerationConfig`.
        most_rounds: after this many rounds fewer grasps are returned.

    Raises:
        ValueError: if the mesh encloses no volume or is in the wrong unit.
    """
    held: list[SimulatedGrasp] = []
    with GraspGenerator(TaskObject(model), hand, rng, config) as generator:
        for _ in range(most_rounds):
            held += [grasp for grasp in generator.round() if grasp.held]
            if len(held) >= count or generator.fates.total() == 0:
                break
    return tuple(held[:count])


def _simulated(name: str, candidate: Candidate, result: ShakenGrasp) -> SimulatedGrasp:
    contacts = result.contacts
    return SimulatedGrasp(
        name,
        candidate.grasp.preshape,
        result.T_object_hand,
        result.joints,
        Contacts(contacts.points, contacts.normals, contacts.links, contacts.forces),
        result.held,
        result.stability,
        result.penetration,
        candidate.residual,
        candidate.hypothesis.joints,
        candidate.hypothesis.approach,
    )
