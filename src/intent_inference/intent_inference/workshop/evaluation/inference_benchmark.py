"""Command: the figures of inference and of the simulated grasps as JSON.

python -m intent_inference.benchmark
    [--part tasks|demonstrations|one_row|estimated_shapes|latency|training|simulation|human|motion]
    [--bags FOLDER …] [--archive FOLDER] [--count N] [--json FILE|-] [--seed S] [--quick]
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference import SHARE
from intent_inference.network.model_file import load_model, shipped_model
from intent_inference.network.probability_calibration import sigmoid
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.feature_table import select_rows
from intent_inference.workshop.evaluation.demonstration_scores import demonstration_figures
from intent_inference.workshop.evaluation.estimated_shape_scores import estimated_shape_figures
from intent_inference.workshop.evaluation.evaluation_report import ReportConfig, evaluation_report
from intent_inference.workshop.evaluation.human_scores import human_figures
from intent_inference.workshop.evaluation.motion_scores import motion_figures
from intent_inference.workshop.evaluation.protocol import ProtocolConfig
from intent_inference.workshop.training.fitting import train
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_inference.workshop.training.one_row_scores import one_row_figures
from intent_perception.basics.progress import counted
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.workshop.figures.machine import machine

_NO_TASK = {"no_grasp", "unknown_object", "robot_table"}
"""Bags that show no task with an object of the database."""
_MASKS = {"full": "full", "partial": "partial", "partial_fig5": "partial_fig5"}


def task_figures(data: Path, seed: int, quick: bool) -> dict[str, Any]:
    """Return the contract's `tasks`, `auc_mean` and `unknown_auroc` for a data set."""
    config = ReportConfig(
        trials=3 if quick else 30, group_trials=2 if quick else 10, seed=seed, unknown=True
    )
    report = evaluation_report(
        read_grasps(data), ProtocolConfig(), config,
        lambda text: print(text, file=sys.stderr, flush=True),
    )  # fmt: skip
    tasks = {}
    for task, own in report["tasks"].items():
        figures = {f"auc_{name}": own["auc"][mask]["mean"] for name, mask in _MASKS.items()}
        figures["auc_within_class"] = own["auc_within_class"]["full"]
        figures["auc_within_class_partial"] = own["auc_within_class"]["partial"]
        figures.update({f"ece_{mask}": value for mask, value in own["ece"].items()})
        figures["auc_sd_full"] = own["auc"]["full"]["sd"]
        tasks[task] = figures
    means, unseen = report["auc_mean"], report["unseen_objects"]
    auc_mean = {f"{name}": means["ours"][mask]["auc"] for name, mask in _MASKS.items()}
    auc_mean["within_class_full"] = means["ours"]["full"]["within_class"]
    auc_mean["within_class_partial"] = means["ours"]["partial"]["within_class"]
    for method in ("class_only", "hard", "hard_ours", "paper_recipe", "boosting"):
        auc_mean[method] = means[method]["full"]["auc"]
        auc_mean[f"{method}_partial"] = means[method]["partial"]["auc"]
    for mask in ("full", "partial"):
        auc_mean[f"unseen_objects_{mask}"] = unseen["ours"][mask]["auc"] if unseen else None
        auc_mean[f"unseen_objects_boosting_{mask}"] = (
            unseen["boosting"][mask]["auc"] if unseen else None
        )
    return {
        "tasks": tasks,
        "auc_mean": auc_mean,
        "unknown_auroc": report["unknown_auroc"],
        "unknown_auroc_by_class": report["unknown_auroc_by_class"],
        "table_2": report["table_2"],
        "trials": config.trials,
    }


def latency_figures(model: TaskModel, data: Path, queries: int) -> dict[str, Any]:
    """Return the CPU time of evidence and all posteriors of one grasp [ms], one thread.

    Half of the queries carry standard deviations, as tracked grasps do.
    """
    features = read_grasps(data).features
    widths = {"dir": 0.05, "npos": 0.06, "fcon": 0.15}
    rows = len(next(iter(features.values())))
    seconds = []
    for query in range(queries + 50):
        own = select_rows(features, np.array([query % rows]))
        deviations = None
        if query % 2:
            deviations = {n: np.full(own[n].shape, w) for n, w in widths.items() if n in own}
        started = time.thread_time_ns()
        sigmoid(model.calibrated_log_odds(model.evidence(own, deviations)))
        seconds.append((time.thread_time_ns() - started) * 1e-6)
    warm = np.array(seconds[50:])
    return {
        "latency_ms_median": float(np.median(warm)),
        "latency_ms_p99": float(np.percentile(warm, 99)),
    }


