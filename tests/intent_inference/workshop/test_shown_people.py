"""What rendered demonstrations show is in no training set."""

import numpy as np
import pytest

from intent_inference.workshop.evaluation.demonstration_maker import enough
from intent_inference.workshop.evaluation.shown_people import SHOWN, TIMES, stretched
from intent_inference.workshop.simulation.labels import TASKS
from intent_perception.objects.database import ObjectDatabase
from intent_perception.workshop.things.object_catalogue import MAKERS


@pytest.mark.parametrize("model_class", list(SHOWN))
def test_a_stretched_object_is_in_no_database_and_keeps_its_class(model_class: str) -> None:
    model = stretched(model_class, 3, np.random.default_rng(5), "unseen")
    assert model.object_class == model_class
    known = [other for other in ObjectDatabase.load().models if other.object_class == model_class]
    differences = [np.abs(other.size / model.size - 1.0).max() for other in known]
    assert min(differences) > 0.01


def test_functions_are_stretched_with_the_mesh() -> None:
    plain = MAKERS["mug"][3]()
    model = stretched("mug", 3, np.random.default_rng(5), "unseen")
    assert plain.functions.opening is not None
    assert model.functions is not None
    assert model.functions.opening is not None
    factor = np.ptp(model.mesh.vertices, axis=0) / np.ptp(plain.mesh.vertices, axis=0)
    assert model.functions.opening.radius == pytest.approx(
        factor[0] * plain.functions.opening.radius, rel=1e-6
    )


def test_every_person_shows_as_many_purposes() -> None:
    assert {sum(purposes.values()) for purposes in SHOWN.values()} == {TIMES}


def _grasp(object_class: str, afforded: str) -> dict[str, str | float | int]:
    return {"object_class": object_class, **{task: int(task == afforded) for task in TASKS}}


def test_demonstrations_are_enough_with_both_labels_of_every_task_in_its_classes() -> None:
    vessels = [_grasp("mug", task) for task in ("hand-over", "pouring", "dish-washing")]
    tools = [_grasp("knife", task) for task in ("hand-over", "tool-use")]
    assert enough([*vessels, *tools], 5, 1)
    assert not enough([*vessels, *tools], 6, 1)
    assert not enough([*vessels, *tools], 5, 2)
    assert not enough([*vessels, _grasp("knife", "tool-use")], 4, 1)  # only other classes do not
