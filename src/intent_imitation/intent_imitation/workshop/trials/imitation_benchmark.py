"""Figures of goal-directed imitation over random tables, as JSON.

python -m intent_imitation.benchmark [--part P] [--seed S] [--quick] [--json F] [--pictures DIR]
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from intent_imitation.planner.grasp_library import GraspLibrary
from intent_imitation.workshop.trials.network_grasps import compared
from intent_imitation.workshop.trials.trials import TASKS, Laboratory, TableTrial, run_trial
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.network.model_file import shipped_model
from intent_perception.basics.late_module import need
from intent_perception.basics.progress import counted
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.objects.database import ObjectDatabase
from intent_perception.workshop.figures.machine import machine

_TABLES, _FEW = 200, 24
_REPORTED = 20
_SHOWN = ("object_correct", "refusal_correct", "executed_hold", "executed_rule")
_COPIED = 12
"""Of this many tables in a row, one of each task is also answered by copying the human."""


def choices(seed: int, quick: bool, pictures: Path | None) -> dict[str, Any]:
    """Return the figures of the contract over random tables."""
    laboratory = Laboratory(seed, pictures)
    rng = np.random.default_rng(seed)
    trials = []
    for number in counted("table", range(_FEW if quick else _TABLES)):
        scene = laboratory.maker.make(TASKS[number % len(TASKS)], rng)
        trials.append(run_trial(laboratory, scene, rng, copying=number % _COPIED < len(TASKS)))
        if number % _REPORTED == _REPORTED - 1:
            so_far = {name: rates(trials)[name] for name in _SHOWN}
            print(f"{number + 1} tables: {so_far}", file=sys.stderr, flush=True)
    return {
        **rates(trials),
        "planning_ms_median": 1e3 * float(np.median([t.seconds for t in trials])),
        "unseen": {
            **rates([t for t in trials if t.unseen]),
            # Who refuses chooses no object: here the table decides.
            "refusal_correct": share(t.refused for t in trials if t.strange and not t.fitting),
        },
        "tasks": {task: rates([t for t in trials if t.task == task]) for task in TASKS},
    }


def rates(trials: Sequence[TableTrial]) -> dict[str, Any]:
    """Return the figures over some trials; None where nothing counts."""
    fitting = [t for t in trials if t.fitting]
    empty = [t for t in trials if not t.fitting]
    rule = share(t.rule for t in trials)
    random_rule = share(t.random_rule for t in trials)
    return {
        "scenes": len(trials),
        "scenes_fitting": len(fitting),
        "object_correct": share(t.correct for t in fitting),
        "object_correct_class_only": share(t.class_only for t in fitting),
        "object_correct_class_guessed": share(t.class_guessed for t in fitting),
        "refusal_correct": share(t.refused for t in empty),
        "executed_hold": share(t.held for t in trials),
        "executed_rule": rule,
        "executed_rule_random": random_rule,
        "executed_rule_gain": gain(rule, random_rule),
        "copied": sum(t.copied_rule is not None for t in trials),
        "copy_human_rule": share(t.copied_rule for t in trials),
        "copy_human_hold": share(t.copied_held for t in trials),
    }


def gain(rate: float | None, chance: float | None) -> float | None:
    """Return how much of what chance leaves open a rate has won, (r - r0) / (1 - r0)."""
    if rate is None or chance is None or chance >= 1.0:
        return None
    return (rate - chance) / (1.0 - chance)


def share(values: Iterable[bool | float | None]) -> float | None:
    """Return the mean of the values that are known."""
    known = [float(value) for value in values if value is not None]
    return float(np.mean(known)) if known else None


def inferred(seed: int, quick: bool, _: Path | None) -> dict[str, Any]:
    """Return how grasps read off BN^R fare against preplanned ones, on objects drawn at random."""
    library, database = GraspLibrary.load(), ObjectDatabase.load()
    rng = np.random.default_rng(seed)
    names = rng.permutation(sorted(library.sets))[: 4 if quick else 16]
    hand, model = GraspingHand.load(library.hand), shipped_model(library.hand)
    return {"inferred": compared(model, hand, library, [database[str(name)] for name in names])}


def realtime(_seed: int, quick: bool, _: Path | None) -> dict[str, Any]:
    """Return how the running graph keeps up; None where no ROS is installed and built."""
    command = [sys.executable, "-m", "intent_imitation.workshop.trials.realtime"]
    command += ["--quick"] if quick else []
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        return {"realtime": None}
    return {"realtime": json.loads(done.stdout.strip().splitlines()[-1])}


PARTS: dict[str, Callable[[int, bool, Path | None], dict[str, Any]]] = {
    "choices": choices,
    "inferred": inferred,
    "realtime": realtime,
}


def main() -> None:
    """Run the benchmark and write its figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--part", choices=sorted(PARTS), default=None)
    parser.add_argument("--seed", type=int, default=0, help="from 1000 on: for reports")
    parser.add_argument("--quick", action="store_true", help="a tenth of the tables")
    parser.add_argument("--pictures", type=Path, default=None, help="folder for picture strips")
    parser.add_argument("--json", type=output_file, default="-", help="file, - = print")
    arguments = parser.parse_args()
    if arguments.part != "realtime":
        need("pybullet")
    started, cpu = time.perf_counter(), time.process_time()
    figures: dict[str, Any] = {"machine": machine(), "seed": arguments.seed}
    for name in [arguments.part] if arguments.part else PARTS:
        figures.update(PARTS[name](arguments.seed, arguments.quick, arguments.pictures))
    figures["seconds"] = time.perf_counter() - started
    figures["cpu_seconds"] = time.process_time() - cpu
    write_json(arguments.json, figures, indent=2)
