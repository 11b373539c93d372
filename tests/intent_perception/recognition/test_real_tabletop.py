"""Ten real frames of things that nobody modelled (INTENT_DATA); no pixel of them was fitted to."""

from pathlib import Path

import pytest

from intent_perception.workshop.figures.benchmark_plan import Plan
from intent_perception.workshop.figures.benchmark_unseen import real_tabletop

pytestmark = pytest.mark.slow


def test_mugs_and_the_bottle_are_told_and_boxes_bowls_and_cans_are_none(real_data: Path) -> None:
    figures = real_tabletop(Plan(1000, 1, 1, 1, real_data, None))
    if figures is None:
        pytest.skip("no real frames of single things in INTENT_DATA")
    assert figures["mugs_right"] == 2
    assert figures["bottle_right"] == 1
    assert figures["false_class"] <= 1
    assert figures["reported"] >= 9
    assert figures["residual_mm_median"] < 5.0
    assert figures["handle_deg_max"] < 25.0
