"""Modules that not every installation has: imported when first used, so `--help` needs none."""

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import Any

DEVELOPMENT = ("dask", "distributed", "manifold3d", "minisom", "pyagrum", "pybullet")
"""Modules of requirements-dev.txt, which the demo and the nodes do without."""


class LateModule:
    """Stands for a module and imports it with the first attribute that is asked of it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(import_module(self._name), attribute)
        setattr(self, attribute, value)
        return value


def need(*names: str) -> None:
    """Say before any work begins that a module is missing.

    Raises:
        ModuleNotFoundError: if one of the modules is not installed.
    """
    for name in names:
        if find_spec(name) is None:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def remedy(error: ModuleNotFoundError) -> str:
    """Return one sentence: what is missing and which command installs it."""
    name = (error.name or str(error)).partition(".")[0]
    develops = name in DEVELOPMENT
    if sys.prefix == sys.base_prefix:  # the system's own Python: a colcon workspace of the user's
        file = "requirements-dev.txt" if develops else "requirements-rosdep.txt"
        command = f"rosdep install, then pip install -r {file}"
    else:
        command = "scripts/setup.sh --dev" if develops else "scripts/setup.sh"
    return f"the Python module {name} is not installed; run {command}"
