"""A configuration dataclass tells its parameters, takes their values back and refuses bad ones."""

from dataclasses import dataclass, field
from typing import Any, Literal

import pytest

from intent_perception.basics.parameters import Checked, Range, parameters_of, with_values


@dataclass(frozen=True)
class Inner(Checked):
    """A part."""

    weights: tuple[float, ...] = (0.5, 1.0)
    """One for each term, 0..1e3."""


@dataclass(frozen=True)
class Outer(Checked):
    """A whole."""

    share: float = 0.2
    """Part of the image, 0..1."""
    count: int = 3
    size: int = 64
    """Side of a tile [pixels], 32..256, a multiple of 16."""
    file: str | None = None
    """Where to read; None: nowhere."""
    way: Literal["long", "short"] = "short"
    """Which way to go."""
    quick: bool = False
    """Whether to hurry."""
    inner: Inner = field(default_factory=Inner)


def test_the_line_below_a_field_is_its_description_and_holds_its_range() -> None:
    share, count, size, *_ = parameters_of(Outer())
    assert (share.description, share.range) == ("Part of the image, 0..1.", Range(0.0, 1.0))
    assert (count.description, count.range) == ("", None)
    assert size.range == Range(32, 256, 16)


def test_nested_configurations_get_dotted_names() -> None:
    names = [parameter.name for parameter in parameters_of(Outer(), "outer.")]
    assert names[:3] == ["outer.share", "outer.count", "outer.size"]
    assert names[-1] == "outer.inner.weights"


def test_values_come_back_in_the_types_of_the_fields() -> None:
    changed = with_values(Outer(), {"inner.weights": [1, 2], "file": "", "share": 1})
    assert changed == Outer(share=1.0, file=None, inner=Inner((1.0, 2.0)))
    assert isinstance(changed.share, float)


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [
        ({"share": 1.5}, "Outer: expected share in 0..1, got 1.5"),
        ({"share": float("nan")}, "expected share as a number in 0..1, got nan"),
        ({"share": "half"}, "expected share as a number in 0..1, got 'half'"),
        ({"size": 16}, "expected size in 32..256, a multiple of 16 [pixels], got 16"),
        ({"size": 100}, "expected size in 32..256, a multiple of 16 [pixels], got 100"),
        (
            {"size": True},
            "expected size as an integer in 32..256, a multiple of 16",
        ),
        (
            {"size": 64.0},
            "expected size as an integer in 32..256, a multiple of 16",
        ),
        ({"count": float("inf")}, "expected count as an integer, got inf"),
        ({"file": 3}, "expected file as a text, got 3"),
        ({"way": "none"}, "expected way as 'long' or 'short', got 'none'"),
        ({"quick": 1}, "expected quick as true or false, got 1"),
        (
            {"inner.weights": []},
            "Inner: expected weights as one or more numbers in 0..1000",
        ),
        ({"inner.weights": [1.0, -1.0]}, "expected weights as one or more numbers in 0..1000"),
        ({"inner.weights": "many"}, "expected weights as one or more numbers in 0..1000"),
    ],
    ids=str,
)
def test_a_bad_value_is_refused_in_one_sentence(bad: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError) as error:
        with_values(Outer(), bad)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_numbers_of_numpy_are_numbers() -> None:
    np = pytest.importorskip("numpy")
    assert Outer(share=np.float32(0.5), size=np.int64(96)) == Outer(0.5, size=96)
