"""The motion network learned from simulated motions, and how well it tells others of them."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np

from intent_inference.motion.measures import CELLS, MEASURES, STATES, shares
from intent_inference.motion.motion_network import (
    NOTHING,
    RATE,
    STEPS,
    MotionFilter,
    MotionNetwork,
)
from intent_inference.workshop.acting.held_motions import (
    GRASP,
    HOLD,
    KINDS,
    OFTEN,
    Motion,
    held_motion,
)
from intent_perception.basics.arrays import Array

_LIFT = 0.02
"""Height at which an object has left the table [m]."""
_PSEUDO = 1.0
"""Of each cell, in frames."""


def learned_motion(per_kind: int, rng: np.random.Generator) -> MotionNetwork:
    """Return the network of so many simulated motions per kind, its weight calibrated on others."""
    motions = [held_motion(kind, rng) for kind in KINDS for _ in range(per_kind)]
    network = network_of(motions, weight=4.0)
    fresh = [held_motion(kind, rng) for kind in KINDS for _ in range(max(8, per_kind // 4))]
    weights = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 9.0)
    losses = [log_loss(replace(network, weight=weight), fresh) for weight in weights]
    return replace(network, weight=weights[int(np.argmin(losses))])


def network_of(motions: list[Motion], weight: float) -> MotionNetwork:
    """Return the network that soft counts of labelled motions give.

    What rests in the hand or is held where it was lifted to says nothing of what is meant, so all
    kinds share the distributions and the end of these steps: else chance and layout would count
    again in every still frame.
    """
    tasks = {_component(motion): KINDS[motion.kind][0] for motion in motions}
    kinds = tuple(tasks)
    moves = np.full((len(kinds), len(STEPS), len(STEPS)), 1e-3)
    moves += 0.5 * np.eye(len(STEPS))
    counts = np.zeros((len(MEASURES), len(kinds), len(STEPS), STATES))
    for row, cells in enumerate(CELLS):
        counts[row, :, :, :cells] = _PSEUDO
    for motion in motions:
        kind = kinds.index(_component(motion))
        for before, after in pairwise(motion.steps):
            moves[kind, before, after] += 1.0
        for step, measures in zip(motion.steps, motion.measures(), strict=True):
            counts[:, kind, step] += shares(measures)
    still = [GRASP, HOLD]
    moves[:, still] = moves[:, still].mean(axis=0)
    counts[:, :, still] = counts[:, :, still].mean(axis=1, keepdims=True)
    return MotionNetwork(
        kinds, tuple(tasks.values()), _priors(motions, tasks),
        moves / moves.sum(axis=2, keepdims=True), counts / counts.sum(axis=3, keepdims=True),
        weight,
    )  # fmt: skip


def _priors(motions: list[Motion], tasks: dict[str, str]) -> Array:
    """Return p(component | task): how often its kind is, and its manner within the kind."""
    made = Counter(map(_component, motions))
    kinds = Counter(motion.kind for motion in motions)
    of = {_component(motion): motion.kind for motion in motions}
    often = {own: OFTEN.get(of[own], 1.0) * made[own] / kinds[of[own]] for own in tasks}
    whole: dict[str, float] = {}
    for own, task in tasks.items():
        whole[task] = whole.get(task, 0.0) + often[own]
    return np.array([often[own] / whole[task] for own, task in tasks.items()])


def _component(motion: Motion) -> str:
    return f"{motion.kind} ({motion.manner})"


def beliefs(
    network: MotionNetwork, motion: Motion, looks: tuple[float, ...]
) -> tuple[tuple[str, ...], Array]:
    """Return the meanings and p(meaning) (L, T + 1) at each look.

    Args:
        network: of motions.
        motion: that is watched.
        looks: L times after the first lift [s], ascending.
    """
    tasks = tuple(dict.fromkeys(task for task in network.tasks if task != NOTHING))
    own, found, done = MotionFilter(network, tasks), [], 0
    heights = motion.poses[:, 2, 3] - motion.poses[0, 2, 3]
    lifted, measures = int(np.argmax(heights > _LIFT)), motion.measures()
    for look in looks:
        end = lifted + round(look * RATE) + 1
        for frame, row in enumerate(measures[done:end], start=done):
            own.step(frame / RATE, row)
        done = end
        log_odds = own.log_evidence
        chance = np.exp(log_odds - log_odds.max())
        found.append(chance / chance.sum())
    return (*tasks, NOTHING), np.array(found)


def log_loss(network: MotionNetwork, motions: list[Motion]) -> float:
    """Return the mean -log p(true meaning), half a second and one second after lift-off."""
    losses = []
    for motion in motions:
        meanings, chances = beliefs(network, motion, (0.5, 1.0))
        true = chances[:, meanings.index(KINDS[motion.kind][0])]
        losses.append(-np.log(np.maximum(true, 1e-9)).mean())
    return float(np.mean(losses))
