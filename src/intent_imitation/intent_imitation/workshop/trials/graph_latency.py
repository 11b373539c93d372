"""How long the running graph takes from a final posterior to the published plan.

python -m intent_imitation.workshop.trials.graph_latency [--answers 20] [--seed S]

Tells the imitation node of random tables, times each answer by the wall clock and prints one line
of JSON.
"""

import argparse
import json
import sys
from typing import Any

import numpy as np

from intent_imitation.ros.graph_probe_node import GraphProbe, probed_graph
from intent_imitation.workshop.trials.robot_tables import FITTING, SceneMaker, merged
from intent_inference.intention.estimator import TaskPosterior
from intent_perception.objects.database import CLUTTER, ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObjects


def measured(probe: GraphProbe, answers: int, seed: int) -> dict[str, Any]:
    """Return the wall times of some answers [ms], four tables in turn."""
    database = ObjectDatabase.load()
    maker = SceneMaker(database, ObjectDatabase.load(CLUTTER), frozenset())
    rng, tasks = np.random.default_rng(seed), tuple(FITTING)
    seconds = []
    for number in range(answers):
        task = tasks[number % len(tasks)]
        if number % 5 == 0:
            scene = maker.make("hand-over", rng)  # known objects only, as the node's database has
            objects = RecognizedObjects(
                number + 1, scene.recognized().objects, scene.recognized().T_table_camera
            )
            probe.show(objects, merged(database, ObjectDatabase.load(CLUTTER)))
        chances = np.array([0.9 if name == task else 0.1 for name in tasks])
        posterior = TaskPosterior(
            1000 + number, "demo", "", tasks, chances, task, (task,), False, 0.0, (), ()
        )
        seconds.append(probe.ask(posterior))
    milliseconds = 1e3 * np.array(seconds)
    return {
        "answers": answers,
        "latency_ms_median": float(np.median(milliseconds)),
        "latency_ms_max": float(milliseconds.max()),
        "within_200_ms": float((milliseconds <= 200.0).mean()),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--answers", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    try:
        with probed_graph() as probe:
            print(json.dumps(measured(probe, options.answers, options.seed)))
    except TimeoutError as error:
        print(error, file=sys.stderr)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
