"""How a demonstration goes on changes nothing that was filmed before."""

from collections.abc import Iterator

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, make_pose
from intent_tracking.workshop.person.acting.going_on import Going, filmed_on, in_mirror
from intent_tracking.workshop.person.acting.script import sample_body
from intent_tracking.workshop.person.acting.task_moves import Pace

TASKS = ("hand-over", "pouring", "dish-washing", "tool-use")
_FRAMES, _MORE = 12, 21


def shown(frames: int = _FRAMES, objects: int = 1) -> Going:
    """Return a right hand that lifts the first object straight up."""
    turn = np.stack([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]], axis=1)
    places = np.zeros((frames, 3))
    places[:, 2] = np.linspace(0.0, 0.12, frames)
    things = np.tile(make_pose(np.eye(3), np.zeros(3)), (frames, objects, 1, 1))
    things[:, 0, :3, 3] = places
    hands = np.array([make_pose(turn, place + np.array([0.0, 0.10, 0.05])) for place in places])
    body = sample_body(np.random.default_rng(0))
    elbows, shoulders = body.arms(hands)
    return Going(hands, np.zeros((frames, 20)), np.zeros((frames, 3)), elbows, shoulders, things)


def gone_on(task: str, stand: list[tuple[Array, float, float]] | None = None) -> Going:
    rng = np.random.default_rng(4)
    pace, body = Pace(go_on=_MORE), sample_body(np.random.default_rng(0))
    return filmed_on(shown(), [_FRAMES - 1], [task], pace, body, stand or [], rng)[0]


def parts(motion: Going) -> Iterator[Array]:
    yield from (motion.hands, motion.angles, motion.wrists, motion.elbows, motion.shoulders)
    yield motion.objects


@pytest.mark.parametrize("task", TASKS)
def test_frames_before_have_the_same_bits(task: str) -> None:
    for before, after in zip(parts(shown()), parts(gone_on(task)), strict=True):
        assert len(after) == _FRAMES + _MORE
        np.testing.assert_array_equal(after[:_FRAMES], before)


@pytest.mark.parametrize("task", TASKS)
def test_the_object_stays_in_the_hand_and_moves_as_people_do(task: str) -> None:
    motion = gone_on(task)
    held = inverse(motion.objects[:, 0]) @ motion.hands
    np.testing.assert_allclose(held, held[:1].repeat(len(held), axis=0), atol=1e-9)
    for ways in (motion.hands[:, :3, 3], motion.elbows, motion.shoulders):
        assert np.linalg.norm(np.diff(ways[_FRAMES - 1 :], axis=0), axis=1).max() < 0.045


def test_what_is_given_goes_away_from_the_person_and_is_held_there() -> None:
    places = gone_on("hand-over").objects[:, 0, :3, 3]
    assert places[-1, 1] < places[_FRAMES - 1, 1] - 0.03
    assert np.linalg.norm(places[-1] - places[-5]) < 0.006


def test_what_pours_tilts_on_and_keeps_its_tilt() -> None:
    turns = gone_on("pouring").objects[:, 0, :3, :3]
    tilts = np.degrees(np.arccos(np.clip(turns[:, 2, 2], -1.0, 1.0)))
    assert 4.0 < tilts[-1] < 30.0
    assert abs(tilts[-1] - tilts[-5]) < 3.0


def test_where_another_act_follows_the_object_comes_back_and_all_is_later() -> None:
    before = shown(2 * _FRAMES, objects=2)
    rng, body = np.random.default_rng(4), sample_body(np.random.default_rng(0))
    ends = [_FRAMES - 1, 2 * _FRAMES - 1]
    tasks = ["pouring", "hand-over"]
    after, late = filmed_on(before, ends, tasks, Pace(go_on=_MORE), body, [], rng)
    first = int(late[1])
    assert late[0] == 0
    assert first > _MORE
    np.testing.assert_array_equal(after.hands[_FRAMES + first :][:_FRAMES], before.hands[_FRAMES:])
    back = after.objects[_FRAMES + first - 1, 0, :3, 3] - before.objects[_FRAMES - 1, 0, :3, 3]
    assert np.linalg.norm(back) < 0.004


def test_it_keeps_clear_of_what_stands_there() -> None:
    there = gone_on("hand-over").objects[-1, 0, :2, 3]
    spot, radius, room = there + np.array([0.08, 0.0]), 0.03, 0.06
    kept = gone_on("hand-over", [(spot, radius, 0.3)]).objects[_FRAMES:, 0, :2, 3]
    assert np.linalg.norm(there - spot) < radius + room
    assert np.linalg.norm(kept - spot, axis=1).min() >= radius + room


def test_a_left_hand_does_the_mirror_image() -> None:
    motion = gone_on("pouring")
    left = in_mirror(motion)
    np.testing.assert_allclose(left.hands[:, 0, 3], -motion.hands[:, 0, 3])
    for once, again in zip(parts(motion), parts(in_mirror(left)), strict=True):
        np.testing.assert_allclose(again, once, atol=1e-12)
