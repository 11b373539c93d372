"""The counts of a table and its data card say what is in it."""

import numpy as np
import pytest

from intent_inference.workshop.simulation.data_card import write_data_card
from intent_inference.workshop.simulation.grasp_table import write_rows
from intent_inference.workshop.simulation.simulation_benchmark import (
    CELLS,
    rate_figures,
    table_figures,
)


def rows(count=120):
    """Return a table of mugs: every second is poured from, every third held by its handle."""
    return [
        {
            "object_id": f"mug_{k % 8}", "object_class": "mug", "hand-over": "", "tool-use": 0,
            "pouring": int(k % 2 == 0), "dish-washing": int(k == 0), "preshape": "power",
            "on_handle": int(k % 3 == 0), "margin_pouring": 1.0 if k % 2 == 0 else -0.3,
        }
        for k in range(count)
    ]  # fmt: skip


def test_counts_are_those_of_the_table(tmp_path):
    write_rows(tmp_path / "d.csv.gz", rows())
    figures = table_figures(tmp_path / "d.csv.gz")
    assert figures["positives"] == {
        "hand-over": 0, "pouring": 60, "tool-use": 0, "dish-washing": 1
    }  # fmt: skip
    assert figures["handle_share"] == pytest.approx(1 / 3)
    assert "pouring mug" not in figures["cells_short"]
    assert len(figures["cells_short"]) == len(CELLS) - 1


def test_the_data_card_counts_positives_negatives_and_margins(tmp_path):
    write_data_card(tmp_path, "human", rows(), [], "python -m intent_inference.simulate")
    card = (tmp_path / "human.md").read_text()
    assert "| pouring | 60 | 60 | 0.50 | 860 |" in card
    assert "| mug | 0 / 0 | 60 / 60 | 0 / 120 | 1 / 119 |" in card


@pytest.mark.slow
def test_rates_and_shares_are_consistent():
    figures = rate_figures("schunk", quick=True, seed=3)
    assert figures["shaken"] <= figures["tried"]
    assert 0.0 < figures["shake_pass"] <= 1.0
    assert figures["accepted_per_tried"] == pytest.approx(
        figures["shake_pass"] * figures["shaken"] / figures["tried"]
    )
    assert np.isfinite(figures["tried_per_cpu_s"])
