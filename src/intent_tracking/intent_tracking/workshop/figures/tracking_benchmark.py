"""Command: the tracker's figures as JSON.

python -m intent_tracking.benchmark [--part NAME] [--seed S] [--quick] [--bags DIR]
    [--films N] [--picture F.png] [--json FILE|-]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.progress import counted
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.workshop.figures.machine import machine
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_bags import BagErrors, bag_errors, bags_with_truth
from intent_tracking.workshop.figures.benchmark_motions import motion_figures
from intent_tracking.workshop.figures.benchmark_numbers import milliseconds_by_objects
from intent_tracking.workshop.figures.benchmark_people import FILMS, people_figures
from intent_tracking.workshop.figures.benchmark_real import real_figures, real_folder
from intent_tracking.workshop.figures.benchmark_speed import (
    evaluations_per_second,
    parallel_speedup,
)
from intent_tracking.workshop.figures.benchmark_sr305 import sr305_figures
from intent_tracking.workshop.figures.benchmark_views import (
    VIEWS,
    ViewErrors,
    recovery,
    view_errors,
    view_sequence,
)


@dataclass(frozen=True)
class Scope:
    """What to measure on."""

    seed: int
    quick: bool
    bags: Path
    picture: Path | None
    films: int | None = None
    """Number of films of people, None = all."""
    alone: bool = False
    """Whether only one part is measured."""

    def picture_of(self, part: str) -> Path | None:
        """Return the file for a part's picture, None: none is wanted."""
        if self.picture is None or self.alone:
            return self.picture
        return self.picture.with_stem(f"{self.picture.stem}_{part}")

    @property
    def seeds(self) -> list[int]:
        """Noise seeds of the views."""
        return [self.seed + i for i in range(1 if self.quick else 5)]

    @property
    def frames(self) -> int | None:
        """Frames per view, None = all."""
        return 60 if self.quick else None


def views(scope: Scope) -> dict[str, Any]:
    """Return errors of the three views, coverage and CPU time."""
    figures: dict[str, Any] = {}
    everything: list[ViewErrors] = []
    for view in VIEWS:
        errors = _view(view, scope, TrackerConfig())
        everything += errors
        figures[view] = _view_figures(errors)
    seconds = np.concatenate([e.seconds[3:] for e in everything])
    covered = np.concatenate([e.covered.ravel() for e in everything])
    return {
        "views": figures,
        "coverage_2sigma": float(np.nanmean(covered)),
        "cpu_ms_per_frame": float(1e3 * seconds.mean()),
        "p95_ms": float(1e3 * np.percentile(seconds, 95)),
    }


def _view(view: str, scope: Scope, config: TrackerConfig) -> list[ViewErrors]:
    errors = []
    for seed in scope.seeds:
        sequence = view_sequence(view, seed, scope.frames)
        errors.append(view_errors(sequence, replace(config, seed=seed), seed))
    return errors


def _view_figures(errors: list[ViewErrors]) -> dict[str, float]:
    return {
        "joint_error_mm": float(1e3 * np.mean([e.joints.mean() for e in errors])),
        "object_error_mm": float(1e3 * np.mean([e.place.mean() for e in errors])),
        "object_tilt_deg": float(np.degrees(np.mean([e.tilt.mean() for e in errors]))),
    }


def bags(scope: Scope, config: TrackerConfig | None = None) -> dict[str, Any]:
    """Return errors over all bags; null where there are none."""
    found = bags_with_truth(scope.bags)
    if not found:
        return {"bags": None}
    chosen = found[:2] if scope.quick else found
    errors = [bag_errors(bag, config or TrackerConfig(seed=scope.seed)) for bag in chosen]
    numbers = sorted({e.objects for e in errors})
    milliseconds = {
        str(n): _bag_figures([e for e in errors if e.objects == n])["cpu_ms_per_frame"]
        for n in numbers
    }
    each = {e.name: _bag_figures([e]) for e in errors}
    return {"bags": {**_bag_figures(errors), "cpu_ms_by_objects": milliseconds, "each": each}}


def _bag_figures(errors: list[BagErrors]) -> dict[str, float]:
    joints = np.concatenate([e.joints for e in errors])
    lost = np.concatenate([e.lost for e in errors])
    seconds = np.concatenate([e.seconds[3:] for e in errors])
    return {
        "joint_error_mm": float(1e3 * joints.mean()) if len(joints) else float("nan"),
        "tracked_joint_error_mm": float(1e3 * joints[~lost].mean()) if (~lost).any() else 0.0,
        "lost_fraction": float(lost.mean()) if len(lost) else 0.0,
        "sides_right": float(np.mean([e.side_right for e in errors])),
        "cpu_ms_per_frame": float(1e3 * seconds.mean()),
        "p95_ms": float(1e3 * np.percentile(seconds, 95)),
        "coverage_2sigma": float(np.concatenate([e.covered for e in errors]).mean()),
        "count": len(errors),
    }


def dexycb(scope: Scope) -> dict[str, Any]:
    """Return errors on real motions worn by the demonstrator's skin; null without the data."""
    return {"dexycb": motion_figures(scope.seed, 3 if scope.quick else 30)}


