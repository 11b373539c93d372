"""Figures of goal-directed imitation over random tables, as JSON.

python -m intent_imitation.benchmark [--part NAME] [--seed S] [--quick] [--json FILE]
"""

import argparse
import json
import os
import platform
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from intent_imitation.execution import World
from intent_imitation.experience import Judge, read_experience
from intent_imitation.library import GraspLibrary
from intent_imitation.plan import GraspPlan
from intent_imitation.planner import GraspPlanner
from intent_imitation.scenes import FITTING, Scene, SceneMaker, merged
from intent_inference.dataset import read_grasps
from intent_inference.learning.fitting import train
from intent_inference.model import TaskModel
from intent_inference.simulation.grasping_hand import GraspingHand
from intent_inference.simulation.labels import label_grasp
from intent_inference.simulation.task_object import TaskObject
from intent_perception.objects import CLUTTER, ObjectDatabase, ObjectModel

DATA = Path(__file__).parents[2] / "intent_inference" / "intent_inference" / "share" / "data"
TASKS = tuple(FITTING)


@dataclass(frozen=True)
class Trial:
    """What happened on one table; None where it does not apply."""

    task: str
    fitting: bool
    """Some object affords the task."""
    unseen: bool | None
    """The chosen (or, without a choice, any fitting) object was not in training."""
    correct: bool | None
    """The chosen object affords the task (tables with a fitting object)."""
    class_only: bool | None
    """The object of the class most likely for the task affords it."""
    refused: bool
    """The planner said that nothing affords the task."""
    held: bool | None
    rule: bool | None
    """The executed grasp satisfies the task's label rule."""
    random_rule: float | None
    """Share of the chosen object's stable grasps that do."""
    seconds: float
    """CPU time of planning [s]."""


class Laboratory:
    """Everything that the trials share."""

    def __init__(self, seed: int) -> None:
        """Train BN^R on half of the objects of each class and open the data sets."""
        self.hand = GraspingHand.load("schunk")
        known, clutter = ObjectDatabase.load(), ObjectDatabase.load(CLUTTER)
        self.database = merged(known, clutter)
        self.unseen = frozenset(
            model.name for model in known.models if int(model.name.rsplit("_", 1)[1]) % 2
        )
        table = read_grasps(DATA / "schunk.csv.gz", list(TASKS))
        practised = ~np.isin(table.columns["object_id"], list(self.unseen))
        self.model = train(table.select(practised), np.random.default_rng(seed))
        self.judge = Judge(self.hand, read_experience(DATA / "schunk.csv.gz", self.hand))
        self.maker = SceneMaker(known, clutter, self.unseen)
        self.planner = GraspPlanner(self.database, model=self.model, library=GraspLibrary.load())
        self._targets: dict[str, TaskObject] = {}

    def target(self, model: ObjectModel) -> TaskObject:
        """Return an object prepared for labelling."""
        if model.name not in self._targets:
            self._targets[model.name] = TaskObject(model)
        return self._targets[model.name]


def run_trial(laboratory: Laboratory, scene: Scene, rng: np.random.Generator) -> Trial:
    """Plan on one table, judge the choice and carry the grasp out."""
    objects = scene.recognized()
    laboratory.planner.start(objects)
    started = time.process_time()
    plan = laboratory.planner.plan(scene.task)
    seconds = time.process_time() - started
    affording = laboratory.judge.affording(scene)
    fitting = any(affording)
    blind = affording[class_choice(laboratory.model, scene, rng)] if fitting else None
    if not plan.grasps:
        hidden = any(u and a for u, a in zip(scene.unseen, affording, strict=True))
        return Trial(
            scene.task, fitting, hidden, False if fitting else None, blind, True,
            None, None, None, seconds,
        )  # fmt: skip
    index = [item.id for item in objects.objects].index(plan.grasps[0].object_id)
    held, rule = executed(laboratory, scene, plan, index)
    share = laboratory.judge.share(scene.models[index].name, scene.task)
    return Trial(
        scene.task, fitting, scene.unseen[index], affording[index] if fitting else None, blind,
        False, held, rule, None if np.isnan(share) else share, seconds,
    )  # fmt: skip


def class_choice(model: TaskModel, scene: Scene, rng: np.random.Generator) -> int:
    """Return the object that the class alone would choose; hidden classes are all alike."""
    classes = np.array([item.object_class for item in scene.recognized().objects])
    chances = model.posterior({"obcl": classes})[:, model.tasks.index(scene.task)]
    return int(np.argmax(chances + 1e-6 * rng.random(len(chances))))


def executed(
    laboratory: Laboratory, scene: Scene, plan: GraspPlan, index: int
) -> tuple[bool, bool | None]:
    """Return whether the best grasp held, and whether it satisfied the task's rule."""
    with World(laboratory.hand, scene.models, scene.T_table_objects) as world:
        outcome = world.execute(plan.grasps[0], index, scene.task)
    labels = label_grasp(
        laboratory.target(scene.models[index]),
        laboratory.hand,
        outcome.T_object_hand,
        outcome.joints,
        outcome.contacts,
    )
    return outcome.held, labels[scene.task].afforded


def rates(trials: Sequence[Trial]) -> dict[str, Any]:
    """Return the figures of the contract over some trials; None where nothing counts."""
    fitting = [t for t in trials if t.fitting]
    empty = [t for t in trials if not t.fitting]
    rule = share(t.rule for t in trials)
    random_rule = share(t.random_rule for t in trials)
    return {
        "scenes": len(trials),
        "object_correct": share(t.correct for t in fitting),
        "object_correct_class_only": share(t.class_only for t in fitting),
        "refusal_correct": share(t.refused for t in empty),
        "executed_hold": share(t.held for t in trials),
        "executed_rule": rule,
        "executed_rule_random": random_rule,
        "executed_rule_gain": gain(rule, random_rule),
        "counts": {"fitting": len(fitting), "without": len(empty)},
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


def choices(seed: int, quick: bool) -> dict[str, Any]:
    """Return the figures over random tables."""
    laboratory = Laboratory(seed)
    rng = np.random.default_rng(seed)
    trials = []
    for number in range(24 if quick else 240):
        scene = laboratory.maker.make(TASKS[number % len(TASKS)], rng)
        trials.append(run_trial(laboratory, scene, rng))
    return {
        **rates(trials),
        "planning_ms_median": 1e3 * float(np.median([t.seconds for t in trials])),
        "unseen": rates([t for t in trials if t.unseen]),
        "tasks": {task: rates([t for t in trials if t.task == task]) for task in TASKS},
    }


PARTS: dict[str, Callable[[int, bool], dict[str, Any]]] = {"choices": choices}


def machine() -> dict[str, Any]:
    """Return what the figures were measured on."""
    return {"cores": os.cpu_count(), "load": os.getloadavg()[0], "cpu": platform.processor()}


def main() -> None:
    """Run the benchmark and write its figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--part", choices=sorted(PARTS), default=None)
    parser.add_argument("--seed", type=int, default=0, help="from 1000 on: for reports")
    parser.add_argument("--quick", action="store_true", help="a tenth of the tables")
    parser.add_argument("--json", default="-", help="file, or - for standard output")
    arguments = parser.parse_args()
    started = time.perf_counter()
    figures: dict[str, Any] = {"machine": machine(), "seed": arguments.seed}
    for name in [arguments.part] if arguments.part else PARTS:
        figures.update(PARTS[name](arguments.seed, arguments.quick))
    figures["seconds"] = time.perf_counter() - started
    text = json.dumps(figures, indent=2)
    if arguments.json == "-":
        print(text)
    else:
        Path(arguments.json).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
