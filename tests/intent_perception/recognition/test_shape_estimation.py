"""Things that no database holds get a class, a closed shape and a pose from one frame."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from intent_perception.geometry.transforms import inverse
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.families.designed_object import DesignedObject, finish
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.detector_config import DetectorConfig, oriented_scene, table_of
from intent_perception.recognition.estimation.class_odds import CLASSES, class_odds
from intent_perception.recognition.estimation.outlines import outline_of
from intent_perception.recognition.estimation.shape_estimator import (
    EstimatedShape,
    estimated_shapes,
)
from intent_perception.recognition.estimation.thing_gate import is_whole, settled
from intent_perception.recognition.recognizer import things_alone
from intent_perception.recognition.rehearsal_scene import rehearsal_things
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.workshop.scenes.table_scenes import TabletopScene, tabletop_scene
from intent_perception.workshop.things.unseen_things import (
    any_bottle,
    any_can,
    any_carton,
    any_hammer,
    any_mug,
    unseen_thing,
)

Maker = Callable[[np.random.Generator], DesignedObject]


def made(maker: Maker, kind: str, seed: int) -> ObjectModel:
    return finish(maker(np.random.default_rng(seed)), kind or "thing", kind)


def look(scene: TabletopScene) -> list[EstimatedShape]:
    config = DetectorConfig()
    image = oriented_scene(scene.frame, config)
    table = table_of(image, config)
    assert table is not None
    view = SceneView.of(image, segment(image, table))
    return estimated_shapes(view, table.T_table_camera(), np.random.default_rng(0))


def alone(model: ObjectModel, seed: int) -> TabletopScene:
    return tabletop_scene([model], np.random.default_rng(seed), standing=1.0)


@pytest.mark.parametrize(("maker", "kind"), [(any_bottle, "bottle"), (any_hammer, "hammer")])
def test_class_and_size_of_a_new_shape_are_estimated(maker: Maker, kind: str) -> None:
    right, errors = 0, []
    for seed in range(6):
        model = made(maker, kind, seed)
        (shape,) = look(alone(model, seed))
        right += shape.model.object_class == kind
        errors.append(abs(shape.model.size[2] / model.size[2] - 1.0))
    assert right >= 5
    assert np.median(errors) < 0.08


@pytest.mark.parametrize("maker", [any_carton, any_can])
def test_what_is_of_no_class_gets_a_shape_that_can_be_grasped(maker: Maker) -> None:
    for seed in range(4):
        (shape,) = look(alone(made(maker, "", seed), seed))
        assert shape.model.object_class == ""
        assert shape.model.require_volume().volume > 0.0
        assert shape.likeness.share > 0.6
        assert len(shape.model.stable_poses)


def test_a_whole_thing_is_looked_at_again_only_where_an_object_may_be_on_it() -> None:
    scene = alone(made(any_can, "", 0), 0)
    (shape,) = look(scene)
    nothing = np.zeros(scene.frame.depth.shape, np.float32)
    assert is_whole(shape)
    assert settled([shape], nothing).sum() == shape.thing.pixels
    assert settled([shape], nothing + 1.0).sum() == 0.0


def test_a_mug_s_handle_points_where_it_is() -> None:
    gaps = []
    for seed in range(8):
        model = made(any_mug, "mug", seed)
        scene = alone(model, seed)
        (shape,) = look(scene)
        if shape.model.object_class != "mug":
            continue  # the handle is behind
        T_camera_table = inverse(table_pose(scene))
        found = (T_camera_table @ shape.T_table_object)[:3, 0]
        gaps.append(np.degrees(np.arccos(found @ scene.objects[0].T_camera_object[:3, 0])))
    assert len(gaps) >= 4
    assert np.median(gaps) < 10.0


def table_pose(scene: TabletopScene) -> np.ndarray:
    table = table_of(oriented_scene(scene.frame, DetectorConfig()), DetectorConfig())
    assert table is not None
    return table.T_table_camera()


def test_the_same_frame_gives_the_same_shape() -> None:
    scene = alone(made(any_mug, "mug", 3), 3)
    one, two = look(scene)[0], look(scene)[0]
    np.testing.assert_array_equal(one.model.mesh.vertices, two.model.mesh.vertices)
    np.testing.assert_array_equal(one.T_table_object, two.T_table_object)


def test_odds_sum_to_one_and_refuse_other_measures() -> None:
    (shape, *_) = look(alone(unseen_thing("bottle", np.random.default_rng(1), "b"), 1))
    odds = class_odds(outline_of(shape.thing).features)
    assert len(odds) == len(CLASSES)
    assert odds.sum() == pytest.approx(1.0)
    with pytest.raises(ValueError, match="fit it anew"):
        class_odds(np.zeros(3))


def test_without_any_known_object_everything_is_reported_by_its_shape() -> None:
    answer = things_alone(alone(made(any_bottle, "bottle", 0), 0).frame)
    (thing,) = answer.objects
    assert answer.table_seen
    assert thing.object_class == "bottle"
    assert thing.shape is not None


def test_of_very_many_things_the_largest_are_looked_at() -> None:
    scene = alone(made(any_can, "", 0), 0)
    depth = scene.frame.depth.copy()
    for column in range(30, 600, 30):  # crumbs all over the table
        depth[380:394, column : column + 10] -= 0.03
    answer = things_alone(replace(scene.frame, depth=depth))
    sizes = [float(np.prod(thing.shape.size)) for thing in answer.objects if thing.shape]
    assert len(sizes) <= 12
    assert max(sizes) == pytest.approx(float(np.prod(scene.objects[0].model.size)), rel=0.3)


def test_set_up_goes_through_the_shapes_of_every_class() -> None:
    models = {model.object_class: model for model in ObjectDatabase.load()}
    answer = things_alone(rehearsal_things(list(models.values())))
    assert [item.object_class for item in answer.objects] == list(models)
