"""A run that did not see the whole bag concludes nothing."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.demo_records import STEP, plan, posterior, recognized, record, state

from intent_imitation.demo.collected import Collected
from intent_imitation.demo.run_progress import FOLLOWERS, RunProgress, check_answers
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures

STAMPS = [k * STEP for k in range(10)]


@pytest.fixture(scope="module")
def database() -> ObjectDatabase:
    return ObjectDatabase.load().select(["mug_1", "bottle_2"])


@pytest.fixture
def whole(database: ObjectDatabase) -> Collected:
    """What a run with one grasp collects."""
    objects = recognized(database)
    states = [state(objects, stamp, True) for stamp in STAMPS]
    nothing = GraspFeatures(*[None] * 9)
    grasp = StableGrasp(STAMPS[5], "mug_1", "mug_1", "mug", "right", nothing, None, np.eye(4))
    return Collected(
        states=states, grasps=[grasp], posteriors=[posterior(STAMPS[5], False)],
        plans=[plan(objects, STAMPS[5])],
    )  # fmt: skip


def dealt(progress: RunProgress, count: int, now: float = 0.0) -> None:
    for node in ("tracker", "grasp_detector", "inference"):
        progress.note_dealt(node, STAMPS[count - 1], now)


def test_a_slow_run_is_not_given_up_while_frames_come(whole: Collected) -> None:
    progress = RunProgress(STAMPS, patience=60.0, now=0.0)
    for count in range(1, 10):
        dealt(progress, count, now=50.0 * count)
        progress.check(whole, 50.0 * count + 59.0)


def test_a_run_without_new_frames_is_given_up_and_says_after_how_many(whole: Collected) -> None:
    progress = RunProgress(STAMPS, patience=60.0, now=0.0)
    dealt(progress, 4, now=100.0)
    dealt(progress, 4, now=150.0)  # the same frame again is no progress
    with pytest.raises(ValueError, match=r"after 4 of 10 frames.*nothing is concluded"):
        progress.check(whole, 161.0)


def test_a_run_is_complete_only_when_every_question_has_its_answer(whole: Collected) -> None:
    progress = RunProgress(STAMPS, patience=60.0, now=0.0)
    assert "tracker" in progress.missing(whole)
    dealt(progress, 10)
    assert progress.missing(whole) == ""
    assert "plan" in progress.missing(replace(whole, plans=[]))
    assert "conclusion" in progress.missing(replace(whole, posteriors=[]))


def test_nothing_is_concluded_where_the_tracker_answered_few_frames(whole: Collected) -> None:
    check_answers(STAMPS, whole)
    with pytest.raises(ValueError, match="answered 5 of 10 frames: too few"):
        check_answers(STAMPS, replace(whole, states=whole.states[:5]))


def test_a_task_that_the_robot_does_not_know_does_not_hold_the_run_up() -> None:
    run = record(ObjectDatabase.load())
    final = run.final
    assert final is not None
    progress = RunProgress([state.stamp for state in run.states], 10.0, 0.0)
    got = Collected(states=list(run.states), grasps=list(run.grasps), posteriors=[final])
    for node in ("tracker", *FOLLOWERS):
        progress.note_dealt(node, run.states[-1].stamp, 0.0)
    assert "no plan" in progress.missing(got)
    progress.note_refused(final.stamp)
    assert progress.missing(got) == ""
