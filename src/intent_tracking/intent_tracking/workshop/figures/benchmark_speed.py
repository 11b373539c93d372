"""How fast the rendered objective is, on one core and on two."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from intent_perception.basics.arrays import Floats
from intent_tracking.fit.objective import forth_costs
from intent_tracking.image.frame_evidence import Labelled
from intent_tracking.scene.hand_kernel import hand_arrays
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.object_kernel import object_arrays

SIZE, PARTICLES = 64, 2048


def _problem() -> tuple[Labelled, Floats, Floats]:
    depth = np.full((SIZE, SIZE), 0.8, np.float32)
    hand = np.zeros((SIZE, SIZE), np.float32)
    hand[16:48, 16:48] = 1.0
    seen = Labelled(
        depth, hand, np.zeros_like(hand), np.ones_like(hand), np.ones_like(hand),
        np.float32(-0.16), np.float32(-0.16), np.float32(0.32 / SIZE),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    states = np.zeros((PARTICLES, 26), np.float32)
    states[:, :3] = rng.normal([-0.09, 0.0, 0.8], 0.01, (PARTICLES, 3))
    states[:, 3:6] = rng.normal(0.0, 0.2, (PARTICLES, 3))
    states[:, 6:] = rng.uniform(0.0, 0.6, (PARTICLES, 20))
    return seen, states, np.eye(3, dtype=np.float32)[None].copy()


def evaluations_per_second(repeats: int = 15) -> float:
    """Return evaluations of hand and cost at 64 x 64 per CPU second of one core."""
    seen, states, base = _problem()
    hand, objects = hand_arrays(HandModel()), object_arrays([])
    costs = np.zeros(PARTICLES, np.float32)
    best = np.inf
    for _ in range(repeats + 1):
        began = time.process_time()
        forth_costs(hand, objects, seen, states, base, 0, PARTICLES, costs)
        best = min(best, time.process_time() - began)
    return PARTICLES / best


def parallel_speedup(repeats: int = 60) -> float:
    """Return how much two threads shorten the wall time of a large swarm.

    One and two threads take turns, so that both meet the machine's quiet moments; the shortest of
    each counts.
    """
    seen, states, base = _problem()
    hand, objects = hand_arrays(HandModel()), object_arrays([])
    costs = np.zeros(PARTICLES, np.float32)

    def part(first: int, last: int) -> None:
        forth_costs(hand, objects, seen, states, base, first, last, costs)

    part(0, 8)
    walls = {1: np.inf, 2: np.inf}
    with ThreadPoolExecutor(2) as pool:
        for _ in range(repeats):
            for threads in walls:
                cuts = np.linspace(0, PARTICLES, threads + 1).astype(int)
                began = time.perf_counter()
                list(pool.map(part, cuts[:-1], cuts[1:]))
                walls[threads] = min(walls[threads], time.perf_counter() - began)
    return walls[1] / walls[2]
