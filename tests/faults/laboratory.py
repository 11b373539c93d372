"""Many seeded mutants, each in a process of its own: a table of what became of them.

    python -m tests.faults.laboratory [--seeds 0:200] [--only NAME] [--list]

Seeds below 1000 are for development; figures are reported over 1000:1800.
"""

import argparse
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from tests.faults.outcome import BAD, Outcome, Subject
from tests.faults.subjects import SUBJECTS

_CPU, _WALL = 10, 40
"""Longest CPU time of a mutant, and longest wait for one on a busy machine [s]."""
_LOOK = 0.002
"""Time between two looks at a mutant [s]. Looks are counted, not read off a clock: while the whole
machine stands still, nobody hangs."""
_MEMORY = 6 << 30


def subject_of(seed: int) -> Subject:
    """Return which kind of input a seed damages: each in turn."""
    return SUBJECTS[seed % len(SUBJECTS)]


def tried(seed: int) -> tuple[Outcome, str]:
    """Return what became of the mutant of a seed, and the words about it."""
    with tempfile.TemporaryDirectory(prefix="mutant-") as name:
        return in_process(lambda: _used(seed, Path(name)))


def _used(seed: int, folder: Path) -> tuple[Outcome, str]:
    subject = subject_of(seed)
    path = subject.make(np.random.default_rng(seed), folder)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            answer = subject.use(path)
    except ValueError as error:
        text = str(error)
        one = bool(text) and len(text.strip().splitlines()) == 1 and len(text) < 1200
        return (Outcome.REFUSED if one else Outcome.UNCLEAR), text
    except Exception:
        return Outcome.TRACEBACK, traceback.format_exc()
    if not answer.sane:
        return Outcome.ALTERED, ""
    return (Outcome.LEFT_OUT if answer.left_out else Outcome.OK), ""


def in_process(work: Callable[[], tuple[Outcome, str]]) -> tuple[Outcome, str]:
    """Return the result of work in a child with limits; its death is a result too."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        resource.setrlimit(resource.RLIMIT_CPU, (_CPU, _CPU + 2))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115
        outcome, text = work()
        os.write(writing, f"{outcome.name}\n{text}".encode("utf-8", "replace")[:60_000])
        os._exit(0)
    os.close(writing)
    status, looks = None, 0
    while status is None and looks < _WALL / _LOOK:
        looks += 1
        done, code = os.waitpid(child, os.WNOHANG)
        if done:
            status = code
        else:
            time.sleep(_LOOK)
    if status is None:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    with open(reading, "rb") as pipe:
        name, _, text = pipe.read().decode().partition("\n")
    if status is None or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU):
        return Outcome.HANG, f"more than {_CPU} s of CPU time or {_WALL} s"
    if not name:
        return Outcome.DEATH, f"status {status}"
    return Outcome[name], text


def table(results: Iterable[tuple[int, Outcome, str]]) -> str:
    """Return the counts of each outcome for each subject as lines."""
    counts = Counter((subject_of(seed).name, outcome) for seed, outcome, _ in results)
    names = [subject.name for subject in SUBJECTS]
    shown = [o for o in Outcome if o not in BAD] + list(BAD)
    heads = ["ok", "refused", "left out", *(o.name for o in BAD)]
    lines = [f"{'':22s}" + "".join(f"{head:>11s}" for head in heads)]
    for name in [*names, "all"]:
        own = [sum(counts[n, o] for n in (names if name == "all" else [name])) for o in shown]
        lines.append(f"{name:22s}" + "".join(f"{count:11d}" for count in own))
    return "\n".join(lines)


def warm() -> None:
    """Import and compile in the parent what every child needs."""
    for seed in range(len(SUBJECTS)):
        with tempfile.TemporaryDirectory() as name:
            _used(seed, Path(name))


def main() -> None:
    """Print the table and every outcome that must not be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:200", help="first:end")
    parser.add_argument("--only", default="", help="subjects whose name holds this")
    parser.add_argument("--list", action="store_true", help="every mutant with its words")
    options = parser.parse_args()
    first, end = map(int, options.seeds.split(":"))
    warm()
    results = []
    for seed in range(first, end):
        if options.only not in subject_of(seed).name:
            continue
        began = time.monotonic()
        outcome, text = tried(seed)
        results.append((seed, outcome, text))
        if outcome in BAD or options.list:
            seconds = time.monotonic() - began
            name = subject_of(seed).name
            sys.stdout.write(f"{seed} {name}: {outcome} ({seconds:.1f} s) {text}\n")
    sys.stdout.write(table(results) + "\n")
    sys.exit(any(outcome in BAD for _, outcome, _ in results))


if __name__ == "__main__":
    main()
