"""Command: renders and tracks demonstrations and keeps their features.

python -m intent_inference.make_demonstrations [--count 240] [--jobs 1] [--archive DIR]
python -m intent_inference.make_demonstrations --motions

Each demonstration is one file in the archive; those that are there are not made again, so that the
command can be stopped and started. It goes on, one person with one object after the other, until
so many grasps were found and every task has enough of them that afford it, and enough of the same
classes that do not. At the end the shipped demonstrations.csv.gz, reaches.csv.gz and motions.npz
are written from them; `--motions` writes the last alone, for the demonstrations that are there.
"""

import argparse
import csv
import gzip
import io
import json
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from intent_inference import SHARE
from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.evaluation.shown_motions import shown_motions
from intent_inference.workshop.evaluation.shown_people import TIMES
from intent_inference.workshop.evaluation.tracked_people import (
    TrackedDemonstration,
    tracked_demonstration,
)
from intent_inference.workshop.simulation.labels import TASKS
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.basics.checked_files import read_json
from intent_perception.basics.progress import ProgressBar
from intent_perception.basics.safe_files import write_arrays, write_bytes, write_text

_DATA = SHARE / "data"
_FIRST_SEED = 1000

Demonstration = dict[str, Any]
"""As it is stored: `grasp`, `reach` and `reason` of a `TrackedDemonstration`."""


def write_tables(made: Iterable[Demonstration], folder: Path) -> None:
    """Write the two tables of demonstrations: their grasps, and the reaches before them."""
    found = [own for own in made if own["grasp"] is not None]
    write_rows(folder / "demonstrations.csv.gz", [own["grasp"] for own in found])
    write_rows(folder / "reaches.csv.gz", [row for own in found for row in own["reach"]])


def enough(grasps: Sequence[Row], count: int, each: int) -> bool:
    """Return whether there are `count` grasps, and for each task `each` of either label.

    A grasp that does not afford a task counts only if one of the same class does: the class alone
    would tell the others.
    """
    if len(grasps) < count:
        return False
    for task in TASKS:
        afford = [own for own in grasps if own[task] == 1]
        classes = {own["object_class"] for own in afford}
        do_not = [own for own in grasps if own[task] == 0 and own["object_class"] in classes]
        if min(len(afford), len(do_not)) < each:
            return False
    return True


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as compressed CSV; equal rows give equal bytes."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({n: f"{v:.6g}" if _rounded(n, v) else v for n, v in row.items()})
    write_bytes(path, gzip.compress(text.getvalue().encode(), mtime=0))


def _write_motions(seeds: Sequence[str | float | int], folder: Path) -> None:
    write_arrays(folder / "motions.npz", shown_motions([int(seed) for seed in seeds]))


def _rounded(column: str, value: str | float | int) -> bool:
    return isinstance(value, float) and column != "stamp"


def _lesson(number: int, first: int, archive: Path) -> list[Demonstration]:
    """Return what one person shows of one object, from the archive where it is there."""
    seeds = range(number * TIMES, (number + 1) * TIMES)
    made = tracked_demonstration
    return [stored_demonstration(seed, archive, made) for seed in seeds if seed >= first]


def stored_demonstration(
    seed: int, archive: Path, make: Callable[[int], TrackedDemonstration]
) -> Demonstration:
    """Return the demonstration of a seed from the archive; it is made where it is not there."""
    path = archive / f"{seed}.json"
    if not path.is_file():
        started = time.process_time()
        made = make(seed)
        write_text(path, json.dumps(asdict(made)))
        seconds = time.process_time() - started
        print(f"{seed}: {made.reason or 'tracked'}, {seconds:.0f} s CPU", flush=True)
    stored: Demonstration = read_json(path)
    return stored


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.make_demonstrations",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--count", type=int, default=240, help="least number of grasps")
    parser.add_argument("--each", type=int, default=40, help="least number of each task's labels")
    parser.add_argument("--first", type=int, default=_FIRST_SEED, help="first seed")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--archive", type=Path, default=Path("out/demonstrations"))
    parser.add_argument("--out", type=Path, default=_DATA, help="folder of the two tables")
    parser.add_argument("--motions", action="store_true", help="write motions.npz alone")
    arguments = parser.parse_args(argv)
    if arguments.motions:
        table = read_grasps(arguments.out / "demonstrations.csv.gz")
        _write_motions(table.columns["demonstration"].tolist(), arguments.out)
        return 0
    arguments.archive.mkdir(parents=True, exist_ok=True)
    workers = Parallel(n_jobs=arguments.jobs, return_as="generator", pre_dispatch=arguments.jobs)
    lessons = workers(
        delayed(_lesson)(number, arguments.first, arguments.archive)
        for number in count(arguments.first // TIMES)
    )
    made: list[Demonstration] = []
    grasps: list[Row] = []
    with ProgressBar("grasp", arguments.count) as progress:
        for shown in lessons:
            made.extend(shown)
            grasps = [own["grasp"] for own in made if own["grasp"] is not None]
            progress.at(len(grasps), f"{len(made)} demonstrations")
            if enough(grasps, arguments.count, arguments.each):
                break
    with warnings.catch_warnings(action="ignore"):  # what the other processes began is not needed
        lessons.close()
    write_tables(made, arguments.out)
    _write_motions([row["demonstration"] for row in grasps], arguments.out)
    print(f"{arguments.out}: {len(grasps)} grasps, {len(made) - len(grasps)} without one")
    return 0
