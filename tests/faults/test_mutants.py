"""A small part of the laboratory: no damage ends in a traceback, a hang or a silent change."""

import pytest
from tests.faults import mutation
from tests.faults.laboratory import tried, warm
from tests.faults.outcome import BAD, Outcome
from tests.faults.subjects import SUBJECTS

pytestmark = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")

SEEDS = range(0, 152)


@pytest.fixture(scope="module", autouse=True)
def _warm() -> None:
    warm()


@pytest.mark.parametrize("number", range(len(SUBJECTS)))
def test_an_input_without_damage_is_used(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else every mutant would be refused, and nothing learnt."""
    for name in ("damaged_bytes", "damaged_text"):
        monkeypatch.setattr(mutation, name, lambda _, content: content)
    monkeypatch.setattr(mutation, "damaged_arrays", lambda _, arrays: mutation.packed(arrays))
    monkeypatch.setattr(mutation, "wild", lambda _, array: array)
    seeds = [number + k * len(SUBJECTS) for k in range(4)]
    assert Outcome.OK in [tried(seed)[0] for seed in seeds]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mutant_is_used_refused_or_left_out_and_counted(seed: int) -> None:
    outcome, text = tried(seed)
    assert outcome not in BAD, text
