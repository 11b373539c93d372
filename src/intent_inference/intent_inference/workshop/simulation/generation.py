"""Simulated grasps of one object: candidates, the choice of which to shake, the shake test."""

import copy
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from intent_inference.grasping.autograsp import Fate
from intent_inference.grasping.contacts import Contacts
from intent_inference.grasping.grasp_candidates import CandidateSource, FilterConfig, TriedGrasp
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.comfort import Comfort
from intent_inference.workshop.simulation.labels import (
    TASKS,
    label_grasp,
    load_rules,
    pointing_tasks,
)
from intent_inference.workshop.simulation.simulated_grasp import SimulatedGrasp
from intent_inference.workshop.simulation.stability import ShakeConfig, ShakenGrasp, ShakeTest
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.objects.database import ObjectModel

_ON_HANDLE = "on the handle"
_LEAST_COMFORT = 0.1
"""Weight of a grasp that nobody finds comfortable: people take things so now and then."""
_TASK_WEIGHT = 2.0
"""How much more a missing task counts than a missing pre-shape."""


@dataclass(frozen=True)
class GenerationConfig(Checked):
    """How grasps of one object are generated."""

    wanted: int = 80
    """Grasps of an object that shall hold, 1..100000."""
    task_share: float = 0.5
    """Share of them that shall afford each task that the object is good for, 0..1."""
    preshape_share: float = 0.10
    """Share that shall use each pre-shape other than power, 0..1."""
    handle_share: float = 0.35
    """Share that shall hold a vessel by its handle, 0..1."""
    per_round: int = 60
    """Candidates that are looked at before some of them are shaken, 1..10000."""
    shaken_per_round: int = 12
    """Candidates shaken in a round, 1..10000."""
    tries_per_round: int = 1600
    """Hypotheses tried in a round at most, 1..1000000."""
    unguided: float = 0.15
    """Share of the shaken candidates that are drawn at random, whatever they might afford, 0..1."""
    favored: float = 0.7
    """Share of the hypotheses drawn from approaches that gave what is still missing, 0..1."""
    shake: ShakeConfig = field(default_factory=ShakeConfig)
    filter: FilterConfig = field(default_factory=FilterConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.shaken_per_round <= self.per_round <= self.tries_per_round:
            raise ValueError(f"expected shaken <= looked at <= tried per round, got {self}")


class Needs:
    """How many accepted grasps have each trait (task, pre-shape, handle), and what is missing."""

    def __init__(self, hand: GraspingHand, config: GenerationConfig) -> None:
        self._quotas = dict.fromkeys(TASKS, config.task_share * config.wanted)
        for preshape in hand.preshapes:
            if preshape.name != "power":
                self._quotas[preshape.name] = config.preshape_share * config.wanted
        self._quotas[_ON_HANDLE] = config.handle_share * config.wanted
        self.traits = tuple(self._quotas)
        self.weights = np.array([_TASK_WEIGHT if t in TASKS else 1.0 for t in self.traits])
        self._counts: Counter[str] = Counter()

    def add(self, traits: Iterable[str]) -> None:
        """Count one accepted grasp."""
        self._counts.update(traits)

    def missing(self) -> Array:
        """Return the missing share (T,) of each trait, in the order of `traits`."""
        quotas = np.array([self._quotas[trait] for trait in self.traits])
        counts = np.array([self._counts[trait] for trait in self.traits])
        return np.asarray(np.clip(1.0 - counts / quotas, 0.0, 1.0))

    def copy(self) -> "Needs":
        """Return needs that can be counted on without changing these."""
        other = copy.copy(self)
        other._counts = Counter(self._counts)
        return other


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
        self._comfort = Comfort(target.model.stable_poses, rng) if hand.is_human else None
        self._needs = Needs(hand, self._config)
        self._found = np.zeros((len(self._source.draws), len(self._needs.traits)))
        self._shakes: Counter[tuple[str, bool]] = Counter()
        self._aim = ""
        self.seconds = dict.fromkeys(("try", "choose", "shake"), 0.0)

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
            self._shakes[grasp.preshape, grasp.held] += 1
            if grasp.held:
                pose, joints = grasp.T_object_hand, grasp.joints
                self._needs.add(self._traits(grasp.preshape, pose, joints, grasp.contacts))

    def warm_up(self) -> None:
        """Prepare what the first try needs: distance field, boxes, compiled kernels."""
        self._source.take(1, 20)
        self.fates.clear()

    def round(self, shake_all: bool = False) -> list[SimulatedGrasp]:
        """Return the next grasps, held or lost; none if no candidate was found."""
        config = self._config
        start = time.process_time()
        self._aim = self._missing_task()
        wanted = None if shake_all or not self._aim else self._suits
        candidates = self._source.take(config.per_round, config.tries_per_round, wanted)
        tried = time.process_time()
        chosen = candidates if shake_all else self._choose(candidates)
        labelled = time.process_time()
        grasps = [self._shaken(candidate) for candidate in chosen]
        self.seconds["try"] += tried - start
        self.seconds["choose"] += labelled - tried
        self.seconds["shake"] += time.process_time() - labelled
        return grasps

    def _missing_task(self) -> str:
        """Return a task to aim at, drawn by what is missing of those that the class affords."""
        kind, rules = self.target.model.object_class, load_rules()
        missing = dict(zip(self._needs.traits, self._needs.missing(), strict=True))
        wanted = {t: missing[t] for t in TASKS[1:] if kind in rules[t]["classes"]}
        total = sum(wanted.values())
        if total == 0.0:
            return ""
        return str(self._rng.choice(list(wanted), p=[share / total for share in wanted.values()]))

    def _suits(self, hypothesis: GraspHypothesis) -> bool:
        """Return whether a hypothesis might afford the task aimed at.

        It has the task's orientation; a tool is also aimed at by its handle.
        """
        pose = hypothesis.T_object_hand
        if not pointing_tasks(self.target, self.hand, pose, (self._aim,)):
            return False
        functions, aim = self.target.model.functions, hypothesis.target
        if functions is None or functions.opening is not None or aim is None:
            return True
        return self.target.on_handle(aim)

    def _choose(self, candidates: list[TriedGrasp]) -> list[TriedGrasp]:
        """Return the candidates that are worth a shake: those with the traits most missed."""
        config, traits = self._config, self._needs.traits
        having = np.zeros((len(candidates), len(traits)))
        for row, candidate in zip(having, candidates, strict=True):
            grasp = candidate.grasp
            found = self._traits(
                grasp.preshape, grasp.T_object_hand, grasp.joints, candidate.contacts
            )
            row[[traits.index(trait) for trait in found]] = 1.0
            self._found[candidate.approach] += row
        left = list(self._rng.permutation(len(candidates)))
        chosen = [
            left.pop() for _ in range(round(config.unguided * config.shaken_per_round)) if left
        ]
        planned = self._needs.copy()
        chances = np.array([self._chance(c.grasp.preshape) * self._ease(c) for c in candidates])
        while left and len(chosen) < config.shaken_per_round:
            worth = chances[left] * (having[left] @ (planned.missing() * self._needs.weights))
            chosen.append(left.pop(int(np.argmax(worth))))
            planned.add(np.array(traits)[having[chosen[-1]] > 0])
        if self._source.sampler is not None:
            rate = self._found / (self._source.draws[:, None] + 5.0)
            self._source.sampler.favor(rate @ self._needs.missing(), config.favored)
        return [candidates[index] for index in chosen]

    def _chance(self, preshape: str) -> float:
        """Return how often a pre-shape has held this object so far."""
        held, lost = self._shakes[preshape, True], self._shakes[preshape, False]
        return (held + 2.0) / (held + lost + 2.0)

    def _ease(self, candidate: TriedGrasp) -> float:
        """Return how comfortable a person's grasp is, 0..1; 1 for a robot's."""
        if self._comfort is None:
            return 1.0
        return max(_LEAST_COMFORT, self._comfort.of(candidate.grasp.T_object_hand))

    def _traits(
        self, preshape: str, T_object_hand: Array, joints: Array, contacts: Contacts
    ) -> list[str]:
        """Return what a grasp would count for: afforded tasks, pre-shape, hold on a handle."""
        labels = label_grasp(
            self.target, self.hand, T_object_hand, joints, contacts, with_forces=False
        )
        traits = [task for task in TASKS if labels[task].afforded]
        if preshape in self._needs.traits:
            traits.append(preshape)
        functions = self.target.model.functions
        share = self.target.handle_share(contacts)
        if functions is not None and functions.opening is not None and (share or 0.0) > 0.5:
            traits.append(_ON_HANDLE)
        return traits

    def _shaken(self, candidate: TriedGrasp) -> SimulatedGrasp:
        grasp = candidate.grasp
        result = self._test.run(grasp)
        self.fates[Fate.NOT_SHAKEN] -= 1
        self._shakes[grasp.preshape, result.held] += 1
        self.fates[Fate.ACCEPTED if result.held else Fate.SHAKEN_OFF] += 1
        if result.held:
            pose, joints = result.T_object_hand, result.joints
            self._needs.add(self._traits(grasp.preshape, pose, joints, result.contacts))
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
    config = replace(config or GenerationConfig(), wanted=count)
    with GraspGenerator(TaskObject(model), hand, rng, config) as generator:
        for _ in range(most_rounds):
            held += [grasp for grasp in generator.round() if grasp.held]
            if len(held) >= count or generator.fates.total() == 0:
                break
    return tuple(held[:count])


def _simulated(name: str, candidate: TriedGrasp, result: ShakenGrasp) -> SimulatedGrasp:
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
