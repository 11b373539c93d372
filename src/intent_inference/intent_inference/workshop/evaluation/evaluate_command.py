"""Command: how well do networks trained on a table of grasps infer its tasks?

python -m intent_inference.evaluate --data D.csv.gz [--group object_id] [--observe O,A]
    [--trials 30] [--json FILE] [--figures DIR] [--demonstrations DIR]
"""

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from intent_inference.network.model_file import shipped_model
from intent_inference.quantisation.feature_table import select_variables
from intent_inference.quantisation.variables import ACTION, CONSTRAINT, OBJECT, VARIABLES
from intent_inference.workshop.evaluation.demonstration_scores import demonstration_figures
from intent_inference.workshop.evaluation.evaluation_report import ReportConfig, evaluation_report
from intent_inference.workshop.evaluation.protocol import ProtocolConfig
from intent_inference.workshop.training.labelled_table import GraspTable, read_grasps
from intent_perception.basics.safe_files import output_file, write_text

_GROUPS = {"O": OBJECT, "A": ACTION, "C": CONSTRAINT}


def observed_variables(text: str) -> tuple[str, ...]:
    """Return the variables of a list such as "O,A" or "obcl,size,npos"; empty: all.

    Raises:
        ValueError: for a name that is neither a group nor a variable of Table I.
    """
    if not text:
        return VARIABLES
    chosen: list[str] = []
    for item in text.split(","):
        names = _GROUPS.get(item.strip(), (item.strip(),))
        chosen.extend(names)
    unknown = [name for name in chosen if name not in VARIABLES]
    if unknown:
        raise ValueError(f"observe: expected O, A, C or names of {VARIABLES}, got {unknown}")
    return tuple(chosen)


def restricted(table: GraspTable, variables: tuple[str, ...]) -> GraspTable:
    """Return the table with only the given variables; the class stays readable as a column."""
    features = select_variables(table.features, variables)
    if not features:
        raise ValueError(f"expected at least one of {variables} in the data")
    return replace(table, features=features)


def print_report(report: dict[str, Any]) -> None:
    """Print Table II and the areas under the curves."""
    print(
        f"{'task':14s} {'pos.':>6s} {'neg.':>6s} {'used':>6s}   AUC full / partial / within class"
    )
    for task, counts in report["table_2"].items():
        own = report["tasks"][task]
        line = f"{task:14s} {counts['positives']:6d} {counts['negatives']:6d}"
        line += f" {2 * counts['balanced']:6d}  "
        for mask in ("full", "partial"):
            if mask in own["auc"]:
                line += f" {own['auc'][mask]['mean']:.3f}±{2 * own['auc'][mask]['sd']:.3f}"
        if "full" in own["auc_within_class"]:
            line += f"  {own['auc_within_class']['full']:.3f}"
        print(line)
    for method, masks in report["auc_mean"].items():
        values = ", ".join(f"{mask} {value['auc']:.3f}" for mask, value in masks.items())
        print(f"mean AUC, {method}: {values}")


def judge_demonstrations(report: dict[str, Any], folder: Path, seed: int) -> None:
    """Add what the shipped BN^H makes of tracked demonstrations to a report.

    Raises:
        ValueError: if the folder has none.
    """
    figures = demonstration_figures(shipped_model(), folder, seed)
    if figures is None:
        raise ValueError(f"{folder}: expected demonstrations.csv.gz")
    report["demonstrations"] = figures
    for task, own in figures["tasks"].items():
        if task in report["tasks"]:
            report["tasks"][task]["demonstrations"] = own


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.evaluate",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--data", required=True)
    parser.add_argument("--group", default="object_id", help="column of what must be unseen")
    parser.add_argument("--observe", default="", help="e.g. O,A or obcl,npos; default: all")
    parser.add_argument("--tasks", default="")
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--group-trials", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--no-baselines", action="store_true")
    parser.add_argument("--json", type=output_file, help="file, - = print")
    parser.add_argument("--figures", help="folder for Fig. 5")
    parser.add_argument(
        "--demonstrations", help="folder of demonstrations.csv.gz: BN^H on them, red in Fig. 5"
    )
    arguments = parser.parse_args(argv)
    started = time.process_time()
    try:
        table = read_grasps(arguments.data, arguments.tasks.split(",") if arguments.tasks else None)
        table = restricted(table, observed_variables(arguments.observe))
        if arguments.group != "object_id" and arguments.group not in table.columns:
            raise ValueError(f"group: expected a column of {sorted(table.columns)}")
        protocol = ProtocolConfig(baselines=not arguments.no_baselines)
        config = ReportConfig(
            trials=arguments.trials,
            group_trials=arguments.group_trials,
            seed=arguments.seed,
            group=arguments.group,
        )
        report = evaluation_report(
            table, protocol, config, lambda text: print(text, file=sys.stderr, flush=True)
        )
        if arguments.demonstrations:
            judge_demonstrations(report, Path(arguments.demonstrations), arguments.seed)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    report["seconds"] = time.process_time() - started
    if arguments.figures:
        from intent_inference.workshop.evaluation.roc_figures import draw_roc

        draw_roc(report, Path(arguments.figures) / "fig5_roc.png")
    if arguments.json == Path("-"):
        print(json.dumps(report, indent=1))
        return 0
    print_report(report)
    if arguments.json:
        write_text(arguments.json, json.dumps(report, indent=1) + "\n")
    return 0
