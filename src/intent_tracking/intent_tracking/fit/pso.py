"""Particle swarm optimisation with the coefficients of the published trackers (BMVC 2011)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import exact_kernel

COGNITIVE, SOCIAL = 2.8, 1.3
_SUM = COGNITIVE + SOCIAL
CONSTRICTION = 2.0 / abs(2.0 - _SUM - np.sqrt(_SUM * _SUM - 4.0 * _SUM))
"""w = 0.7298."""
FINGERS = slice(6, 26)


@dataclass(frozen=True, eq=False)
class Swarm:
    """Where the swarm ended."""

    best: Floats
    """(D,) best position."""
    cost: float
    spread: Floats
    """(D,) standard deviation of the particles' own best positions."""


def minimise(
    cost: Callable[[Floats], Floats],
    start: Floats,
    spread: Floats,
    bounds: Floats,
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
    velocity = np.zeros(shape)
    own, own_cost = position.copy(), np.full(particles, np.inf, np.float32)
    winner = 0
    for generation in range(generations):
        winner = remember(position, cost(position), own, own_cost)
        if generation == generations - 1:
            break
        draws = rng.random((2, *shape), dtype=np.float32)
        fly(position, velocity, own, own[winner], draws, spread, low, high)
        if generation % 3 == 2 and generation < generations - 3:
            _redraw_finger_joints(position, bounds, rng)
    return Swarm(own[winner], float(own_cost[winner]), own.std(axis=0).astype(np.float32))


@exact_kernel
def remember(position: Floats, costs: Floats, own: Floats, own_cost: Floats) -> int:
    """Update each particle's best position (P, D) and its cost (P,); return the best particle."""
    best = 0
    for p in range(position.shape[0]):
        if costs[p] < own_cost[p]:
            own_cost[p] = costs[p]
            for d in range(position.shape[1]):
                own[p, d] = position[p, d]
        if own_cost[p] < own_cost[best]:
            best = p
    return best


@exact_kernel
def fly(
    position: Floats,
    velocity: Floats,
    own: Floats,
    best: Floats,
    draws: Floats,
    spread: Floats,
    low: Floats,
    high: Floats,
) -> None:
    """Move the particles by one step of the swarm, without fast math: the same bits everywhere.

    Args:
        position: (P, D) float32, overwritten.
        velocity: (P, D) float64, overwritten.
        own: (P, D) best position of each particle.
        best: (D,) best position of all.
        draws: (2, P, D) random numbers in 0..1.
        spread: (D,) half of the highest velocity.
        low: (D,) lower limits.
        high: (D,) upper limits.
    """
    cognitive, social, two = np.float32(COGNITIVE), np.float32(SOCIAL), np.float32(2.0)
    for p in range(position.shape[0]):
        for d in range(position.shape[1]):
            here = position[p, d]
            pull = cognitive * draws[0, p, d] * (own[p, d] - here)
            pull += social * draws[1, p, d] * (best[d] - here)
            limit = np.float64(two * spread[d])
            fast = CONSTRICTION * (velocity[p, d] + np.float64(pull))
            velocity[p, d] = min(max(fast, -limit), limit)
            there = min(max(here + velocity[p, d], np.float64(low[d])), np.float64(high[d]))
            position[p, d] = np.float32(there)


def _redraw_finger_joints(position: Floats, bounds: Floats, rng: np.random.Generator) -> None:
    chosen = rng.permutation(len(position))[: len(position) // 2]
    joints = rng.integers(FINGERS.start, FINGERS.stop, len(chosen))
    position[chosen, joints] = rng.uniform(bounds[joints, 0], bounds[joints, 1])
