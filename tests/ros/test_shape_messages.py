"""Estimated shapes survive as messages, and meet their objects whichever arrives first."""

from dataclasses import replace

import numpy as np
import pytest
from intent_msgs.msg import ObjectShapes

from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.estimation.shape_memory import shape_name
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_perception.ros.convert import objects_to_msg
from intent_perception.ros.shape_messages import shape_from_msg, shape_to_msg, shapes_to_msg
from intent_perception.ros.shaped_objects import ShapedObjects

DATABASE = ObjectDatabase.load()
POSE = make_pose(np.eye(3), [0.1, 0.2, 0.05])


@pytest.mark.parametrize("name", ["mug_0", "knife_1", "hammer_2", "screwdriver_0", "bottle_3"])
def test_a_shape_survives_with_its_annotations(name: str) -> None:
    model = DATABASE[name]
    back = shape_from_msg(shape_to_msg("thing", 2, model))
    assert back.name == "thing~2"
    assert back.object_class == model.object_class
    np.testing.assert_allclose(back.mesh.vertices, model.mesh.vertices, atol=1e-6)
    np.testing.assert_array_equal(back.mesh.faces, model.mesh.faces)
    assert [part.name for part in back.parts] == [part.name for part in model.parts]
    np.testing.assert_allclose(back.stable_poses, model.stable_poses, atol=1e-9)
    assert back.functions is not None
    assert model.functions is not None
    assert back.functions.handle == model.functions.handle
    for field in ("opening", "edge", "face", "tip"):
        assert (getattr(back.functions, field) is None) == (getattr(model.functions, field) is None)


def answer(revision: int, stamp: int) -> RecognizedObjects:
    shape = replace(DATABASE["mug_0"], name=shape_name("thing", revision))
    item = RecognizedObject("thing", shape.name, "mug", POSE, 0.9, 0.7, shape, revision)
    return RecognizedObjects(stamp, (item,), POSE)


def test_objects_wait_for_their_shapes() -> None:
    heard: list[RecognizedObjects] = []
    database = DATABASE.select(["bottle_0"])
    both = ShapedObjects(database, lambda objects, _: heard.append(objects))
    first, second = answer(0, 10), answer(1, 20)
    both.on_objects(objects_to_msg(first, DATABASE))
    assert heard == []
    both.on_shapes(shapes_to_msg(first))
    assert heard[0].objects[0].model == "thing~0"
    assert "thing~0" in database
    both.on_shapes(shapes_to_msg(second))
    both.on_objects(objects_to_msg(second, DATABASE))
    assert heard[1].objects[0].model == "thing~1"
    assert heard[1].objects[0].shape is database["thing~1"]


def test_another_recogniser_may_give_an_old_name_to_a_new_shape() -> None:
    database = DATABASE.select(["bottle_0"])
    both = ShapedObjects(database)
    learnt = []
    for name in ("mug_0", "mug_0", "glass_1"):
        shape = shape_to_msg("thing", 0, DATABASE[name])
        both.on_shapes(ObjectShapes(shapes=[shape]))
        assert database["thing~0"].object_class == DATABASE[name].object_class
        np.testing.assert_allclose(database["thing~0"].size, DATABASE[name].size, atol=1e-6)
        learnt.append(database["thing~0"])
    assert learnt[0] is learnt[1]


def test_on_the_wire_an_estimated_object_has_no_model() -> None:
    message = objects_to_msg(answer(0, 10), DATABASE)
    assert message.objects[0].model == ""


def test_a_damaged_shape_is_refused() -> None:
    message = shape_to_msg("thing", 0, DATABASE["mug_0"])
    message.triangles = [0, 1, 999_999]
    with pytest.raises(ValueError, match="faces"):
        shape_from_msg(message)
