"""Which files the demo writes, and the folder that it writes them into.

    python -m intent_imitation.demo.result_files DIR

removes the files of an earlier run from DIR, or refuses where somebody else's are in the way:
`scripts/demo.sh` asks before it starts any node.
"""

import sys
from pathlib import Path

from intent_perception.basics.own_folder import OwnFolder

RESULT = "result.json"
_PICTURES = ("objects", "tracking", "posterior", "evidence", "robot_objects", "grasp", "flow")
FILES = (RESULT, "report.html", *(f"{name}.png" for name in _PICTURES))
"""All that the demo writes."""


def results_folder(path: Path) -> OwnFolder:
    """Return the folder of the results without those of an earlier run.

    Raises:
        ValueError: if it holds a file of these names that no run has written.
    """
    folder = OwnFolder(path)
    folder.clear(FILES)
    return folder


if __name__ == "__main__":
    try:
        results_folder(Path(sys.argv[1]))
    except ValueError as error:
        raise SystemExit(f"error: {error}") from None
