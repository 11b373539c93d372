"""A scene is looked at again when it has changed and nothing moves in it, and no object twice."""

from dataclasses import replace

import numpy as np
import pytest

from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import Recognizer
from intent_perception.recognition.rehearsal_scene import rehearsal_frames
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

DATABASE = ObjectDatabase.load().select(["bottle_0", "mug_0", "hammer_0"])
SECOND = 1_000_000_000


def scene(names: tuple[str, ...], seed: int) -> RgbdFrame:
    models = [DATABASE[name] for name in names]
    return tabletop_scene(models, np.random.default_rng(seed), standing=1.0).frame


def at(frame: RgbdFrame, seconds: float) -> RgbdFrame:
    return replace(frame, stamp=int(seconds * SECOND))


@pytest.fixture
def recognizer() -> Recognizer:
    return Recognizer(DATABASE)


def test_the_table_comes_first_then_objects_and_last_a_complete_answer(
    recognizer: Recognizer,
) -> None:
    answers = list(recognizer.looks(scene(("bottle_0", "mug_0"), 9)))
    assert [answer.complete for answer in answers] == [False, False, True]
    assert answers[0].table_seen
    assert answers[0].objects == ()
    assert {item.model for item in answers[1].objects} == {"bottle_0", "mug_0"}
    assert {item.model for item in answers[2].objects} == {"bottle_0", "mug_0"}


def test_without_a_table_the_only_answer_is_empty_and_complete(recognizer: Recognizer) -> None:
    frame = scene(("bottle_0",), 9)
    blank = replace(frame, depth=np.zeros_like(frame.depth))
    (answer,) = recognizer.looks(blank)
    assert answer.complete
    assert not answer.table_seen


def test_a_table_that_comes_into_view_later_is_found(recognizer: Recognizer) -> None:
    frame = scene(("bottle_0",), 9)
    recognizer.step(replace(frame, depth=np.zeros_like(frame.depth)))
    answer = recognizer.step(at(frame, 1.0))
    assert answer is not None
    assert [item.model for item in answer.objects] == ["bottle_0"]


def test_a_calibrated_camera_finds_a_table_that_comes_into_view_later() -> None:
    frame, calibration = scene(("bottle_0",), 9), np.eye(4)
    calibration[:3] = [[1, 0, 0, 0], [0, -0.7, 0.7141428, 0], [0, -0.7141428, -0.7, 0.5]]
    recognizer = Recognizer(DATABASE, T_table_camera=calibration)
    recognizer.up = None  # this camera stands elsewhere
    first = recognizer.step(replace(frame, depth=np.zeros_like(frame.depth)))
    assert first is not None
    assert first.objects == ()
    answer = recognizer.step(at(frame, 1.0))
    assert answer is not None
    assert [item.model for item in answer.objects] == ["bottle_0"]


def test_a_changed_scene_is_looked_at_once_it_is_still(recognizer: Recognizer) -> None:
    before, after = scene(("bottle_0",), 9), scene(("bottle_0", "mug_0"), 12)
    assert recognizer.step(at(before, 0.0)) is not None
    assert recognizer.step(at(after, 1.0)) is None  # it may still be moving
    answers = list(recognizer.looks(at(after, 1.5)))
    assert {answer.stamp for answer in answers} == {at(after, 1.5).stamp}  # no old one again
    assert {item.model for item in answers[-1].objects} == {"bottle_0", "mug_0"}


def test_while_something_moves_nothing_is_said(recognizer: Recognizer) -> None:
    assert recognizer.step(at(scene(("bottle_0",), 9), 0.0)) is not None
    for number in range(1, 5):
        moving = scene(("bottle_0", "mug_0"), 20 + number)
        assert recognizer.step(at(moving, 0.25 * number)) is None


def test_a_hand_beside_the_objects_holds_the_answer(recognizer: Recognizer) -> None:
    alone, *with_hand = rehearsal_frames(DATABASE["bottle_0"], 4)
    assert recognizer.step(alone) is not None
    assert [recognizer.step(frame) for frame in with_hand[:1]] == [None]


def test_an_object_found_again_keeps_its_id(recognizer: Recognizer) -> None:
    before = recognizer.step(at(scene(("mug_0", "bottle_0"), 9), 0.0))
    assert before is not None
    other = scene(("mug_0", "bottle_0", "hammer_0"), 9)
    recognizer.step(at(other, 1.0))
    after = recognizer.step(at(other, 1.5))
    assert after is not None
    assert {item.id for item in before.objects} <= {item.id for item in after.objects}
