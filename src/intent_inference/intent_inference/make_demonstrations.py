"""Command: renders and tracks demonstrations, one after the other, and keeps their features.

python -m intent_inference.make_demonstrations [--count 240] [--archive out/demonstrations]

Each demonstration is one file in the archive; those that are there are not made again, so that the
command can be stopped and started. It goes on until so many grasps were found. At the end the
shipped demonstrations.csv.gz and reaches.csv.gz are written from all files; `--count 0` only does
that.
"""

import argparse
import csv
import gzip
import io
import json
import sys
import time
from pathlib import Path

from intent_inference.evaluation.tracked import tracked_demonstration
from intent_inference.simulation.dataset import Row

_SHARE = Path(__file__).parent / "share" / "data"
_FIRST_SEED = 1000


def collect(archive: Path, folder: Path) -> tuple[int, int]:
    """Write the two tables from all files of an archive.

    Returns:
        Number of demonstrations with a grasp, and without.
    """
    grasps: list[Row] = []
    reaches: list[Row] = []
    missed = 0
    for path in sorted(archive.glob("*.json")):
        stored = json.loads(path.read_text())
        if stored["grasp"] is None:
            missed += 1
            continue
        grasps.append(stored["grasp"])
        reaches.extend(stored["reach"])
    if grasps:
        _write(folder / "demonstrations.csv.gz", grasps)
        _write(folder / "reaches.csv.gz", reaches)
    return len(grasps), missed


def _write(path: Path, rows: list[Row]) -> None:
    """Write rows as compressed CSV; equal rows give equal bytes."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({n: f"{v:.6g}" if _rounded(n, v) else v for n, v in row.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))


def _rounded(column: str, value: str | float | int) -> bool:
    return isinstance(value, float) and column != "stamp"


def _made(seed: int, archive: Path) -> bool:
    """Make the demonstration of a seed unless it is there; return whether its grasp was found."""
    path = archive / f"{seed}.json"
    if not path.is_file():
        started = time.process_time()
        made = tracked_demonstration(seed)
        text = json.dumps({"grasp": made.grasp, "reach": made.reach, "reason": made.reason})
        partial = path.with_suffix(".part")
        partial.write_text(text)
        partial.rename(path)
        seconds = time.process_time() - started
        print(f"{seed}: {made.reason or 'tracked'}, {seconds:.0f} s CPU", flush=True)
    return json.loads(path.read_text())["grasp"] is not None


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.make_demonstrations", description=__doc__
    )
    parser.add_argument("--count", type=int, default=240, help="grasps to be found")
    parser.add_argument("--first", type=int, default=_FIRST_SEED, help="first seed")
    parser.add_argument("--archive", type=Path, default=Path("out/demonstrations"))
    parser.add_argument("--out", type=Path, default=_SHARE, help="folder of the two tables")
    arguments = parser.parse_args(argv)
    arguments.archive.mkdir(parents=True, exist_ok=True)
    seed, tracked = arguments.first, 0
    while tracked < arguments.count:
        tracked += _made(seed, arguments.archive)
        seed += 1
    found, missed = collect(arguments.archive, arguments.out)
    print(f"{arguments.out}: {found} grasps, {missed} demonstrations without one")
    return 0


if __name__ == "__main__":
    sys.exit(main())
