"""An installation without what only set-up's --dev installs."""

import os
from pathlib import Path

from tests.conftest import ROOT

from intent_perception.basics.late_module import DEVELOPMENT

_HIDING = f"""
import sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {DEVELOPMENT!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Hidden())
"""


def plain_environment(folder: Path) -> dict[str, str]:
    """Return the environment of a Python that finds no module of requirements-dev.txt.

    Args:
        folder: empty, for what hides them.
    """
    (folder / "sitecustomize.py").write_text(_HIDING)
    paths = [str(folder), *map(str, (ROOT / "src").glob("intent_*"))]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
