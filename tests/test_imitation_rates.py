"""The imitation benchmark counts each rate over the tables where it means something."""

from dataclasses import replace

import pytest

from intent_imitation.benchmark import gain, rates
from intent_imitation.trials import Trial

CHOSEN = Trial(
    "pouring", True, False, False, False, 0.01,
    correct=True, class_only=False, held=True, rule=True, random_rule=0.5,
)  # fmt: skip
REFUSED = Trial("pouring", False, False, True, True, 0.01)


def test_choices_count_where_something_fits_and_refusals_where_nothing_does() -> None:
    wrong = replace(CHOSEN, correct=False, rule=False)
    found = rates([CHOSEN, wrong, REFUSED, replace(REFUSED, refused=False, held=True)])
    assert found["object_correct"] == pytest.approx(0.5)
    assert found["refusal_correct"] == pytest.approx(0.5)
    assert found["executed_hold"] == pytest.approx(1.0)
    assert found["executed_rule"] == pytest.approx(0.5)


def test_a_gain_is_what_is_won_of_what_chance_leaves_open() -> None:
    assert gain(0.9, 0.5) == pytest.approx(0.8)
    assert gain(0.5, 0.5) == pytest.approx(0.0)
    assert gain(0.9, None) is None
