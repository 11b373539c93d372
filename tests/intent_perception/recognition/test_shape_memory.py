"""A thing keeps its id, and the better of its shapes."""

from dataclasses import replace

import numpy as np
import pytest

from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.estimation.likeness import Likeness
from intent_perception.recognition.estimation.shape_estimator import EstimatedShape
from intent_perception.recognition.estimation.shape_memory import ShapeMemory, shape_name
from intent_perception.recognition.estimation.things import SeenThing

MUG = ObjectDatabase.load()["mug_0"]
BOX = ObjectDatabase.clutter().models[0]


def seen(x: float, like: float, model: ObjectModel = MUG, hidden: float = 0.0) -> EstimatedShape:
    none = np.zeros((0, 3))
    thing = SeenThing(
        0, 0, np.ones((4, 4), bool), none, none, np.zeros(3), np.zeros(3), hidden, none
    )
    pose = make_pose(np.eye(3), [x, 0.0, 0.05])
    likeness = Likeness(like, 0.001, 1.0)
    return EstimatedShape(
        model.object_class, lambda: model, pose, 0.9, likeness, thing, np.ones(7) / 7
    )


def test_things_are_numbered_and_known_ids_are_left_out() -> None:
    kept = ShapeMemory().named([seen(0.0, 0.8), seen(0.3, 0.8)], {"thing"})
    assert [one.id for one in kept] == ["thing.2", "thing.3"]
    assert kept[0].shape.model.name == shape_name("thing.2", 0)


def test_a_better_look_makes_a_new_revision_and_a_worse_one_none() -> None:
    memory = ShapeMemory()
    memory.named([seen(0.0, 0.6)], set())
    (better,) = memory.named([seen(0.002, 0.8)], set())
    assert (better.id, better.revision) == ("thing", 1)
    (worse,) = memory.named([seen(0.004, 0.5)], set())
    assert worse.revision == 1
    assert worse.shape.likeness.share == pytest.approx(0.8)
    np.testing.assert_array_equal(worse.shape.T_table_object, better.shape.T_table_object)


def test_a_thing_that_was_moved_is_known_by_its_size() -> None:
    memory = ShapeMemory()
    memory.named([seen(0.0, 0.7), seen(0.2, 0.7, BOX)], set())
    first, second = memory.named([seen(0.5, 0.7, BOX), seen(-0.3, 0.7)], set())
    assert (first.id, second.id) == ("thing.2", "thing")
    assert first.shape.T_table_object[0, 3] == pytest.approx(0.5)


def test_a_database_finds_a_shape_by_its_revision_and_forgets_the_oldest() -> None:
    database = ObjectDatabase.load().select(["mug_0"])
    for revision in range(5):
        database.learn(replace(BOX, name=shape_name("thing", revision)))
    assert shape_name("thing", 4) in database
    assert shape_name("thing", 3) in database
    assert shape_name("thing", 0) not in database
    assert database[shape_name("thing", 4)].size == pytest.approx(BOX.size)
    assert database.names == ("mug_0",)
