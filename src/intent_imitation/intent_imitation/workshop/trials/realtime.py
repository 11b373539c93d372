"""Whether the running graph keeps up with a camera: bags at 30 Hz, compressed, no lockstep.

python -m intent_imitation.workshop.trials.realtime [--bags FOLDER...] [--loops 20] [--quick]

Plays every bag to five running nodes by a player that knows nothing of them, holds what they say
against the bag's truth and against the same steps in one process, and prints one line of JSON.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from intent_imitation.ros.realtime_probe_node import Heard, RealtimeProbe, probed_graph
from intent_inference.workshop.recipes.bag_run import models_file, run_bag
from intent_perception.basics.arrays import Array
from intent_perception.objects.database import ObjectDatabase

_NEAR = 10
"""A grasp is found where it is reported within so many frames of the true moment."""
_QUICK, _FEW = 3, 10
"""Bags of a quick run, and frames up to which a bag shows no demonstration."""


@dataclass(frozen=True, eq=False)
class BagOutcome:
    """One bag against its truth."""

    heard: Heard
    stamps: Array
    """(F,) of its frames [ns]."""
    expected: tuple[int, ...]
    """True moments of its grasps [ns]."""
    found: tuple[int | None, ...]
    """Reported moment of each of these grasps [ns], None = not found."""
    best: tuple[str | None, ...]
    """Best task of each of these grasps where the same steps have all the time they need; None:
    they do not find it either."""

    def objects_after(self) -> list[float]:
        """Return the time from the first frame to the first objects [s]."""
        first, frames = self.stamps[0], self.heard.frames.items()
        start = min((when - (stamp - first) * 1e-9 for stamp, when in frames), default=0.0)
        came = [when for stamp, when in self.heard.objects if stamp in self.stamps]
        return [min(came) - start] if came else []

    def plan_times(self) -> list[float]:
        """Return the time from the frame of each grasp found to its plan [s]."""
        heard, grasps = self.heard, [t for t in self.found if t in self.heard.frames]
        return [heard.plans[t] - heard.frames[t] for t in grasps if t in heard.plans]


def outcome_of(bag: Path, heard: Heard, reference: Sequence[tuple[int, str]]) -> BagOutcome:
    """Return what was heard of a bag beside what was to be heard.

    Args:
        bag: its folder.
        heard: of the graph.
        reference: moment [ns] and best task of each grasp where nothing is lost.
    """
    truth, database = np.load(bag / "truth.npz"), ObjectDatabase.load(models_file(bag))
    stamps = truth["stamps"]
    near = _NEAR * int(np.median(np.diff(stamps)))
    names = [str(truth["object_ids"][k]) for k in truth["grasped"]]
    moments = zip(truth["grasp_stamp"], names, strict=True)
    expected = tuple(int(t) for t, name in moments if name in database)
    found = tuple(next((g for g in heard.grasps if abs(g - t) <= near), None) for t in expected)
    best = tuple(
        next((task for moment, task in reference if abs(t - moment) <= near), None)
        for t in expected
    )
    return BagOutcome(heard, stamps, expected, found, best)


def figures(outcomes: Sequence[BagOutcome]) -> dict[str, Any]:
    """Return the figures of the contract over bags."""
    p50, p95 = _percentiles([one.heard for one in outcomes])
    frames = sum(len(one.stamps) for one in outcomes)
    answered = sum(stamp in one.heard.states for one in outcomes for stamp in one.stamps)
    grasps = [(one, k) for one in outcomes for k in range(len(one.expected))]
    same = [
        one.best[k] is not None and one.heard.best.get(one.found[k] or -1) == one.best[k]
        for one, k in grasps
    ]
    planned = [one.found[k] in one.heard.plans for one, k in grasps]
    plan_times = [t for one in outcomes for t in one.plan_times()]
    objects = [t for one in outcomes for t in one.objects_after()]
    nodes = outcomes[0].heard.cpu
    cpu = {n: 1e3 * sum(one.heard.cpu[n] for one in outcomes) / frames for n in nodes}
    return {
        "bags": len(outcomes),
        "answered": answered / frames,
        "latency_ms_p50": p50,
        "latency_ms_p95": p95,
        "objects_after_s": float(np.max(objects)) if objects else None,
        "objects_after_s_median": float(np.median(objects)) if objects else None,
        "grasps": len(grasps),
        "grasp_found": sum(one.found[k] is not None for one, k in grasps),
        "same_best": sum(same),
        "plan_found": sum(planned),
        "plan_after_s": float(np.max(plan_times)) if plan_times else None,
        "plan_after_s_median": float(np.median(plan_times)) if plan_times else None,
        "cpu_ms_per_frame": {**cpu, "all": sum(cpu.values())},
    }


def _percentiles(heard: Sequence[Heard]) -> tuple[float | None, float | None]:
    """Return median and 95 % of the latencies [ms]; None where no frame was answered."""
    latency = [t for one in heard for t in one.latencies()]
    if not latency:
        return None, None
    p50, p95 = 1e3 * np.percentile(latency, [50, 95])
    return float(p50), float(p95)


def _latency(p50: float | None, p95: float | None) -> str:
    return "unknown" if p50 is None or p95 is None else f"{p50:.0f} / {p95:.0f} ms"


def looped(probe: RealtimeProbe, bags: Sequence[Path], loops: int) -> dict[str, Any]:
    """Return how often a graph answers bags again and again, and what it holds ever more of."""
    heard = [_one_loop(probe, bags, number) for number in range(loops)]
    settled, last = heard[min(1, loops - 1)][-1], heard[-1][-1]
    grown = [last.memory[name] / settled.memory[name] - 1.0 for name in settled.memory]
    return {
        "loops": loops,
        "loops_answered": sum(all(one.grasps and one.plans for one in loop) for loop in heard),
        "memory_growth": float(max(grown)),
        "handles_growth": max(last.handles[name] - settled.handles[name] for name in last.handles),
    }


def _one_loop(probe: RealtimeProbe, bags: Sequence[Path], number: int) -> list[Heard]:
    """Play bags one after the other and print a line of what came."""
    heard = [probe.play(bag) for bag in bags]
    memory = {name: round(size / 1e6) for name, size in heard[-1].memory.items()}
    print(
        f"loop {number + 1}: grasps {sum(bool(one.grasps) for one in heard)}, plans "
        f"{sum(bool(one.plans) for one in heard)} of {len(bags)} bags, latency "
        f"{_latency(*_percentiles(heard))}, memory [MB] {memory}, handles {heard[-1].handles}",
        file=sys.stderr,
        flush=True,
    )
    return heard


def measured(bags: Sequence[Path], loops: int) -> dict[str, Any]:
    """Return the figures over bags; those with the same objects share one running graph."""
    outcomes: list[BagOutcome] = []
    ready: list[float] = []
    repeated: dict[str, Any] = {}
    references = {bag: _reference(bag) for bag in bags}
    for models in dict.fromkeys(models_file(bag) for bag in bags):
        own = [bag for bag in bags if models_file(bag) == models]
        with probed_graph(own[0], models) as probe:
            ready.append(probe.await_ready())
            for bag in own:
                outcomes.append(outcome_of(bag, probe.play(bag), references[bag]))
                print(f"{bag.name}: {_line(outcomes[-1])}", file=sys.stderr, flush=True)
            if loops and not repeated:
                repeated = looped(probe, _demonstrations(own), loops)
    return {**figures(outcomes), "ready_s": max(ready), **repeated}


def _demonstrations(bags: Sequence[Path]) -> list[Path]:
    """Return the bags in which something is grasped."""
    return [bag for bag in bags if len(np.load(bag / "truth.npz")["grasp_stamp"])]


def _reference(bag: Path) -> list[tuple[int, str]]:
    run = run_bag(bag)
    return [(posterior.stamp, posterior.best or "") for posterior in run.posteriors]


def _line(outcome: BagOutcome) -> str:
    alone = figures([outcome])
    cpu = alone["cpu_ms_per_frame"]
    return (
        f"answered {alone['answered']:.2f}, latency "
        f"{_latency(alone['latency_ms_p50'], alone['latency_ms_p95'])}, "
        f"objects after {alone['objects_after_s'] or 0.0:.2f} s, "
        f"grasps {alone['grasp_found']}, best {alone['same_best']}, plans {alone['plan_found']} of "
        f"{alone['grasps']}, plan after {alone['plan_after_s'] or 0.0:.2f} s, CPU ms "
        + ", ".join(f"{name} {value:.1f}" for name, value in cpu.items())
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--bags", type=Path, nargs="+", default=[Path("bags")])
    parser.add_argument("--loops", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="three bags, three loops")
    options = parser.parse_args()
    truths = [truth for folder in options.bags for truth in sorted(folder.rglob("truth.npz"))]
    found = {truth.parent.name: truth.parent for truth in truths}
    bags = [bag for bag in found.values() if len(np.load(bag / "truth.npz")["stamps"]) > _FEW]
    if not bags:
        raise SystemExit("error: no bag with truth.npz; make them by python bags/make.py")
    loops = options.loops
    if options.quick:
        bags, loops = bags[:_QUICK], min(loops, _QUICK)
    try:
        print(json.dumps(measured(bags, loops)))
    except TimeoutError as error:
        raise SystemExit(f"error: {error}") from None


if __name__ == "__main__":
    main()
