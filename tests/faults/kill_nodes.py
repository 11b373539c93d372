"""Each node killed in a running graph, before, at and after the grasp, and started again.

    python -m tests.faults.kill_nodes [--cases 45] [--seed 0]

The bag is played once more when the node is ready: this or that demonstration must be answered by
a grasp and a plan, and in between nothing may be said that had been said before, or of another one.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np

from intent_imitation.ros.graph import NODES
from intent_imitation.ros.realtime_probe_node import Heard, RealtimeProbe, probed_graph

BAGS = Path(__file__).resolve().parents[2] / "bags"
NAMES = ("pour_bottle", "give_bottle", "wash_glass")
MOMENTS = {"before": -0.5, "at": 0.0, "after": 0.3}
"""When a node is killed, against the grasp [s]."""
_QUIET = 2.0
"""For so long a restarted graph is listened to before it is played to again [s]."""


def killed(probe: RealtimeProbe, name: str, shift: float, bag: Path) -> tuple[Heard, Heard, Heard]:
    """Return what was said of a bag, between, and of the bag once more, with a node killed."""
    grasp = int(np.load(bag / "truth.npz")["grasp_stamp"].ravel()[0])
    first = probe.play(bag, grasp + int(shift * 1e9), lambda: probe.restart(name))
    probe.await_ready()
    return first, probe.listen(_QUIET), probe.play(bag)


def stale(first: Heard, between: Heard) -> list[str]:
    """Return what was said between that is not a late answer to the demonstration just seen."""
    told = {
        "grasp": (between.grasps, first.grasps),
        "posterior": (list(between.best), list(first.best)),
        "plan": (list(between.plans), list(first.plans)),
    }
    return [
        f"{kind} of {'this' if stamp in first.frames else 'another'} demonstration"
        for kind, (later, before) in told.items()
        for stamp in later
        if before or stamp not in first.frames
    ]


def main() -> int:
    """Print a table; the status is 1 where a case was not answered or something stale was said."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--cases", type=int, default=len(NODES) * len(MOMENTS) * len(NAMES))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    cases = list(product(NODES, MOMENTS, NAMES))
    order = np.random.default_rng(options.seed).permutation(len(cases))[: options.cases]
    bad = 0
    with probed_graph(BAGS / NAMES[0], None) as probe:
        probe.await_ready()
        for node, moment, name in (cases[index] for index in order):
            first, between, again = killed(probe, node, MOMENTS[moment], BAGS / name)
            old = stale(first, between)
            answers = [bool(one.grasps and one.plans) for one in (first, again)]
            bad += not any(answers) or bool(old)
            said = " ".join("answered" if answer else "-       " for answer in answers)
            print(f"{node:15s}{moment:8s}{name:13s}{said}  stale: {old or 'nothing'}", flush=True)
    print(f"{len(order)} cases, {bad} not in order")
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
