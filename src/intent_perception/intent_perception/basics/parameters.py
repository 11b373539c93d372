"""A frozen dataclass read as a table of parameters: name, default, description and range of each.

The line under a field is its description; "0..0.1" or "1..100" in it is its range.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise
from typing import Any

_RANGE = re.compile(r"(-?\d+(?:\.\d+)?)\.\.(-?\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Parameter:
    """One field of a configuration, nested ones with a dot in the name."""

    name: str
    default: Any
    description: str
    range: tuple[float, float] | None


def parameters_of(config: Any, prefix: str = "") -> Iterator[Parameter]:
    """Yield the parameters of a configuration dataclass in the order of its fields."""
    descriptions = _descriptions(type(config))
    for field in fields(config):
        value, name = getattr(config, field.name), f"{prefix}{field.name}"
        if is_dataclass(value):
            yield from parameters_of(value, f"{name}.")
            continue
        if not isinstance(value, bool | int | float | str | tuple) and value is not None:
            continue  # arrays and models are no parameters
        text = descriptions.get(field.name, "")
        found = _RANGE.search(text) if isinstance(value, int | float) else None
        bounds = (float(found[1]), float(found[2])) if found else None
        yield Parameter(name, value, text, bounds)


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
            changed[field.name] = _like(value, values[name])
    return replace(config, **changed)


def _like(default: Any, value: Any) -> Any:
    """Return a ROS value in the type of the field."""
    if default is None:
        return value or None
    if isinstance(default, tuple):
        kind = type(default[0]) if default else str
        return tuple(kind(item) for item in value)
    return type(default)(value)


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
