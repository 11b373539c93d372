"""Practise grasps of objects at rest on the table: hypotheses, static filter, shake test.

python -m intent_imitation.practise --archive FOLDER [--hand schunk] [--objects NAME,…] [--seed S]
                                    [--again]

Writes one archive per object, as `python -m intent_inference.simulate` does, and a table of their
features and labels (`tabletop.csv.gz`) for training and for judging; the library is then built from
both folders by `python -m intent_imitation.build_library`. An archive that exists is kept; with
`--again` its grasps are shaken once more, as is due when the shake test has changed.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from intent_imitation.workshop.practice.library_maker import varied
from intent_imitation.workshop.practice.resting_hypotheses import (
    RestingGrasp,
    TabletopConfig,
    room_on_table,
    tabletop_candidates,
)
from intent_inference.grasping.autograsp import ClosedGrasp
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.grasp_table import row_of_grasp, write_rows
from intent_inference.workshop.simulation.simulated_grasp import (
    SimulatedGrasp,
    load_grasps,
    save_grasps,
)
from intent_inference.workshop.simulation.stability import ShakeTest
from intent_perception.basics.arrays import Array
from intent_perception.basics.late_module import need
from intent_perception.objects.database import ObjectDatabase, ObjectModel

_TRIES = 700
"""Hypotheses tried for each rest of an object."""
_WANTED = (16, 6, 4)
"""Grasps wanted for the natural rest and for two others."""
_SHAKEN = 40
"""Candidates shaken at most for each rest."""


def practised_grasps(
    model: ObjectModel, hand: GraspingHand, rng: np.random.Generator
) -> list[SimulatedGrasp]:
    """Return the grasps of an object at rest that hold and still clear the table.

    Args:
        model: the object.
        hand: the robot's hand.
        rng: source of the hypotheses.
    """
    target, config = TaskObject(model), TabletopConfig()
    found: list[SimulatedGrasp] = []
    with ShakeTest(hand, model) as test:
        for pose, wanted in zip(model.stable_poses, _WANTED, strict=False):
            candidates = _spread(tabletop_candidates(target, hand, pose, rng, _TRIES, config))
            held: list[SimulatedGrasp] = []
            for candidate in candidates:
                grasp = _shaken(model, test, candidate)
                held += _with_room(target, hand, pose, [grasp]) if grasp.held else []
                if len(held) == wanted:
                    break
            found += held
    return found


def _spread(candidates: list[RestingGrasp]) -> list[RestingGrasp]:
    """Return the candidates to be shaken, each as different as possible from those before."""
    poses = np.array([c.grasp.T_object_hand for c in candidates]).reshape(-1, 4, 4)
    firmness = np.array([1.0 - c.residual for c in candidates])
    return [candidates[k] for k in varied(poses, firmness, _SHAKEN)]


def _shaken(model: ObjectModel, test: ShakeTest, candidate: RestingGrasp) -> SimulatedGrasp:
    result = test.run(candidate.grasp)
    return SimulatedGrasp(
        model.name,
        candidate.grasp.preshape,
        result.T_object_hand,
        result.joints,
        result.contacts,
        result.held,
        result.stability,
        result.penetration,
        candidate.residual,
        candidate.hypothesis.joints,
        candidate.hypothesis.approach,
    )


def shaken_again(
    model: ObjectModel, hand: GraspingHand, grasps: list[SimulatedGrasp]
) -> list[SimulatedGrasp]:
    """Return those of an object's grasps that hold under the present shake test, settled anew."""
    found = []
    with ShakeTest(hand, model) as test:
        for old in grasps:
            gaps = [float(np.abs(shape.open - old.pregrasp).max()) for shape in hand.preshapes]
            rates = hand.preshapes[int(np.argmin(gaps))].rates
            nothing = np.zeros((0, 3), dtype=np.float32), np.zeros(0, dtype=np.float32)
            closed = ClosedGrasp(old.preshape, old.T_object_hand, old.joints, rates, *nothing)
            result = test.run(closed)
            settled = replace(
                old,
                T_object_hand=result.T_object_hand,
                joints=result.joints,
                contacts=result.contacts,
                held=result.held,
                stability=result.stability,
                penetration=result.penetration,
            )
            found += [settled] if result.held else []
    return found


def _with_room(
    target: TaskObject, hand: GraspingHand, pose: Array, grasps: list[SimulatedGrasp]
) -> list[SimulatedGrasp]:
    """Return the grasps that, settled, do not touch the table."""
    if not grasps:
        return []
    room = room_on_table(
        hand,
        target,
        pose,
        np.array([grasp.T_object_hand for grasp in grasps]),
        np.array([grasp.approach for grasp in grasps]),
        np.array([grasp.pregrasp for grasp in grasps]),
        np.array([grasp.joints for grasp in grasps]),
    )
    return [grasp for grasp, gap in zip(grasps, room, strict=True) if gap > 0.0005]


def main() -> None:
    """Practise all objects and write archives and table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--archive", type=Path, required=True, help="folder of archives")
    parser.add_argument("--hand", default="schunk", help="name or file of the hand")
    parser.add_argument("--models", default=None, help="object database; default: the shipped one")
    parser.add_argument("--objects", default="", help="names, by commas; default: all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--again", action="store_true", help="shake archived grasps once more")
    arguments = parser.parse_args()
    need("pybullet")
    hand, database = (
        GraspingHand.load(arguments.hand),
        ObjectDatabase.load(arguments.models, alone=True),
    )
    wanted = (
        arguments.objects.split(",") if arguments.objects else [m.name for m in database.models]
    )
    rows = []
    for number, model in enumerate(database.models):
        if model.name not in wanted:
            continue
        file = arguments.archive / f"{model.name}.npz"
        if not file.is_file():
            rng = np.random.default_rng([arguments.seed, number])
            practised = practised_grasps(model, hand, rng)
            if not practised:
                print(f"{model.name:16s} no grasp holds", flush=True)
                continue
            save_grasps(file, practised)
        elif arguments.again:
            kept = shaken_again(model, hand, load_grasps(file)[0])
            if not kept:
                file.unlink()
                print(f"{model.name:16s} no grasp holds any more", flush=True)
                continue
            save_grasps(file, kept)
        grasps = load_grasps(file)[0]
        target = TaskObject(model)
        rows += [row_of_grasp(target, hand, grasp) for grasp in grasps]
        print(f"{model.name:16s} {len(grasps):3d}", flush=True)
    write_rows(arguments.archive / "tabletop.csv.gz", rows)
