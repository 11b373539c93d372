"""Build the robot's grasp library from simulated, shaken grasps.

python -m intent_imitation.build_library --grasps FOLDER [FOLDER …] [--hand schunk] [--out FILE]

A folder holds the archives that `python -m intent_inference.simulate --hand schunk` leaves, or
`python -m intent_imitation.practise`, one per object. Grasps are chosen for stability and variety
alone: labels and margins are never read.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_imitation.planner.class_from_shape import Kinds, shape_of
from intent_imitation.planner.grasp_library import LIBRARIES, GraspLibrary, GraspSet, grasp_set
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.workshop.simulation.grasp_table import without_duplicates
from intent_inference.workshop.simulation.simulated_grasp import SimulatedGrasp, load_grasps
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import output_file
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_tracking.grasp.grasp_features import GraspedShape

_SHIFT, _TURN = 0.03, 0.5
"""A wrist shift [m] and a turn [rad] that count as equally different."""


def varied(T_object_hand: Array, stability: Array, count: int) -> NDArray[np.int64]:
    """Return the rows of at most `count` grasps, spread over wrist poses, stable ones preferred.

    Farthest-point choice: each next grasp is the one farthest from all chosen ones, its distance
    weighted by its stability.

    Args:
        T_object_hand: (N, 4, 4).
        stability: (N,) in 0..1.
        count: grasps wanted.
    """
    if len(stability) == 0:
        return np.zeros(0, dtype=np.int64)
    turns = T_object_hand[:, :3, :3].reshape(-1, 9) / (np.sqrt(2.0) * _TURN)
    places = np.concatenate([T_object_hand[:, :3, 3] / _SHIFT, turns], axis=1)
    chosen = [int(np.argmax(stability))]
    gap = np.linalg.norm(places - places[chosen[0]], axis=1)
    weight = 0.3 + stability
    while len(chosen) < min(count, len(stability)):
        best = int(np.argmax(gap * weight))
        if gap[best] <= 0.0:
            break
        chosen.append(best)
        gap = np.minimum(gap, np.linalg.norm(places - places[best], axis=1))
    return np.array(chosen, dtype=np.int64)


def set_of(
    model: ObjectModel, hand: GraspingHand, grasps: list[SimulatedGrasp], count: int
) -> GraspSet:
    """Return the library entry of one object from its simulated grasps."""
    held = [grasp for grasp in grasps if grasp.held]
    poses = np.array([grasp.T_object_hand for grasp in held]).reshape(-1, 4, 4)
    joints = np.array([g.joints for g in held]).reshape(len(held), len(hand.table.joint_names))
    stability = np.clip(np.array([grasp.stability for grasp in held], dtype=np.float64), 0.0, 1.0)
    distinct = without_duplicates(poses, joints, list(np.argsort(-stability, kind="stable")))
    rows = distinct[varied(poses[distinct], stability[distinct], count)]
    return grasp_set(
        GraspedShape(model),
        hand,
        poses[rows],
        np.array([held[row].approach for row in rows]).reshape(-1, 3),
        [held[row].pregrasp for row in rows],
        [held[row].joints for row in rows],
        stability[rows],
        shaken=True,
    )


def kinds_of(models: Sequence[ObjectModel]) -> Kinds:
    """Return what objects of known classes look like."""
    told = [model for model in models if model.object_class]
    shapes = [shape_of(model, SignedDistance.from_mesh(model.mesh)) for model in told]
    return Kinds(
        tuple(model.name for model in told),
        tuple(model.object_class for model in told),
        np.array(shapes),
    )


def main(command_line: Sequence[str] | None = None) -> None:
    """Build a library and print how many grasps each object got."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--grasps", type=Path, nargs="+", required=True, help="folders of archives (.npz)"
    )
    parser.add_argument("--hand", default="schunk", help="name or file of the hand")
    parser.add_argument("--models", default=None, help="object database; default: the shipped one")
    parser.add_argument("--count", type=int, default=200, help="grasps per object at most")
    parser.add_argument("--out", type=output_file, default=None, help="library file (.npz)")
    arguments = parser.parse_args(command_line)
    hand = GraspingHand.load(arguments.hand)
    database = ObjectDatabase.load(arguments.models, alone=True)
    by_object: dict[str, list[SimulatedGrasp]] = {}
    for archive in (file for folder in arguments.grasps for file in sorted(folder.glob("*.npz"))):
        for grasp in load_grasps(archive)[0]:
            by_object.setdefault(grasp.object_name, []).append(grasp)
    known = {model.name: model for model in database.models}
    sets = {
        name: set_of(known[name], hand, grasps, arguments.count)
        for name, grasps in by_object.items()
        if name in known
    }
    sets = {name: grasps for name, grasps in sets.items() if len(grasps) > 0}
    if not sets:
        parser.error(f"no held grasps of known objects in {', '.join(map(str, arguments.grasps))}")
    file = arguments.out or LIBRARIES / f"{hand.name}.npz"
    kinds = kinds_of([known[name] for name in sets])
    GraspLibrary(arguments.hand, sets, kinds).save(file)
    for name, grasps in sets.items():
        print(f"{name:20s} {len(grasps):4d} of {len(by_object[name])}")
    print(
        f"{file}: {sum(len(g) for g in sets.values())} grasps, {file.stat().st_size / 1e6:.1f} MB"
    )
