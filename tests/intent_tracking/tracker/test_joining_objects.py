"""Objects join a running track, keep their place and id, and leave it when they are gone."""

from dataclasses import replace

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_perception.recognition.rehearsal_scene import T_TABLE_CAMERA, rehearsal_frames
from intent_tracking.tracker.held_objects import joined_objects
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

DATABASE = ObjectDatabase.load()
ROWS = {"bottle_0": -0.2, "mug_0": 0.0, "glass_0": 0.2}


def item(name: str, x: float | None = None) -> RecognizedObject:
    pose = make_pose(np.eye(3), [ROWS[name] if x is None else x, 0.0, 0.1])
    return RecognizedObject(name, name, name.split("_")[0], pose, 1.0, 1.0)


def answer(*names: str, complete: bool = True) -> RecognizedObjects:
    return RecognizedObjects(0, tuple(map(item, names)), T_TABLE_CAMERA, complete)


def ids(objects: RecognizedObjects) -> list[str]:
    return [one.id for one in objects.objects]


def test_known_objects_keep_their_place_and_new_ones_come_last() -> None:
    joined, kept = joined_objects(
        answer("mug_0", "bottle_0"), answer("glass_0", "bottle_0", "mug_0"), {}
    )
    assert ids(joined) == ["mug_0", "bottle_0", "glass_0"]
    assert kept == [0, 1, None]


def test_only_a_complete_answer_says_that_an_object_is_gone() -> None:
    first = answer("mug_0", "bottle_0")
    partial, _ = joined_objects(first, answer("bottle_0", complete=False), {})
    assert ids(partial) == ["mug_0", "bottle_0"]
    complete, kept = joined_objects(first, answer("bottle_0"), {})
    assert ids(complete) == ["bottle_0"]
    assert kept == [1]


def test_a_held_object_stays_where_the_hand_has_it_whatever_the_answer_says() -> None:
    held: dict[str, Array] = {"mug_0": make_pose(np.eye(3), [0.0, 0.3, 0.3])}
    for other in (answer("bottle_0"), answer("bottle_0", "mug_0")):
        joined, _ = joined_objects(answer("mug_0", "bottle_0"), other, held)
        assert ids(joined) == ["mug_0", "bottle_0"]
        assert np.array_equal(joined.objects[0].T_table_object, held["mug_0"])


def test_another_name_for_a_held_object_is_not_a_second_one() -> None:
    held: dict[str, Array] = {"mug_0": make_pose(np.eye(3), [0.2, 0.0, 0.1])}
    joined, _ = joined_objects(answer("mug_0"), answer("glass_0"), held)
    assert ids(joined) == ["mug_0"]


@pytest.fixture
def tracker() -> Tracker:
    return Tracker({m.name: m for m in DATABASE}, TrackerConfig(networks=False))


def test_the_hand_is_followed_on_while_objects_join(tracker: Tracker) -> None:
    model = DATABASE["bottle_0"]
    frames = rehearsal_frames(model, 5)
    tracker.start(RecognizedObjects(0, (), T_TABLE_CAMERA, complete=False))
    states = [tracker.step(frame) for frame in frames[:3]]
    tracked = [state.hand_tracked for state in states]
    thing = RecognizedObject("b", model.name, "bottle", model.stable_poses[0], 1.0, 1.0)
    tracker.join(RecognizedObjects(0, (thing,), T_TABLE_CAMERA))
    after = tracker.step(frames[3])
    assert states[-1].object_ids == ()
    assert after.object_ids == ("b",)
    assert after.state.shape == (32,)
    assert np.allclose(after.T_table_objects[0], model.stable_poses[0], atol=0.02)
    assert after.hand_tracked == tracked[-1]
    if after.hand_tracked:
        moved = after.T_table_hand[:3, 3] - states[-1].T_table_hand[:3, 3]
        assert np.linalg.norm(moved) < 0.05


def test_an_answer_before_the_start_or_of_unknown_objects_is_refused(tracker: Tracker) -> None:
    with pytest.raises(ValueError, match="start"):
        tracker.join(answer("mug_0"))
    tracker.start(answer())
    strange = RecognizedObject("x", "teapot", "teapot", np.eye(4), 1.0, 1.0)
    with pytest.raises(ValueError, match="teapot"):
        tracker.join(RecognizedObjects(0, (strange,), T_TABLE_CAMERA))


def test_a_better_shape_of_a_thing_takes_the_place_of_the_one_before() -> None:
    database = ObjectDatabase(DATABASE.models)
    tracker = Tracker(database, TrackerConfig(networks=False))
    frame = rehearsal_frames(DATABASE["mug_0"], 1)[0]
    for revision, name in enumerate(("glass_0", "mug_0")):
        shape = replace(DATABASE[name], name=f"thing~{revision}")
        database.learn(shape)
        thing = RecognizedObject("thing", shape.name, "", shape.rest, 0.9, 0.9, shape, revision)
        objects = RecognizedObjects(0, (thing,), T_TABLE_CAMERA)
        if revision == 0:
            tracker.start(objects)
        else:
            tracker.join(objects)
        state = tracker.step(frame)
        assert state.object_ids == ("thing",)
        assert state.object_models == (f"thing~{revision}",)
