"""Just enough of `launch` and `launch_ros` to read a launch file where neither is installed."""

import sys
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any


class Recorded:
    """Whatever a launch file makes, with the arguments it was given."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        self.arguments, self.named = arguments, named

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self.named[name]


@dataclass
class StandInContext:
    """The context in which a launch file is carried out."""

    chosen: dict[str, str] = field(default_factory=dict)
    is_shutdown: bool = False


class Configuration(Recorded):
    """Stands for LaunchConfiguration."""

    def perform(self, context: StandInContext) -> str:
        """Return what was chosen for an argument."""
        return context.chosen[self.arguments[0]]


def stand_ins() -> dict[str, ModuleType]:
    """Return the modules by name, to be put into sys.modules."""
    kinds = {
        "launch": ("LaunchContext", "LaunchDescription"),
        "launch.actions": (
            *("DeclareLaunchArgument", "EmitEvent", "LogInfo", "OpaqueFunction"),
            *("RegisterEventHandler", "SetEnvironmentVariable"),
        ),
        "launch.event_handlers": ("OnProcessExit",),
        "launch.events": ("Shutdown",),
        "launch.substitutions": (),
        "launch_ros": (),
        "launch_ros.actions": ("Node",),
    }
    modules = {name: ModuleType(name) for name in kinds}
    for name, classes in kinds.items():
        for kind in classes:
            setattr(modules[name], kind, type(kind, (Recorded,), {}))
    modules["launch.substitutions"].LaunchConfiguration = Configuration  # type: ignore[attr-defined]
    return modules


def read_launch_file(text: str, name: str) -> SimpleNamespace:
    """Return the names that a launch file defines, read with the stand-ins."""
    before = dict(sys.modules)
    sys.modules.update(stand_ins())
    try:
        names: dict[str, Any] = {"__name__": name}
        exec(compile(text, name, "exec"), names)
        return SimpleNamespace(**names)
    finally:
        for module in stand_ins():
            sys.modules.pop(module, None)
        sys.modules.update({m: before[m] for m in stand_ins() if m in before})
