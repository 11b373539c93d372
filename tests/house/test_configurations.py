"""Every configuration of every package: each number has a range and a reason, and keeps to it."""

import ast
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.conftest import ROOT

from intent_perception.basics.parameters import Checked, Kind, kinds_of, parameters_of

NEEDED: dict[str, dict[str, Any]] = {
    "CampaignConfig": {"hand": "schunk", "archive": Path("out")},
}
"""Values of the fields without a default."""


def config_classes() -> list[tuple[str, str]]:
    """Return (module, class) of everything in src that is called ...Config."""
    found = []
    for path in sorted((ROOT / "src").glob("*/*/**/*.py")):
        module = ".".join(path.relative_to(ROOT / "src").with_suffix("").parts[1:])
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and node.name.endswith("Config"):
                found.append((module, node.name))
    return found


CLASSES = config_classes()


@pytest.fixture(params=CLASSES, ids=[name for _, name in CLASSES])
def config(request: pytest.FixtureRequest) -> Any:
    """Every configuration with its defaults."""
    module, name = request.param
    if ".ros." in module:
        pytest.importorskip("intent_msgs", reason="run scripts/test.sh: it sources the workspace")
    return getattr(import_module(module), name)(**NEEDED.get(name, {}))


def numbers_of(config: Any) -> list[tuple[str, Kind]]:
    """Return the numeric fields of a configuration."""
    return [(name, kind) for name, kind in kinds_of(config).items() if kind.type in (int, float)]


def test_there_are_about_as_many_as_there_were() -> None:
    assert len(CLASSES) > 25


def test_every_parameter_has_a_reason_and_every_number_a_range(config: Any) -> None:
    assert isinstance(config, Checked)
    for parameter in parameters_of(config):
        words = parameter.description.replace(str(parameter.range), "").split()
        assert len(words) >= 3, f"{parameter.name}: what is it?"
        if parameter.kind.type in (int, float):
            assert parameter.range is not None, f"{parameter.name}: which values?"
            assert parameter.range.low < parameter.range.high


def test_parts_are_checked_themselves(config: Any) -> None:
    parts = [getattr(config, field.name) for field in fields(config)]
    assert all(isinstance(part, Checked) for part in parts if hasattr(part, "__dataclass_fields__"))


def test_values_just_outside_are_refused_by_name(config: Any) -> None:
    for name, kind in numbers_of(config):
        assert kind.range is not None
        low, high, step = kind.range.low, kind.range.high, kind.range.step
        outside: list[Any] = [float("nan"), float("inf"), True, "1", None]
        if kind.type is int:
            outside += [int(low) - step, int(high) + step, int(low) + 0.5]
            outside += [int(low) + 1] if step > 1 else []
        else:
            outside += [np.nextafter(low, -np.inf), np.nextafter(high, np.inf)]
        for value in outside:
            with pytest.raises(ValueError, match=rf"expected {name} "):
                replace(config, **{name: (value,) if kind.many else value})


def test_both_ends_are_inside(config: Any) -> None:
    for name, kind in numbers_of(config):
        assert kind.range is not None
        for end in map(kind.type, (kind.range.low, kind.range.high)):
            assert kind.allows((end,) if kind.many else end), name