def training_figures(data: Path, seed: int) -> dict[str, Any]:
    """Return the CPU time of training all networks [s]."""
    table = read_grasps(data)
    started = time.process_time()
    train(table, np.random.default_rng(seed))
    return {"training_s": time.process_time() - started}


def _model(path: str) -> TaskModel:
    """Return BN^H of a file, the shipped one without."""
    return load_model(path) if path else shipped_model()


def _bags_in(folders: list[Path]) -> Iterator[Path]:
    """Yield every bag once that shows the use of a known object, the first of a name."""
    seen: set[str] = set()
    for folder in folders:
        for truth in sorted(folder.glob("*/truth.npz")):
            name = truth.parent.name
            if name not in seen and name not in _NO_TASK:
                seen.add(name)
                yield truth.parent


def _simulation(quick: bool, seed: int) -> dict[str, Any] | None:
    """Return the figures of simulated grasps; None where pybullet is not installed."""
    if find_spec("pybullet") is None:
        return None
    from intent_inference.workshop.simulation.simulation_benchmark import simulation_figures

    figures: dict[str, Any] = simulation_figures(quick=quick, seed=seed)
    return figures


def _motion(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return how early motions are told in simulation and in the bags."""
    bags = tuple(_bags_in(arguments.bags))[: 2 if arguments.quick else None]
    model = _model(arguments.model)
    figures: dict[str, Any] = motion_figures(model, SHARE / "data", bags, arguments.seed)
    return figures


PARTS: dict[str, Callable[[argparse.Namespace], dict[str, Any] | None]] = {
    "tasks": lambda a: task_figures(a.data, a.seed, a.quick),
    "demonstrations": lambda a: demonstration_figures(_model(a.model), SHARE / "data", a.seed),
    "one_row": lambda a: one_row_figures(
        _model(a.model), SHARE / "data", 2 if a.quick else 12, a.seed
    ),
    "estimated_shapes": lambda a: estimated_shape_figures(
        _model(a.model), SHARE / "data", a.archive,
        max(1, a.count // 10) if a.quick else a.count, a.seed,
    ),
    "latency": lambda a: latency_figures(_model(a.model), a.data, 400 if a.quick else 4000),
    "training": lambda a: training_figures(a.data, a.seed),
    "simulation": lambda a: _simulation(a.quick, a.seed),
    "human": lambda a: human_figures(a.model, a.data, a.seed),
    "motion": _motion,
}  # fmt: skip
"""What can be measured, by name."""
_JOINED = ("tasks", "latency", "training")
"""Parts whose figures stand in the report itself, not under the part's name."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="intent_inference.benchmark",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--part", choices=PARTS, help="default: all")
    parser.add_argument("--data", type=Path, default=SHARE / "data" / "human.csv.gz")
    parser.add_argument("--model", default="", help="default: the shipped BN^H")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument(
        "--bags", type=Path, nargs="*", default=[Path("bags"), Path("bags/generated")],
        help="folders of bags for motion",
    )  # fmt: skip
    parser.add_argument(
        "--archive", type=Path, default=Path("out/estimated_shapes"),
        help="where tracked films of estimated_shapes are kept",
    )  # fmt: skip
    parser.add_argument("--count", type=int, default=241, help="films of estimated_shapes")
    parser.add_argument("--quick", action="store_true", help="few trials")
    parser.add_argument("--json", type=output_file, default="-", help="file, - = print")
    return parser


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    arguments = _parser().parse_args(argv)
    report: dict[str, Any] = {
        "machine": machine(),
        "seed": arguments.seed,
    }
    wall, cpu = time.perf_counter(), time.process_time()
    for name in counted("part", [arguments.part] if arguments.part else list(PARTS)):
        figures = PARTS[name](arguments)
        report |= figures if figures and name in _JOINED else {name: figures}
    report["seconds"] = time.process_time() - cpu
    report["wall_seconds"] = time.perf_counter() - wall
    write_json(arguments.json, report, indent=1)
    return 0
