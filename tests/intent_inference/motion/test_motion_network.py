"""The filter over kinds of motion and phases."""

from itertools import product

import numpy as np

from intent_inference.motion.measures import MEASURES, STATES, HeldMotion, person_of, shares
from intent_inference.motion.motion_network import (
    NOTHING,
    PHASES,
    RATE,
    MotionFilter,
    MotionNetwork,
    shipped_motion,
)

TASKS = ("pouring", "hand-over")


def drawn_network(rng: np.random.Generator) -> MotionNetwork:
    moves = rng.dirichlet(np.ones(len(PHASES)), (3, len(PHASES)))
    cells = rng.dirichlet(np.ones(STATES), (len(MEASURES), 3, len(PHASES)))
    return MotionNetwork(("a", "b", "c"), ("pouring", "hand-over", NOTHING), moves, cells, RATE)


def test_filtering_equals_the_sum_over_all_sequences_of_phases() -> None:
    rng = np.random.default_rng(3)
    network = drawn_network(rng)
    frames = rng.normal(0.0, 0.4, (4, len(MEASURES)))
    own = MotionFilter(network, TASKS)
    for step, measures in enumerate(frames):
        own.step((step + 1) / RATE, measures)
    seen = np.exp([network.log_likelihood(m).sum(axis=0) for m in frames])
    for kind in range(3):
        total = 0.0
        for path in product(range(len(PHASES)), repeat=len(frames)):
            chance, before = 1.0, 0
            for step, phase in enumerate(path):
                chance *= network.transitions[kind, before, phase] * seen[step, kind, phase]
                before = phase
            total += chance
        assert np.isclose(own.log_evidence[kind], np.log(total), atol=1e-9)


def test_soft_cells_of_a_value_sum_to_one_and_of_none_to_zero() -> None:
    values = np.linspace(-2.0, 2.0, len(MEASURES))
    values[-1] = np.nan
    cells = shares(values)
    np.testing.assert_allclose(cells[:-1].sum(axis=1), 1.0)
    assert cells[-1].sum() == 0.0


def test_a_task_without_a_known_motion_is_moved_by_none() -> None:
    own = MotionFilter(shipped_motion(), ("juggling",))
    own.step(0.0, np.zeros(len(MEASURES)))
    assert np.isfinite(own.log_evidence).all()


def test_an_object_that_rests_in_the_hand_moves_no_task() -> None:
    own = MotionFilter(shipped_motion(), TASKS)
    at_rest = HeldMotion(np.eye(4), person_of(np.eye(4), None, "right"))
    for frame in range(round(RATE)):
        own.step(frame / RATE, at_rest.step(frame / RATE, np.eye(4), other=0.25))
    np.testing.assert_allclose(np.diff(own.log_evidence), 0.0, atol=0.1)
