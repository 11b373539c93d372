"""A configuration dataclass tells its parameters, and takes their values back."""

from dataclasses import dataclass, field

import pytest

from intent_perception.bags.frame_assembly import SynchroniserConfig
from intent_perception.basics.parameters import parameters_of, with_values


@dataclass(frozen=True)
class Inner:
    """A part."""

    weights: tuple[float, ...] = (0.5, 1.0)
    """One for each term."""


@dataclass(frozen=True)
class Outer:
    """A whole."""

    share: float = 0.2
    """Part of the image, 0..1."""
    count: int = 3
    file: str | None = None
    """Where to read; None: nowhere."""
    inner: Inner = field(default_factory=Inner)


def test_the_line_below_a_field_is_its_description_and_holds_its_range() -> None:
    share, count, *_ = parameters_of(Outer())
    assert (share.description, share.range) == ("Part of the image, 0..1.", (0.0, 1.0))
    assert (count.description, count.range) == ("", None)


def test_nested_configurations_get_dotted_names() -> None:
    names = [parameter.name for parameter in parameters_of(Outer(), "outer.")]
    assert names == ["outer.share", "outer.count", "outer.file", "outer.inner.weights"]


def test_values_come_back_in_the_types_of_the_fields() -> None:
    changed = with_values(Outer(), {"inner.weights": [1, 2], "file": "", "share": 1})
    assert changed == Outer(share=1.0, file=None, inner=Inner((1.0, 2.0)))


def test_a_refused_value_raises() -> None:
    with pytest.raises(ValueError, match="expected tolerance"):
        with_values(SynchroniserConfig(), {"tolerance": 1.0})