def sr305(scope: Scope) -> dict[str, Any]:
    """Return how the tracker starts on real depth frames; null without the data."""
    return {"sr305": sr305_figures(scope.seed, scope.picture_of("sr305"))}


def real(scope: Scope) -> dict[str, Any]:
    """Return errors on recordings of real hands; null without the data."""
    config = TrackerConfig(seed=scope.seed)
    return {"real": real_figures(real_folder(), config, scope.picture_of("real"))}


def people(scope: Scope) -> dict[str, Any]:
    """Return errors on films of people of all kinds."""
    films = scope.films or (6 if scope.quick else FILMS)
    return {"people": people_figures(scope.seed, films, scope.picture_of("people"))}


def recoveries(scope: Scope) -> dict[str, Any]:
    """Return the rate at which a badly placed hand is found again."""
    sequence = view_sequence("v0", scope.seed, 60)
    rate = recovery(sequence, TrackerConfig(), scope.seed, 10 if scope.quick else 40)
    return {"recovery_rate": rate}


def objects(scope: Scope) -> dict[str, Any]:
    """Return the CPU time with N = 0 to 4 objects, one of them moved."""
    figures = milliseconds_by_objects(scope.seed, 20 if scope.quick else 125)
    return {"cpu_ms_by_objects": figures}


def speed(scope: Scope) -> dict[str, Any]:
    """Return rendered evaluations per second and the gain of a second core."""
    return {
        "evaluations_per_second_64": evaluations_per_second(),
        "parallel_speedup": parallel_speedup(),
    }


def pso(scope: Scope) -> dict[str, Any]:
    """Return error and CPU time of the published particle swarm on v0."""
    config = TrackerConfig(method="pso")
    errors = _view("v0", replace(scope, quick=True) if scope.quick else scope, config)
    seconds = np.concatenate([e.seconds[3:] for e in errors])
    return {
        "pso": {
            "joint_error_mm": _view_figures(errors)["joint_error_mm"],
            "cpu_ms_per_frame": float(1e3 * seconds.mean()),
        }
    }


def without_swarm(scope: Scope) -> dict[str, Any]:
    """Return the errors of the hybrid method without its swarm, and with it where frames lack."""
    config = TrackerConfig()
    alone = replace(config, track=replace(config.track, swarm_particles=0))
    view = _view_figures(_view("v240", scope, alone))["joint_error_mm"]
    with_it, without_it = _sparse(scope, (config, alone))
    recorded = bags(scope, alone)["bags"]
    error = recorded["joint_error_mm"] if recorded else None
    errors = {"v240": view, "every_fifth_frame": without_it, "bags": error}
    return {
        "with_swarm": {"joint_error_mm": {"every_fifth_frame": with_it}},
        "without_swarm": {"joint_error_mm": errors},
    }


def _sparse(scope: Scope, configs: tuple[TrackerConfig, ...]) -> list[float]:
    """Return each configuration's error [mm] on all views when only every fifth frame arrives.

    From one frame to the next the hand then moves by up to 60 mm and each joint by up to 44
    degrees. Every view runs five times, from each of its first five frames on.
    """
    errors: list[list[float]] = [[] for _ in configs]
    for view in VIEWS:
        for seed in scope.seeds:
            sequence = view_sequence(view, seed, scope.frames)
            for first in range(5):
                for config, found in zip(configs, errors, strict=True):
                    part = sequence.every(5, first)
                    error = view_errors(part, replace(config, seed=seed), seed).joints
                    found.extend(error.tolist())
    return [1e3 * float(np.mean(found)) for found in errors]


PARTS: dict[str, Callable[[Scope], dict[str, Any]]] = {
    "views": views,
    "bags": bags,
    "dexycb": dexycb,
    "people": people,
    "real": real,
    "sr305": sr305,
    "recovery": recoveries,
    "objects": objects,
    "speed": speed,
    "pso": pso,
    "without_swarm": without_swarm,
}


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_tracking.benchmark",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--part", choices=sorted(PARTS))
    parser.add_argument("--seed", type=int, default=0, help="from 1000 on: for reports")
    parser.add_argument("--quick", action="store_true", help="fewer seeds, frames and bags")
    parser.add_argument("--bags", type=Path, default=Path("bags"))
    parser.add_argument("--picture", type=Path, help="PNG of the parts people, real, sr305")
    parser.add_argument("--films", type=int, help="films of the part people")
    parser.add_argument("--json", type=output_file, default="-", help="file, - = print")
    options = parser.parse_args(arguments)
    began = time.perf_counter()
    figures: dict[str, Any] = {
        "machine": machine(),
        "seed": options.seed,
    }
    scope = Scope(
        options.seed, options.quick, options.bags, options.picture, options.films,
        options.part is not None,
    )  # fmt: skip
    for name in counted("part", [options.part] if options.part else list(PARTS)):
        figures.update(PARTS[name](scope))
    figures["seconds"] = time.perf_counter() - began
    write_json(options.json, figures, indent=2)
    return 0
