"""The planner answers a task with a reachable grasp of a fitting object, or says that none fits."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support import demo_records

from intent_imitation.planner.grasp_library import GraspLibrary, GraspSet
from intent_imitation.planner.library_hypotheses import plan_unshaken
from intent_imitation.planner.plan import GraspPlan
from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.planner.planner_config import PlannerConfig
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

TASKS = ("hand-over", "pouring")


class MadeUpModel:
    """Stands for BN^R: likes some classes, and grasps from a wanted direction."""

    tasks = TASKS
    classes = ()

    def __init__(self, liked: dict[str, float], wanted: np.ndarray | None = None) -> None:
        self.liked, self.wanted = liked, wanted
        self.seen: list[set[str]] = []

    def posterior(self, features: dict[str, Any]) -> np.ndarray:
        self.seen.append(set(features["obcl"]))
        chance = np.array([self.liked.get(name, 0.5) for name in features["obcl"]])
        if self.wanted is not None and "npos" in features:
            chance = chance * (0.75 + 0.25 * features["npos"] @ self.wanted)
        return np.stack([np.full(len(chance), 0.5), chance], axis=1)


@pytest.fixture(scope="module")
def database() -> ObjectDatabase:
    everything = ObjectDatabase.load()
    return ObjectDatabase(tuple(everything[n] for n in ("mug_1", "bottle_2", "glass_0")))


@pytest.fixture(scope="module")
def library(database: ObjectDatabase) -> GraspLibrary:
    hand = GraspingHand.load("schunk")
    sets = {name: plan_unshaken(database[name], hand, 250) for name in ("mug_1", "bottle_2")}
    shaken = {k: replace(v, shaken=np.ones(len(v), dtype=bool)) for k, v in sets.items()}
    return GraspLibrary("schunk", shaken)


def planner(database: ObjectDatabase, library: GraspLibrary, model: Any, **config: Any) -> Any:
    return GraspPlanner(database, PlannerConfig(**config), model, library)


def table(database: ObjectDatabase, *names: str, turn: float = 0.0) -> RecognizedObjects:
    """Return objects in a row, 30 cm apart, the whole table turned about the vertical."""
    spin = make_pose(rotation_from_vector([0.0, 0.0, turn]), [0.1 * turn, 0.0, 0.0])
    items = []
    for index, name in enumerate(names):
        model = database[name]
        pose = spin @ make_pose(np.eye(3), [0.3 * index, 0.0, 0.0]) @ model.stable_poses[0]
        items.append(RecognizedObject(name, name, model.object_class, pose, 0.9, 0.9))
    return RecognizedObjects(0, tuple(items), np.eye(4))


def unclassed(objects: RecognizedObjects) -> RecognizedObjects:
    """Return the same objects as if nobody had told their classes."""
    return replace(objects, objects=tuple(replace(o, object_class="") for o in objects.objects))


def planned(which: GraspPlanner, objects: RecognizedObjects) -> GraspPlan:
    which.start(objects)
    return which.plan("pouring")


@pytest.mark.parametrize("liked", ["mug", "bottle"])
def test_the_object_that_the_networks_prefer_is_chosen(
    database: ObjectDatabase, library: GraspLibrary, liked: str
) -> None:
    model = MadeUpModel({"mug": 0.6, "bottle": 0.6, liked: 0.9})
    plan = planned(planner(database, library, model), table(database, "mug_1", "bottle_2"))
    assert plan.objects[0].object_class == liked
    assert plan.grasps[0].object_id == plan.objects[0].id
    assert sum(choice.probability for choice in plan.objects) == pytest.approx(1.0)


def test_an_empty_table_is_another_answer_than_one_where_nothing_affords_the_task(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    robot = planner(database, library, MadeUpModel({"mug": 0.0, "bottle": 0.0, "glass": 0.0}))
    robot.start(table(database))
    empty = robot.plan("pouring")
    robot.start(table(database, "mug_1"))
    unfit = robot.plan("pouring")
    assert (empty.nothing_recognised, empty.nothing_affords) == (True, False)
    assert (unfit.nothing_recognised, unfit.nothing_affords) == (False, True)
    assert empty.refusal == "nothing was recognised on its table"
    assert unfit.refusal == "nothing on its table affords pouring"


def test_nothing_affords_the_task_where_all_objects_are_unlikely(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    model = MadeUpModel({"mug": 0.1, "bottle": 0.3})
    plan = planned(planner(database, library, model), table(database, "mug_1", "bottle_2"))
    assert plan.nothing_affords
    assert plan.grasps == ()


def test_grasps_are_ranked_by_the_networks_alone_if_stability_has_no_weight(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    model = MadeUpModel({"mug": 1.0}, wanted=np.array([1.0, 0.0, 0.0]))
    plan = planned(
        planner(database, library, model, stability_weight=0.0), table(database, "mug_1")
    )
    chances = [grasp.score_parts["task"] for grasp in plan.grasps]
    assert chances == sorted(chances, reverse=True)
    assert all(grasp.score == chance for grasp, chance in zip(plan.grasps, chances, strict=True))


def test_a_turned_table_gives_the_same_plan_turned(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"mug": 0.9, "bottle": 0.6}))
    plain, turned = (
        planned(which, table(database, "mug_1", "bottle_2", turn=turn)).grasps[0]
        for turn in (0.0, 0.8)
    )
    spin = make_pose(rotation_from_vector([0.0, 0.0, 0.8]), [0.08, 0.0, 0.0])
    np.testing.assert_allclose(turned.T_table_hand, spin @ plain.T_table_hand, atol=1e-9)


def test_no_planned_grasp_comes_nearer_to_table_or_neighbour_than_allowed(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    objects = table(database, "mug_1", "bottle_2")
    near = objects.objects[1].T_table_object.copy()
    near[0, 3] = 0.12
    crowded = replace(
        objects, objects=(objects.objects[0], replace(objects.objects[1], T_table_object=near))
    )
    model = MadeUpModel({"mug": 0.9, "bottle": 0.1})
    alone = planned(
        planner(database, library, model, grasps=250, table_gap=0.004), table(database, "mug_1")
    )
    both = planned(planner(database, library, model, grasps=250, table_gap=0.004), crowded)
    assert 0 < len(both.grasps) < len(alone.grasps)
    assert all(grasp.score_parts["clearance"] >= 0.004 for grasp in both.grasps)


def test_a_mug_upside_down_is_not_chosen_for_pouring(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    objects = table(database, "mug_1", "bottle_2")
    flipped = objects.objects[0].T_table_object @ make_pose(
        rotation_from_vector([np.pi, 0.0, 0.0]), np.zeros(3)
    )
    objects = replace(
        objects, objects=(replace(objects.objects[0], T_table_object=flipped), objects.objects[1])
    )
    plan = planned(planner(database, library, MadeUpModel({"mug": 0.9, "bottle": 0.6})), objects)
    assert plan.objects[0].id == "bottle_2"


def test_hidden_classes_are_not_given_to_the_networks(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    model = MadeUpModel({})
    planned(planner(database, library, model), unclassed(table(database, "mug_1")))
    assert model.seen
    assert all(classes == {""} for classes in model.seen)


def test_an_object_without_library_gets_grasps_that_say_they_are_unshaken(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"glass": 0.9}), unshaken=150)
    plan = planned(which, table(database, "glass_0"))
    assert plan.grasps
    assert not any(grasp.shaken for grasp in plan.grasps)


def test_objects_without_library_are_prepared_before_they_are_seen(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    models = [MadeUpModel({"glass": 0.9}) for _ in range(2)]
    prepared, late = (planner(database, library, model, unshaken=30) for model in models)
    prepared.prepare()
    asked = len(models[0].seen)
    glass = table(database, "glass_0")
    plans = [planned(which, glass) for which in (prepared, late)]
    assert asked == len(models[0].seen) > 0  # nothing was left to ask
    for early, first in zip(plans[0].grasps, plans[1].grasps, strict=True):
        np.testing.assert_array_equal(early.T_table_hand, first.T_table_hand)


def test_only_a_final_posterior_with_a_best_task_is_answered(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"mug": 0.9}))
    final = demo_records.posterior(7, preliminary=False)
    assert which.step(final) is None  # nothing recognised yet
    which.start(table(database, "mug_1"))
    assert which.step(demo_records.posterior(7, preliminary=True)) is None
    assert which.step(replace(final, best=None)) is None
    answer = which.step(final)
    assert answer is not None
    assert (answer.stamp, answer.task) == (7, "pouring")


def test_a_stable_grasp_is_answered_once_until_the_hand_reaches_anew(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"mug": 0.9}))
    which.start(table(database, "mug_1"))
    stamps = []
    for stamp, preliminary in ((1, True), (2, False), (3, False), (4, True), (5, False)):
        answer = which.step(demo_records.posterior(stamp, preliminary=preliminary))
        stamps += [answer.stamp] if answer is not None else []
    assert stamps == [2, 5]


def test_a_planner_that_comes_too_late_for_a_grasp_does_not_answer_its_motion(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"mug": 0.9}))
    which.start(table(database, "mug_1"))
    grasp = demo_records.posterior(7, preliminary=False)
    assert which.step(replace(grasp, stamp=9, stage="ACT")) is None
    assert which.step(grasp) is not None


def test_a_motion_that_means_something_else_overtakes_and_cancels(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    which = planner(database, library, MadeUpModel({"mug": 0.9}), acts_on="motion")
    which.start(table(database, "mug_1"))

    def said(stamp: int, best: str | None, *intends: float) -> Any:
        final = demo_records.posterior(stamp, preliminary=False)
        return which.step(replace(final, best=best, intends=np.array(intends), stage="ACT"))

    assert said(1, "pouring", 0.2, 0.5, 0.0, 0.1, 0.2).task == "pouring"
    assert said(2, "hand-over", 0.45, 0.4, 0.0, 0.0, 0.15) is None  # not by enough
    assert said(3, "hand-over", 0.7, 0.2, 0.0, 0.0, 0.1).task == "hand-over"
    word = said(4, None, 0.02, 0.0, 0.0, 0.0, 0.98)
    assert word.cancelled
    assert (word.task, word.grasps) == ("hand-over", ())
    assert said(5, None, 0.02, 0.0, 0.0, 0.0, 0.98) is None  # said once


def test_an_object_that_the_database_does_not_hold_is_ranked_last_and_never_chosen(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    objects = table(database, "mug_1")
    stranger = replace(objects.objects[0], id="vase", model="vase", object_class="vase")
    objects = replace(objects, objects=(stranger, *objects.objects))
    plan = planned(planner(database, library, MadeUpModel({"mug": 0.9, "vase": 1.0})), objects)
    assert [choice.id for choice in plan.objects] == ["mug_1", "vase"]
    assert not plan.objects[1].affords
    assert [choice.judged for choice in plan.objects] == [True, False]
    assert plan.objects[0].probability == pytest.approx(1.0)


def test_a_thing_of_no_class_has_no_probability_while_others_serve(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    objects = table(database, "mug_1", "bottle_2")
    items = (objects.objects[0], replace(objects.objects[1], object_class=""))
    which = planner(database, library, MadeUpModel({"mug": 0.9, "bottle": 0.9}))
    plan = planned(which, replace(objects, objects=items))
    assert [(choice.id, choice.judged) for choice in plan.objects] == [
        ("mug_1", True),
        ("bottle_2", False),
    ]
    assert np.isnan(plan.objects[1].probability)


def test_a_stored_library_gives_back_its_grasps(library: GraspLibrary, tmp_path: Path) -> None:
    library.save(tmp_path / "library.npz")
    again = GraspLibrary.load(tmp_path / "library.npz")
    assert again.hand == library.hand
    for name, grasps in library.sets.items():
        stored: GraspSet = again.sets[name]
        np.testing.assert_allclose(stored.T_object_hand, grasps.T_object_hand, atol=1e-6)
        np.testing.assert_allclose(stored.grasp_joints, grasps.grasp_joints, atol=1e-6)


def test_a_damaged_library_is_refused_with_the_remedy(
    library: GraspLibrary, tmp_path: Path
) -> None:
    path = tmp_path / "library.npz"
    library.save(path)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(ValueError, match="rebuild it"):
        GraspLibrary.load(path)


@pytest.mark.parametrize("bad", [{"minimum_grasp": 1.5}, {"grasps": 0}, {"stability_weight": -1.0}])
def test_impossible_settings_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        PlannerConfig(**bad)


def test_an_estimated_shape_is_planned_on_without_a_shake_test(
    database: ObjectDatabase, library: GraspLibrary
) -> None:
    known = ObjectDatabase(database.models)
    shape = replace(known["glass_0"], name="thing~0", functions=None)
    which = planner(known, library, MadeUpModel({"glass": 0.9}), unshaken=150)
    known.learn(shape)
    item = RecognizedObject("thing", "thing~0", "glass", shape.rest, 0.9, 0.9, shape)
    plan = planned(which, RecognizedObjects(0, (item,), np.eye(4)))
    assert [choice.id for choice in plan.objects] == ["thing"]
    assert plan.grasps
    assert not any(grasp.shaken for grasp in plan.grasps)
