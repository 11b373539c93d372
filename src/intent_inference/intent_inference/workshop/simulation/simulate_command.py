"""Command: simulate grasps of a hand on objects and write them as a labelled table.

    python -m intent_inference.simulate --hand human --out human.csv.gz

An interrupted run is continued by the same command; `--relabel` renews features and labels of the
archived grasps without simulating. `--backend dask --scheduler tcp://…` (or ray) spreads the
objects over a cluster; locally, `--jobs` sets the number of processes.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

from intent_inference.quantisation.grasp_cells import Row
from intent_inference.workshop.simulation.campaign import (
    BACKENDS,
    SETTINGS,
    CampaignConfig,
    Progress,
    all_rows,
    distinct_held,
    generate_all,
    object_models,
    settings,
)
from intent_inference.workshop.simulation.grasp_table import write_rows
from intent_inference.workshop.simulation.labels import TASKS
from intent_perception.basics.late_module import need
from intent_perception.basics.progress import ProgressBar
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.geometry.coded_images import write_picture


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    options = _parser().parse_args(arguments)
    try:
        summary = simulate(options)
    except ValueError as error:
        print(f"simulate: {error}", file=sys.stderr)
        return 2
    if options.json:
        write_json(options.json, summary, indent=1)
    return 0 if summary["rows"] else 1


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """Generate what is missing, write the table and the contact sheets; return counts.

    Raises:
        ValueError: if an option, the hand or the database is not usable, with the reason.
    """
    config = CampaignConfig(
        options.hand,
        Path(options.archive),
        options.models,
        options.per_object,
        options.rounds,
        options.seed,
        settings(Path(options.settings)),
    )
    names = [model.name for model in object_models(config.models)]
    wanted = options.objects.split(",") if options.objects else names
    if unknown := [name for name in wanted if name not in names]:
        raise ValueError(f"expected objects of the database, got {unknown}")
    refused = {}
    if not options.relabel:
        need("pybullet")
        client = _connected(options)
        with ProgressBar("object", len(wanted)) as bar:

            def report(progress: Progress) -> None:
                _report(progress)
                bar.advance(progress.name)

            for progress in generate_all(config, wanted, options.jobs, options.backend, report):
                if progress.problem:
                    refused[progress.name] = progress.problem
        if client is not None:
            client.close()
    rows = all_rows(config, wanted, options.jobs)
    write_rows(Path(options.out), rows)
    if options.card:
        _write_sheets(config, wanted, Path(options.card) / "sheets")
        _write_card(config, wanted, rows, options)
    return {"hand": config.hand, "rows": len(rows), "refused": refused, **_counts(rows)}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hand", required=True, help="human, schunk or a YAML file")
    parser.add_argument("--models", help="object database (default: the shipped 48)")
    parser.add_argument("--out", type=output_file, required=True, help="table, .csv or .csv.gz")
    parser.add_argument("--objects", help="only these, separated by commas")
    parser.add_argument("--archive", default="out/simulation", help="folder of the raw grasps")
    parser.add_argument("--per-object", type=int, default=100, help="grasps that hold, per object")
    parser.add_argument("--rounds", type=int, default=400, help="at most, per object")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--backend", choices=BACKENDS, default="loky")
    parser.add_argument("--scheduler", help="address of a Dask scheduler")
    parser.add_argument("--settings", default=str(SETTINGS), help="YAML of shake and filter")
    parser.add_argument("--relabel", action="store_true", help="renew labels, simulate nothing")
    parser.add_argument("--card", help="folder for a data card and pictures per class and task")
    parser.add_argument("--json", type=output_file, help="file for the counts, - = print")
    return parser


def _report(progress: Progress) -> None:
    what = f"refused: {progress.problem}" if progress.problem else f"{progress.held} grasps hold"
    print(f"{progress.name}: {what}, {progress.seconds:.0f} CPU s", file=sys.stderr, flush=True)


def _connected(options: argparse.Namespace) -> Any:
    """Return a client of the Dask cluster, or None for the other backends."""
    if options.backend != "dask":
        return None
    from distributed import Client

    return Client(options.scheduler) if options.scheduler else Client(processes=True)


def _counts(rows: list[Row]) -> dict[str, Any]:
    """Return positives per task, and positives and negatives per class and task."""
    cells: dict[str, dict[str, list[int]]] = {task: {} for task in TASKS}
    for row in rows:
        for task in TASKS:
            if row[task] != "":
                cell = cells[task].setdefault(str(row["object_class"]), [0, 0])
                cell[0 if row[task] == 1 else 1] += 1
    positives = {task: sum(cell[0] for cell in cells[task].values()) for task in TASKS}
    return {"positives": positives, "cells": cells}


def _write_card(
    config: CampaignConfig, names: list[str], rows: list[Row], options: argparse.Namespace
) -> None:
    from intent_inference.workshop.simulation.data_card import write_data_card

    command = (
        f"python -m intent_inference.simulate --hand {options.hand} --per-object "
        f"{options.per_object} --rounds {options.rounds} --seed {options.seed} "
        f"--out {Path(options.out).name}"
    )
    archives = [config.path_of(name) for name in names]
    write_data_card(Path(options.card), Path(config.hand).stem, rows, archives, command)


def _write_sheets(config: CampaignConfig, names: list[str], folder: Path) -> None:
    """Write one picture per class and task that can be afforded."""
    from intent_inference.grasping.grasping_hand import GraspingHand
    from intent_inference.grasping.task_object import TaskObject
    from intent_inference.workshop.simulation.contact_sheet import task_sheet

    hand = GraspingHand.load(config.hand)
    models = [model for model in object_models(config.models) if model.name in names]
    folder.mkdir(parents=True, exist_ok=True)
    for kind in dict.fromkeys(model.object_class for model in models):
        members = [m for m in models if m.object_class == kind and config.path_of(m.name).is_file()]
        targets = {model.name: TaskObject(model) for model in members}
        grasps = [grasp for name in targets for grasp in distinct_held(config.path_of(name))]
        for task in TASKS:
            sheet = task_sheet(targets, hand, grasps, kind, task)
            if sheet is not None:
                path = folder / f"{hand.name}_{kind}_{task}.jpg"
                write_picture(path, sheet, quality=80)
