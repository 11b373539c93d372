"""A frozen dataclass read as a table of parameters: default, description and range of each.

The line under a field is its description; "0..0.1", "1..100" or "32..256, a multiple of 16" in it
is its range, both ends included. A class that inherits `Checked` refuses all other values.
"""

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from itertools import pairwise
from numbers import Integral, Real
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

_NUMBER = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
_RANGE = re.compile(rf"{_NUMBER}\.\.{_NUMBER}(?:, a multiple of (\d+))?")
_UNIT = re.compile(r" \[[^\]]+\]")
_ARTICLES = {int: "an integer", float: "a number", bool: "true or false", str: "a text"}


@dataclass(frozen=True)
class Range:
    """The numbers that a parameter may be."""

    low: float
    high: float
    step: int = 1
    """Integers must be a multiple of this."""

    def __contains__(self, value: Any) -> bool:
        return self.low <= value <= self.high and (self.step == 1 or value % self.step == 0)

    def __str__(self) -> str:
        multiple = f", a multiple of {self.step}" if self.step > 1 else ""
        return f"{self.low:.10g}..{self.high:.10g}{multiple}"


@dataclass(frozen=True)
class Kind:
    """What a field of a configuration may hold."""

    type: Any
    """bool, int, float or str, of tuples that of their elements; None: no parameter."""
    many: bool
    """Whether it is a tuple."""
    optional: bool
    """Whether it may be None."""
    choices: tuple[str, ...]
    """The texts that it may be; empty: any."""
    range: Range | None
    description: str

    def expected(self, value: Any) -> str:
        """Return "in 1..9" or "as an integer in 1..9": what a value that is refused should be."""
        if self.choices:
            return f"as {' or '.join(map(repr, self.choices))}"
        unit = _UNIT.search(self.description)
        within = f" in {self.range}{unit[0] if unit else ''}" if self.range else ""
        if self.many:
            return f"as one or more numbers{within}"
        bare = self.range and replace(self, range=None).allows(value)
        return within[1:] if bare else f"as {_ARTICLES[self.type]}{within}"

    def allows(self, value: Any) -> bool:
        """Return whether the field may hold a value."""
        if value is None:
            return self.optional
        if not self.many:
            return self._allows_one(value)
        filled = isinstance(value, tuple) and (len(value) > 0 or self.range is None)
        return filled and all(map(self._allows_one, value))

    def _allows_one(self, value: Any) -> bool:
        if self.type not in (int, float):
            return isinstance(value, self.type) and (not self.choices or value in self.choices)
        number = Integral if self.type is int else Real
        if not isinstance(value, number) or isinstance(value, bool) or not math.isfinite(value):
            return False
        return self.range is None or value in self.range


class Checked:
    """A configuration that refuses values out of range or of another type when it is made."""

    def __post_init__(self) -> None:
        check(self)


def check(config: Any) -> None:
    """Refuse a configuration with a value out of range, of another type, NaN or infinite.

    Raises:
        ValueError: that names the parameter, what it may be and what it is.
    """
    for name, kind in kinds_of(config).items():
        if kind.type is not None and not kind.allows(value := getattr(config, name)):
            raise ValueError(f"{type(config).__name__}: {refusal(name, kind, value)}")


def refusal(name: str, kind: Kind, value: Any) -> str:
    """Return the sentence about a value that a field must not hold."""
    return f"expected {name} {kind.expected(value)}, got {value!r}"


@dataclass(frozen=True)
class Parameter:
    """One field of a configuration, nested ones with a dot in the name."""

    name: str
    default: Any
    kind: Kind

    @property
    def description(self) -> str:
        """What it is, with its unit and range."""
        return self.kind.description

    @property
    def range(self) -> Range | None:
        """Which numbers it may be."""
        return self.kind.range


def parameters_of(config: Any, prefix: str = "") -> Iterator[Parameter]:
    """Yield the parameters of a configuration dataclass in the order of its fields."""
    kinds = kinds_of(config)
    for field in fields(config):
        value, name = getattr(config, field.name), f"{prefix}{field.name}"
        if is_dataclass(value):
            yield from parameters_of(value, f"{name}.")
        elif kinds[field.name].type is not None:  # arrays and models are no parameters
            yield Parameter(name, value, kinds[field.name])


def with_values(config: Any, values: dict[str, Any], prefix: str = "") -> Any:
    """Return the configuration with some parameters replaced, by their dotted names.

    Raises:
        ValueError: if the configuration refuses a value.
    """
    changed: dict[str, Any] = {}
    for field in fields(config):
        name, value = f"{prefix}{field.name}", getattr(config, field.name)
        if is_dataclass(value):
            changed[field.name] = with_values(value, values, f"{name}.")
        elif name in values:
            changed[field.name] = as_field(kinds_of(config)[field.name], values[name])
    return replace(config, **changed)


def as_field(kind: Kind, value: Any) -> Any:
    """Return a ROS value as a field holds it: a list is a tuple, 1 is 1.0, "" may be None."""
    if kind.optional and not value:
        return None
    if kind.many and not isinstance(value, str) and hasattr(value, "__iter__"):
        return tuple(float(item) if kind.type is float else item for item in value)
    return float(value) if kind.type is float and type(value) is int else value


def kinds_of(config: Any) -> dict[str, Kind]:
    """Return what each field of a configuration may hold."""
    own: Any = type(config)
    return _kinds(own)


@cache
def _kinds(config: Any) -> dict[str, Kind]:
    hints, descriptions = get_type_hints(config), _descriptions(config)
    return {f.name: _kind(hints[f.name], descriptions.get(f.name, "")) for f in fields(config)}


def _kind(hint: Any, description: str) -> Kind:
    members = get_args(hint)
    optional = NoneType in members
    if optional:
        hint = next(member for member in members if member is not NoneType)
    many = get_origin(hint) is tuple
    if many:
        hint = get_args(hint)[0]
    choices: tuple[str, ...] = get_args(hint) if get_origin(hint) is Literal else ()
    known = str if choices else hint if hint in _ARTICLES else None
    found = _RANGE.search(description) if known in (int, float) else None
    bounds = Range(float(found[1]), float(found[2]), int(found[3] or 1)) if found else None
    return Kind(known, many, optional, choices, bounds, description)


def _descriptions(kind: type) -> dict[str, str]:
    """Return the string that stands right below each field of a class."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__[:-1]):
        tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
        body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
        for field, below in pairwise(body):
            if (
                isinstance(field, ast.AnnAssign)
                and isinstance(field.target, ast.Name)
                and isinstance(below, ast.Expr)
                and isinstance(below.value, ast.Constant)
                and isinstance(below.value.value, str)
            ):
                found[field.target.id] = " ".join(below.value.value.split())
    return found
