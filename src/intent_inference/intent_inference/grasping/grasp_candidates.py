"""Tries grasps until enough pass the static filter: closed, opposed, able to hold the weight."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from intent_inference.grasping.autograsp import ClosedGrasp, Fate, close_hand
from intent_inference.grasping.contacts import Contacts, gravity_residual, opposed, touching
from intent_inference.grasping.grasp_hypotheses import (
    GraspHypothesis,
    HypothesisConfig,
    HypothesisSampler,
    approaches,
    rim_approaches,
)
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_perception.basics.parameters import Checked

_WANTED_SHARE, _REDRAWS = 0.6, 25


@dataclass(frozen=True)
class FilterConfig(Checked):
    """What a closed grasp must show before it is shaken."""

    residual: float = 0.25
    """Largest share of the weight, from any side, that the contacts may fail to hold, 0..0.99."""
    friction: float = 0.5
    """Coulomb coefficient, below the real one: what needs all friction does not survive;
    0.001..10."""


@dataclass(frozen=True, eq=False)
class TriedGrasp:
    """A grasp that passed the static filter."""

    hypothesis: GraspHypothesis
    grasp: ClosedGrasp
    contacts: Contacts
    residual: float
    approach: int
    """Index of the approach that it came from."""


@dataclass(eq=False)
class CandidateSource:
    """Endless candidates of one hand on one object, and what became of all tries."""

    target: TaskObject
    hand: GraspingHand
    rng: np.random.Generator
    filter: FilterConfig = field(default_factory=FilterConfig)
    spread: HypothesisConfig = field(default_factory=HypothesisConfig)
    fates: Counter[Fate] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        choices = [
            choice
            for choice in approaches(self.target.geometry.boxes, self.hand)
            if choice.preshape.place != "loop" or self.target.is_loop(choice.box)
        ]
        functions = self.target.model.functions
        if functions is not None and functions.opening is not None:
            choices += rim_approaches(functions.opening, self.hand)
        self.sampler: HypothesisSampler | None = None
        self.draws = np.zeros(len(choices))
        self._limits = [choice.preshape.residual or self.filter.residual for choice in choices]
        if choices:
            self.sampler = HypothesisSampler(
                choices,
                self.hand,
                self.target.extent,
                self.target.center_of_mass,
                self.rng,
                self.spread,
            )

    @property
    def tried(self) -> int:
        """Number of hypotheses tried so far."""
        return sum(self.fates.values())

    def take(
        self, count: int, most_tries: int, wanted: Callable[[GraspHypothesis], bool] | None = None
    ) -> list[TriedGrasp]:
        """Return up to `count` candidates after at most `most_tries` tries.

        Args:
            count: candidates.
            most_tries: hypotheses tried at most.
            wanted: part of the hypotheses are drawn anew, a few times, until this accepts them.
        """
        found: list[TriedGrasp] = []
        if self.sampler is None:
            return found
        for _ in range(most_tries):
            approach, hypothesis = self.sampler.draw()
            if wanted is not None and self.rng.random() < _WANTED_SHARE:
                for _ in range(_REDRAWS):
                    if wanted(hypothesis):
                        break
                    approach, hypothesis = self.sampler.draw()
            self.draws[approach] += 1
            fate, candidate = self._examine(approach, hypothesis)
            self.fates[fate] += 1
            if candidate is not None:
                found.append(candidate)
                if len(found) == count:
                    break
        return found

    def _examine(
        self, approach: int, hypothesis: GraspHypothesis
    ) -> tuple[Fate, TriedGrasp | None]:
        fate, grasp = close_hand(self.hand, self.target.field, hypothesis)
        if grasp is None:
            return fate, None
        contacts = touching(self.hand, self.target.field, grasp.spheres, grasp.clearance)
        if len(contacts.points) < 2 or not opposed(self.hand, contacts):
            return Fate.NO_OPPOSITION, None
        residual = gravity_residual(
            contacts,
            self.target.center_of_mass,
            self.target.reach,
            self.filter.friction,
            self.target.weight,
            self._limits[approach],
            self.hand.strength,
        )
        if residual > self._limits[approach]:
            return Fate.UNSTABLE, None
        return Fate.NOT_SHAKEN, TriedGrasp(hypothesis, grasp, contacts, residual, approach)
