"""The live picture says what is believed, and no more."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.support.demo_records import TASKS, posterior, record

from intent_imitation.demo.run_record import DemoRecord
from intent_imitation.live.belief import BeliefKeeper
from intent_imitation.live.live_picture import live_picture
from intent_perception.objects.database import ObjectDatabase


@pytest.fixture(scope="module")
def run() -> DemoRecord:
    return record(ObjectDatabase.load())


def kept(run: DemoRecord, count: int) -> BeliefKeeper:
    """What is believed after so many states of a run, posteriors as they came."""
    keeper = BeliefKeeper()
    for state in run.states[:count]:
        keeper.note_state(state)
        for told in run.posteriors:
            if told.stamp == state.stamp:
                keeper.note_posterior(told)
    return keeper


def test_without_a_hand_in_view_no_probability_is_current(run: DemoRecord) -> None:
    keeper = kept(run, len(run.states))
    unseen = replace(run.states[-1], hand_visible=False, state=run.states[0].state)
    keeper.note_state(unseen)
    assert (keeper.belief.stage, keeper.belief.current) == ("not in view", False)


def test_without_the_tracker_that_is_said() -> None:
    keeper = BeliefKeeper()
    assert keeper.belief.stage == "unknown, the tracker is silent"
    assert keeper.belief.chances == ()


def test_a_forecast_takes_the_robots_earlier_answer_back(run: DemoRecord) -> None:
    keeper = kept(run, len(run.states))
    assert run.plan is not None
    keeper.note_plan(run.plan)
    assert keeper.belief.answer == "takes mug 1 for pouring"
    keeper.note_posterior(posterior(run.states[-1].stamp + 1, preliminary=True))
    assert keeper.belief.answer == ""


def test_a_recording_that_starts_over_begins_anew(run: DemoRecord) -> None:
    keeper = kept(run, len(run.states))
    keeper.note_state(replace(run.states[-1], stamp=run.states[-1].stamp + 3_000_000_000))
    keeper.note_state(run.states[0])
    assert keeper.as_json()["points"] == []


def test_the_page_is_told_every_posterior_in_order(run: DemoRecord) -> None:
    told = kept(run, len(run.states)).as_json()
    assert told["tasks"] == [*TASKS, "none of these"]
    times = [row[0] for row in told["points"]]
    assert times == sorted(times)
    assert all(len(row) == 3 + len(TASKS) for row in told["points"])


def test_the_picture_shows_objects_and_the_panel_beside_them(run: DemoRecord) -> None:
    database, frame = run.database, run.frames[-1]
    belief = kept(run, len(run.states)).belief
    picture = live_picture(frame.color, frame.camera, belief, lambda name: database[name])
    assert picture.shape == (480, 640 + 260, 3)
    assert (picture[:, :640] != 200).any()
    assert np.unique(picture[:, 640:].reshape(-1, 3), axis=0).shape[0] > 20


def test_an_object_that_is_not_known_yet_is_left_out(run: DemoRecord) -> None:
    belief, frame = kept(run, 1).belief, run.frames[0]
    picture = live_picture(frame.color, frame.camera, belief, lambda _: None)
    assert (picture[:, :640] == 200).all()


def test_the_picture_shows_the_hand_while_it_is_tracked(run: DemoRecord) -> None:
    frame, keeper = run.frames[-1], kept(run, len(run.states))

    def scene() -> Any:
        picture = live_picture(frame.color, frame.camera, keeper.belief, lambda _: None)
        return picture[:, :640]

    assert (scene() != 200).any()
    keeper.note_state(replace(run.states[-1], hand_visible=False, state=run.states[0].state))
    assert (scene() == 200).all()


def test_the_panel_beside_the_picture_follows_the_posterior(run: DemoRecord) -> None:
    frame, keeper = run.frames[-1], kept(run, len(run.states))
    first = live_picture(frame.color, frame.camera, keeper.belief, lambda _: None)
    told = posterior(run.states[-1].stamp, preliminary=False)
    keeper.note_posterior(replace(told, intends=told.intends[::-1].copy()))
    second = live_picture(frame.color, frame.camera, keeper.belief, lambda _: None)
    assert (first[:, 640:] != second[:, 640:]).any()
