"""The filter over kinds of motion and phases."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from intent_inference.motion.measures import MEASURES, STATES, HeldMotion, person_of, shares
from intent_inference.motion.motion_network import (
    NOTHING,
    PHASES,
    RATE,
    STEPS,
    MotionFilter,
    MotionNetwork,
    shipped_motion,
)

TASKS = ("pouring", "hand-over")


def drawn_network(rng: np.random.Generator) -> MotionNetwork:
    moves = rng.dirichlet(np.ones(len(STEPS)), (3, len(STEPS)))
    cells = rng.dirichlet(np.ones(STATES), (len(MEASURES), 3, len(STEPS)))
    tasks = ("pouring", "hand-over", NOTHING)
    return MotionNetwork(("a", "b", "c"), tasks, np.ones(3), moves, cells, RATE)


def test_filtering_equals_the_sum_over_all_sequences_of_steps() -> None:
    rng = np.random.default_rng(3)
    network = drawn_network(rng)
    frames = rng.normal(0.0, 0.4, (4, len(MEASURES)))
    own = MotionFilter(network, TASKS)
    for frame, measures in enumerate(frames):
        own.step((frame + 1) / RATE, measures)
    seen = np.exp([network.log_likelihood(m).sum(axis=0) for m in frames])
    for kind in range(3):
        total = 0.0
        for path in product(range(len(STEPS)), repeat=len(frames)):
            chance, before = 1.0, 0
            for frame, step in enumerate(path):
                chance *= network.transitions[kind, before, step] * seen[frame, kind, step]
                before = step
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


def test_kinds_of_a_task_count_as_often_as_they_are_done() -> None:
    rng = np.random.default_rng(6)
    drawn = drawn_network(rng)
    tasks = ("pouring", "pouring", NOTHING)
    often = replace(drawn, tasks=tasks, priors=np.array([0.8, 0.2, 1.0]))
    apart, together = MotionFilter(drawn, ("pouring", "hand-over")), MotionFilter(often, TASKS[:1])
    for frame, measures in enumerate(rng.normal(0.0, 0.4, (4, len(MEASURES)))):
        apart.step(frame / RATE, measures)
        together.step(frame / RATE, measures)
    first, second, nothing = np.exp(apart.log_evidence)
    found = np.exp(together.log_evidence)
    np.testing.assert_allclose(found, [0.8 * first + 0.2 * second, nothing], rtol=1e-9)
    with pytest.raises(ValueError, match="sum to one"):
        replace(often, priors=np.ones(3))


def test_all_steps_are_part_of_a_phase() -> None:
    own = MotionFilter(shipped_motion(), TASKS)
    own.step(0.0, np.zeros(len(MEASURES)))
    phases = own.phases(np.full(len(TASKS) + 1, 1.0 / (len(TASKS) + 1)))
    assert set(STEPS.values()) == set(PHASES)
    assert phases.shape == (len(PHASES),)
    assert np.isclose(phases.sum(), 1.0)


def test_what_is_held_where_it_was_lifted_to_moves_no_task_far() -> None:
    own = MotionFilter(shipped_motion(), TASKS)
    held, pose = HeldMotion(np.eye(4), person_of(np.eye(4), None, "right")), np.eye(4)
    for frame in range(round(1.2 * RATE)):
        pose[2, 3] = 0.08 * min(1.0, frame / 11.0)
        own.step(frame / RATE, held.step(frame / RATE, pose.copy(), other=0.25))
    assert np.abs(np.diff(own.log_evidence)).max() < 1.0
