"""From the URDF of a robot's hand to its grasps, its network BN^R, its library and a first plan.

python -m intent_imitation.own_hand HAND --out DIR [--base LINK] [--objects A,B,…] [--task TASK]

HAND is a URDF, of which a description is guessed and written to DIR/NAME.yaml, or such a
description that you have corrected. The robot practises in simulation with some of the shipped
objects (or your own, --models); DIR then holds grasps.csv.gz, network.npz, library.npz, plan.json
and grasp.png. Give the files to the imitation node as its parameters `library` and `network`.
"""

import argparse
import re
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from intent_imitation.demo.grasp_pictures import picture_of_grasp
from intent_imitation.demo.mesh_pictures import write_image
from intent_imitation.demo.run_record import grasp_values
from intent_imitation.planner.plan import GraspPlan
from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.planner.planner_config import PlannerConfig
from intent_imitation.workshop.practice import library_maker
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.hand_description import guessed_description
from intent_inference.grasping.urdf import table_from_urdf
from intent_inference.workshop.simulation import simulate_command
from intent_inference.workshop.training import train_command
from intent_perception.basics.late_module import need
from intent_perception.basics.safe_files import write_json, write_text
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

OBJECTS = ("mug_4", "bottle_2", "glass_1", "hammer_0", "screwdriver_1", "knife_0")
"""One of each class."""
_GAP = 0.35
"""Distance of the objects on the table that is planned for [m]."""


def described_hand(source: Path, base: str, folder: Path) -> Path:
    """Return the description of a hand; of a URDF it is guessed and written into the folder.

    Raises:
        ValueError: if the hand cannot be used.
    """
    if source.suffix.lower() in (".yaml", ".yml"):
        GraspingHand.load(source)
        return source.resolve()
    source = source.resolve()
    table = table_from_urdf(source, base)
    path = folder / f"{re.sub(r'[^A-Za-z0-9]+', '_', table.name)}.yaml"
    description = guessed_description(table, source, base)
    text = "# Guessed from the URDF: correct it, and give this file in the URDF's place.\n"
    write_text(path, text + yaml.safe_dump(description, sort_keys=False, default_flow_style=None))
    GraspingHand.load(path)
    return path.resolve()


def plan_on_a_table(folder: Path, models: str | None, names: Sequence[str], task: str) -> GraspPlan:
    """Return the plan for a task on a table with the objects side by side, and draw its grasp."""
    database = ObjectDatabase.load(models)
    planner = GraspPlanner(
        database,
        PlannerConfig(library=str(folder / "library.npz"), network=str(folder / "network.npz")),
    )
    items = []
    for index, name in enumerate(names):
        pose = make_pose(np.eye(3), [_GAP * index, 0.0, 0.0]) @ database[name].stable_poses[0]
        kind = database[name].object_class
        items.append(RecognizedObject(name, name, kind, pose, 1.0, 1.0))
    objects = RecognizedObjects(0, tuple(items), np.eye(4))
    planner.start(objects)
    plan = planner.plan(task)
    if plan.grasps:
        picture = picture_of_grasp(plan.grasps[0], objects, database, (760, 760), planner.hand)
        write_image(folder / "grasp.png", picture)
    values = grasp_values(plan) if plan.grasps else None
    write_json(folder / "plan.json", {"task": task, "grasp": values}, indent=2)
    return plan


def main(command_line: Sequence[str] | None = None) -> int:
    """Go all the way; say each step and the time it took."""
    options = _parser().parse_args(command_line)
    need("pybullet")
    folder: Path = options.out
    folder.mkdir(parents=True, exist_ok=True)
    names = options.objects.split(",")
    hand = _step("description", lambda: described_hand(options.hand, options.base, folder))
    loaded = GraspingHand.load(hand)
    print(f"{loaded.name}: joints {', '.join(loaded.table.joint_names)}", flush=True)
    grasps, network, library = (
        str(folder / name) for name in ("grasps.csv.gz", "network.npz", "library.npz")
    )
    models = ["--models", options.models] if options.models else []
    simulate = ["--hand", str(hand), "--objects", options.objects, "--out", grasps, *models]
    simulate += ["--archive", str(folder / "archive"), "--per-object", str(options.per_object)]
    simulate += ["--rounds", str(options.rounds), "--jobs", str(options.jobs)]
    _step("grasps", lambda: simulate_command.main(simulate))
    _step("BN^R", lambda: train_command.main(["--data", grasps, "--out", network]))
    archive = str(folder / "archive" / loaded.name)
    make = ["--hand", str(hand), "--grasps", archive, "--out", library, *models]
    _step("library", lambda: library_maker.main(make))
    plan = _step("plan", lambda: plan_on_a_table(folder, options.models, names, options.task))
    if plan.grasps:
        best = plan.grasps[0]
        print(f"{options.task}: takes {best.object_id}, score {best.score:.2f}; grasp.png shows it")
    else:
        print(f"{options.task}: {plan.refusal}")
    print(f"imitation --ros-args -p library:={library} -p network:={network}")
    return 0


def _step[Result](name: str, work: Callable[[], Result]) -> Result:
    """Do one step; fail where its command says that it failed."""
    start = time.monotonic()
    print(f"{name} …", file=sys.stderr, flush=True)
    result: Any = work()
    if isinstance(result, int) and result != 0:
        raise ValueError(f"the step {name} failed; see above")
    print(f"{name}: done after {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    done: Result = result
    return done


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("hand", type=Path, help="URDF, or a description (.yaml)")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--base", default="", help="link that the hand begins with; default: root")
    parser.add_argument("--models", default=None, help="object database; default: the shipped one")
    parser.add_argument("--objects", default=",".join(OBJECTS), help="separated by commas")
    parser.add_argument("--task", default="pouring", help="task that the plan is for")
    parser.add_argument("--per-object", type=int, default=120, help="grasps that hold, per object")
    parser.add_argument("--rounds", type=int, default=40, help="at most, per object")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    return parser
