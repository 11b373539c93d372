"""The motion network learned from simulated motions, and how well it tells others of them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from intent_inference.motion.measures import CELLS, MEASURES, STATES, shares
from intent_inference.motion.motion_network import (
    NOTHING,
    PHASES,
    RATE,
    MotionFilter,
    MotionNetwork,
)
from intent_inference.workshop.acting.held_motions import KINDS, Motion, held_motion
from intent_perception.basics.arrays import Array

_PSEUDO = 1.0
"""Of each cell, in frames."""


def learned_motion(per_kind: int, rng: np.random.Generator) -> MotionNetwork:
    """Return the network of so many simulated motions per kind, its weight calibrated on others."""
    motions = [held_motion(kind, rng) for kind in KINDS for _ in range(per_kind)]
    network = network_of(motions, weight=4.0)
    fresh = [held_motion(kind, rng) for kind in KINDS for _ in range(max(8, per_kind // 8))]
    weights = (1.0, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0)
    losses = [log_loss(replace(network, weight=weight), fresh) for weight in weights]
    return replace(network, weight=weights[int(np.argmin(losses))])


def network_of(motions: list[Motion], weight: float) -> MotionNetwork:
    """Return the network that soft counts of labelled motions give."""
    kinds = tuple(dict.fromkeys(motion.kind for motion in motions))
    moves = np.full((len(kinds), len(PHASES), len(PHASES)), 1e-3)
    moves += 0.5 * np.eye(len(PHASES))
    counts = np.zeros((len(MEASURES), len(kinds), len(PHASES), STATES))
    for row, cells in enumerate(CELLS):
        counts[row, :, :, :cells] = _PSEUDO
    for motion in motions:
        kind = kinds.index(motion.kind)
        for before, after in pairwise(motion.phases):
            moves[kind, before, after] += 1.0
        for phase, measures in zip(motion.phases, motion.measures(), strict=True):
            counts[:, kind, phase] += shares(measures)
    return MotionNetwork(
        kinds, tuple(KINDS[kind][0] for kind in kinds),
        moves / moves.sum(axis=2, keepdims=True), counts / counts.sum(axis=3, keepdims=True),
        weight,
    )  # fmt: skip


def beliefs(network: MotionNetwork, motion: Motion, until: float) -> tuple[tuple[str, ...], Array]:
    """Return the meanings and p(meaning) (T + 1,) after `until` seconds from the first lift."""
    tasks = tuple(dict.fromkeys(task for task in network.tasks if task != NOTHING))
    own = MotionFilter(network, tasks)
    heights = motion.poses[:, 2, 3] - motion.poses[0, 2, 3]
    lifted = int(np.argmax(heights > 0.02)) if np.any(heights > 0.02) else 0
    end = lifted + round(until * RATE)
    for frame, measures in enumerate(motion.measures()[: end + 1]):
        own.step(frame / RATE, measures)
    log_odds = own.log_evidence
    chance = np.exp(log_odds - log_odds.max())
    return (*tasks, NOTHING), chance / chance.sum()


def log_loss(network: MotionNetwork, motions: list[Motion]) -> float:
    """Return the mean -log p(true meaning), half a second and one second after lift-off."""
    losses = []
    for motion in motions:
        for until in (0.5, 1.0):
            meanings, chance = beliefs(network, motion, until)
            true = chance[meanings.index(KINDS[motion.kind][0])]
            losses.append(-float(np.log(max(float(true), 1e-9))))
    return float(np.mean(losses))
