"""Dynamic Bayesian network task -> kind of motion -> phase -> measures, and forward filtering.

A task is done in one of several kinds of motion (tool-use: strike, cut, turn); each kind goes
through steps, of which phases consist; in a step each measure has its own distribution over cells.
Frames are alike, so a frame's evidence counts for as much of an independent look as it lasts
(`weight` per second).
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from intent_inference import SHARE
from intent_inference.motion.measures import MEASURES, STATES, shares
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays

PHASES = ("GRASP", "TRANSPORT", "ACT", "PUT_BACK")
"""Phases of a held object; REACH comes before."""
STEPS = {"GRASP": "GRASP", "HOLD": "TRANSPORT", "CARRY": "TRANSPORT", "ACT": "ACT",
         "BACK": "PUT_BACK"}  # fmt: skip
"""Steps of a held object to the phase that each is part of. HOLD: lifted a little and held, as
people do who take a firmer grip or wait; neither that nor rest in the hand tells of the task."""
NOTHING = "none of these"
"""The last of the meanings: the person does something that is no task of the model."""
MOTION_FILE = SHARE / "models" / "motion.npz"
RATE = 30.0
"""Frames per second that the transitions are learned for."""
_PHASE_OF = np.array([[float(own == phase) for phase in PHASES] for own in STEPS.values()])
_LEAST = 1e-6
_VERSION = 2


@dataclass(frozen=True, eq=False)
class MotionNetwork:
    """Tables of the network."""

    kinds: tuple[str, ...]
    """G kinds of motion."""
    tasks: tuple[str, ...]
    """(G,) the task that each kind does; `NOTHING` for those that do none."""
    priors: Array
    """(G,) p(kind | task): how often a task is done so."""
    transitions: Array
    """(G, S, S) p(step in the next frame | step), of each kind."""
    emissions: Array
    """(M, G, S, STATES) p(cell | kind, step) of each measure."""
    weight: float
    """Independent looks per second."""

    def __post_init__(self) -> None:
        """Refuse tables of other shapes or that are no probabilities."""
        g, p = len(self.kinds), len(STEPS)
        if len(self.tasks) != g or self.transitions.shape != (g, p, p):
            raise ValueError(f"expected transitions ({g}, {p}, {p}), got {self.transitions.shape}")
        same = np.equal.outer(self.tasks, self.tasks)
        if self.priors.shape != (g,) or not np.allclose(same @ self.priors, 1.0, atol=1e-6):
            raise ValueError(f"expected priors ({g},) that sum to one for each task")
        if self.emissions.shape != (len(MEASURES), g, p, STATES):
            raise ValueError(
                f"expected emissions ({len(MEASURES)}, {g}, {p}, {STATES}), "
                f"got {self.emissions.shape}"
            )
        for table in (self.transitions, self.emissions):
            if np.any(table < 0.0) or not np.allclose(table.sum(axis=-1), 1.0, atol=1e-6):
                raise ValueError("expected tables of probabilities that sum to one")
        if not 0.0 < self.weight <= RATE:
            raise ValueError(f"expected a weight in 0..{RATE}, got {self.weight}")

    def log_likelihood(self, measures: Array) -> Array:
        """Return log p(measures | kind, step) of one frame, (M, G, S), each measure apart."""
        cells = shares(measures)
        seen = cells.sum(axis=1)[:, None, None]
        likelihood = (self.emissions @ cells[:, None, :, None])[..., 0]
        return np.where(seen > 0.0, np.log(np.maximum(likelihood, _LEAST)), 0.0)

    def save(self, path: Path) -> None:
        """Write the network to an NPZ file."""
        write_arrays(
            path,
            {
                "version": np.array(_VERSION), "kinds": np.array(self.kinds),
                "tasks": np.array(self.tasks), "priors": self.priors,
                "transitions": self.transitions,
                "emissions": self.emissions.astype(np.float32), "weight": np.array(self.weight),
            },
        )  # fmt: skip

    @classmethod
    def load(cls, path: Path) -> "MotionNetwork":
        """Return the network of a file.

        Raises:
            ValueError: if the file is no motion network.
        """
        arrays = read_arrays(path, "motion network")
        wanted = {"version", "kinds", "tasks", "priors", "transitions", "emissions", "weight"}
        if missing := sorted(wanted - set(arrays)):
            raise ValueError(f"{path}: expected a motion network, {', '.join(missing)} missing")
        if int(arrays["version"]) != _VERSION:
            raise ValueError(f"{path}: expected version {_VERSION} of the motion network")
        emissions = arrays["emissions"].astype(np.float64)
        return cls(
            tuple(map(str, arrays["kinds"])), tuple(map(str, arrays["tasks"])),
            arrays["priors"].astype(np.float64), arrays["transitions"].astype(np.float64),
            emissions / emissions.sum(axis=-1, keepdims=True), float(arrays["weight"]),
        )  # fmt: skip


@lru_cache(maxsize=1)
def shipped_motion() -> MotionNetwork:
    """Return the shipped network of motions."""
    return MotionNetwork.load(MOTION_FILE)


class MotionFilter:
    """Forward filter over kind and step while one object is held."""

    def __init__(self, network: MotionNetwork, tasks: tuple[str, ...]) -> None:
        """Begin before any motion is seen.

        Args:
            network: of motions.
            tasks: T tasks that are asked for; `log_odds` answers for these and, last, `NOTHING`.
        """
        self._network = network
        self._meanings = (*tasks, NOTHING)
        own = np.array([[task == meaning for task in network.tasks] for meaning in self._meanings])
        # A task that no motion is known for, and kinds of tasks that nobody asks for, say nothing.
        own[~own.any(axis=1)] = True
        weights = own * network.priors
        self._own = weights / weights.sum(axis=1, keepdims=True)
        """(T + 1, G) p(kind | meaning)."""
        start = np.zeros((len(network.kinds), len(STEPS)))
        start[:, 0] = 1.0
        self._belief = start
        """(G, S) p(step | kind, frames so far)."""
        self._scores = np.zeros(len(network.kinds))
        self._moved = np.zeros((len(MEASURES), len(network.kinds)))
        self._last: float | None = None

    def step(self, second: float, measures: Array) -> None:
        """Take in the measures (M,) of one more frame at a stamp [s]."""
        elapsed = 1.0 / RATE if self._last is None else max(0.0, second - self._last)
        self._last = second
        for _ in range(min(8, round(elapsed * RATE))):
            self._belief = np.einsum("gp,gpq->gq", self._belief, self._network.transitions)
        each = self._network.log_likelihood(measures)
        share = self._network.weight * min(elapsed, 0.2)
        joint = np.log(np.maximum(self._belief, 1e-12)) + share * each.sum(axis=0)
        top = joint.max(axis=1, keepdims=True)
        scale = np.exp(joint - top)
        total = scale.sum(axis=1)
        self._belief = scale / total[:, None]
        self._scores += top[:, 0] + np.log(total)
        self._moved += share * np.einsum("mgp,gp->mg", each, self._belief)

    @property
    def log_evidence(self) -> Array:
        """(T + 1,) log p(motion | task) up to a constant."""
        return self._by_meaning(self._scores)

    @property
    def steps(self) -> Array:
        """(G, S) p(step | kind, motion so far)."""
        return self._belief

    def phases(self, meaning: Array) -> Array:
        """Return p(phase) (P,) where the meanings have probabilities (T + 1,)."""
        weights = np.exp(self._scores - self._scores.max())[None] * self._own
        weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
        return np.asarray((meaning @ weights) @ self._belief @ _PHASE_OF)

    def moved(self) -> dict[str, Array]:
        """Return by measure how far it moved the log-odds (T + 1,) of each meaning so far."""
        found = {}
        for row, name in enumerate(MEASURES):
            means = self._by_meaning(self._moved[row])
            found[name] = means - np.log(np.mean(np.exp(means - means.max()))) - means.max()
        return found

    def _by_meaning(self, scores: Array) -> Array:
        top = float(scores.max())
        weights = np.exp(scores - top)
        return np.asarray(np.log(np.maximum(self._own @ weights, 1e-300)) + top)
