"""What people of a class of things usually mean, and one person's habits."""

from pathlib import Path

import numpy as np

from intent_inference.intention.class_priors import ClassPriors

TASKS = ("hand-over", "pouring")


def test_habits_shift_the_priors_of_their_class_alone() -> None:
    before = ClassPriors({})
    after = before.after([("mug", "hand-over")] * 5, TASKS)
    assert after.of("mug", TASKS)[0] > np.log(0.5) > before.of("mug", TASKS)[0]
    np.testing.assert_array_equal(after.of("glass", TASKS), before.of("glass", TASKS))


def test_habits_seen_one_after_the_other_count_as_if_seen_together() -> None:
    shown = [("mug", "hand-over")] * 7
    apart = ClassPriors({}).after(shown[:3], TASKS).after(shown[3:], TASKS)
    together = ClassPriors({}).after(shown, TASKS)
    np.testing.assert_allclose(apart.of("mug", TASKS), together.of("mug", TASKS))


def test_priors_of_a_person_are_read_back(tmp_path: Path) -> None:
    habits = ClassPriors({}).after([("mug", "pouring")], TASKS)
    habits.save(tmp_path / "person.yaml")
    again = ClassPriors.load(tmp_path / "person.yaml")
    np.testing.assert_allclose(again.of("mug", TASKS), habits.of("mug", TASKS))
