"""Particle swarm optimisation with the coefficients of the published trackers (BMVC 2011)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from intent_tracking.hand_kernel import Single

COGNITIVE, SOCIAL = 2.8, 1.3
_SUM = COGNITIVE + SOCIAL
CONSTRICTION = 2.0 / abs(2.0 - _SUM - np.sqrt(_SUM * _SUM - 4.0 * _SUM))
"""w = 0.7298."""
FINGERS = slice(6, 26)


@dataclass(frozen=True, eq=False)
class Swarm:
    """Where the swarm ended."""

    best: Single
    """(D,) best position."""
    cost: float
    spread: Single
    """(D,) standard deviation of the particles' own best positions."""


def minimise(
    cost: Callable[[Single], Single],
    start: Single,
    spread: Single,
    bounds: Single,
    particles: int,
    generations: int,
    rng: np.random.Generator,
) -> Swarm:
    """Minimise a cost around `start`.

    Every third generation half of the particles get one finger joint drawn anew within its
    limits. Velocities are clamped to twice the start's spread.

    Args:
        cost: (P, D) positions -> (P,) costs.
        start: (D,) centre; also the first particle. [6:26] are the finger joints.
        spread: (D,) standard deviation of the start positions.
        bounds: (D, 2) lower and upper limits.
        particles: number of particles P.
        generations: number of cost evaluations per particle.
        rng: source of randomness.
    """
    shape = (particles, len(start))
    low, high = bounds[:, 0], bounds[:, 1]
    position = start + rng.standard_normal(shape, dtype=np.float32) * spread
    position[0] = start
    position = np.clip(position, low, high)
    velocity = np.zeros(shape, np.float32)
    own, own_cost = position.copy(), np.full(particles, np.inf, np.float32)
    for generation in range(generations):
        costs = cost(position)
        better = costs < own_cost
        own[better], own_cost[better] = position[better], costs[better]
        if generation == generations - 1:
            break
        best = own[np.argmin(own_cost)]
        pull = COGNITIVE * rng.random(shape, dtype=np.float32) * (own - position)
        pull += SOCIAL * rng.random(shape, dtype=np.float32) * (best - position)
        velocity = np.clip(CONSTRICTION * (velocity + pull), -2.0 * spread, 2.0 * spread)
        position = np.clip(position + velocity, low, high).astype(np.float32)
        if generation % 3 == 2 and generation < generations - 3:
            _redraw_finger_joints(position, bounds, rng)
    winner = int(np.argmin(own_cost))
    return Swarm(own[winner], float(own_cost[winner]), own.std(axis=0).astype(np.float32))


def _redraw_finger_joints(position: Single, bounds: Single, rng: np.random.Generator) -> None:
    chosen = rng.permutation(len(position))[: len(position) // 2]
    joints = rng.integers(FINGERS.start, FINGERS.stop, len(chosen))
    position[chosen, joints] = rng.uniform(bounds[joints, 0], bounds[joints, 1])
