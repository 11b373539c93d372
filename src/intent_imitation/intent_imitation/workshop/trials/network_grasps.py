"""Grasps read off BN^R itself, Eq. (2) and (3), against preplanned hypotheses (Sec. IV-D).

The paper prefers hypotheses: a small error in the reconstructed posture gives grasps that hold
nothing, or fingers inside the object. Here both are carried through the same shake test. The
networks say where the palm is seen from the object's centre, how the hand is turned and how its
joints stand; how far away it is they do not say: it comes as near as the first touch allows.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from intent_imitation.planner.affordance import task_chances
from intent_imitation.planner.grasp_library import GraspLibrary
from intent_imitation.planner.library_hypotheses import Hypotheses, hypotheses_of, object_features
from intent_inference.grasping.autograsp import ClosedGrasp, hand_spheres, sphere_clearance
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.network.task_model import TaskModel
from intent_inference.quantisation.variables import coordinates_of
from intent_inference.workshop.simulation.stability import ShakeTest
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_quaternion
from intent_perception.objects.database import ObjectModel
from intent_tracking.grasp.grasp_features import palm_center

METHODS = ("component", "expected")
"""Eq. (2) at its likeliest component, on the manifold; Eq. (3), the expected value."""
_FAR, _STEP = 0.40, 0.001
_REACHED = 0.5
"""Tasks that the best hypothesis affords less likely than this are not compared."""


def compared(
    model: TaskModel,
    hand: GraspingHand,
    library: GraspLibrary,
    objects: Sequence[ObjectModel],
) -> dict[str, Any]:
    """Return how inferred grasps and the best hypotheses fare in the shake test.

    For every object and every task that one of its hypotheses affords: `hold` is the share that
    holds, `penetration_mm_median` how deep the fingers stick in the object where the palm is as
    far away as that of the best hypothesis, `task_median` is p(t | o, a).
    """
    found: dict[str, list[tuple[bool, float, float]]] = {name: [] for name in METHODS}
    found["hypothesis"] = []
    for item in objects:
        hypotheses = hypotheses_of(item, item.object_class, library.sets[item.name], hand)
        kinds = {item.object_class: 1.0}
        chances = task_chances(model, hypotheses.features, kinds)
        target = TaskObject(item)
        with ShakeTest(hand, item) as test:
            for column, task in enumerate(model.tasks):
                best = int(np.argmax(chances[:, column]))
                if chances[best, column] < _REACHED:
                    continue
                grasp = _hypothesis(hypotheses, hand, best)
                found["hypothesis"].append(
                    _judged(test, target, hand, grasp, grasp, float(chances[best, column]))
                )
                for method in METHODS:
                    posture = inferred_posture(model, task, item, method)
                    near = _placed(posture, hand, item, _palm_distance(grasp, hand, item))
                    touching = _touching(posture, hand, target)
                    chance = _chance(model, item, posture, column)
                    found[method].append(_judged(test, target, hand, near, touching, chance))
    return {name: _summary(rows) for name, rows in found.items()}


def inferred_posture(
    model: TaskModel, task: str, item: ObjectModel, method: str
) -> dict[str, Array]:
    """Return the likeliest or expected `npos`, `dir` and `fcon` for a task with an object."""
    known = object_features(item, item.object_class)
    values = {name: model.defuzzify(task, known, name, method) for name in ("npos", "dir", "fcon")}
    if method == "expected":  # Eq. (3) averages coordinates and leaves the manifold: back onto it
        values = {n: coordinates_of(n).project(value[None])[0] for n, value in values.items()}
    return {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}


def _hypothesis(hypotheses: Hypotheses, hand: GraspingHand, row: int) -> ClosedGrasp:
    grasps = hypotheses.grasps
    return _closed(hand, grasps.T_object_hand[row], grasps.grasp_joints[row])


def _closed(hand: GraspingHand, pose: Array, joints: Array) -> ClosedGrasp:
    """Return a posture as a grasp that the pre-shape nearest to it squeezes."""
    limits = hand.table.limits
    joints = np.clip(joints, limits[:, 0], limits[:, 1])
    still = [np.where(shape.rates == 0.0, shape.open - joints, 0.0) for shape in hand.preshapes]
    shape = hand.preshapes[int(np.argmin([np.abs(gap).max() for gap in still]))]
    nothing = np.zeros((0, 3), dtype=np.float32), np.zeros(0, dtype=np.float32)
    return ClosedGrasp(shape.name, pose, joints, shape.rates, *nothing)


def _palm_distance(grasp: ClosedGrasp, hand: GraspingHand, item: ObjectModel) -> float:
    palm = grasp.T_object_hand[:3, :3] @ palm_center(hand.table) + grasp.T_object_hand[:3, 3]
    return float(np.linalg.norm(palm - item.center))


def _placed(
    posture: dict[str, Array], hand: GraspingHand, item: ObjectModel, distance: float
) -> ClosedGrasp:
    """Return the inferred posture with the palm at a distance from the object's centre [m]."""
    rotation = rotation_from_quaternion(posture["dir"] / np.linalg.norm(posture["dir"]))
    towards = posture["npos"] / max(float(np.linalg.norm(posture["npos"])), 1e-9)
    origin = item.center + distance * towards - rotation @ palm_center(hand.table)
    return _closed(hand, make_pose(rotation, origin), posture["fcon"])


def _touching(posture: dict[str, Array], hand: GraspingHand, target: TaskObject) -> ClosedGrasp:
    """Return the inferred posture moved in from far away until it touches the object."""
    distance = _FAR
    grasp = _placed(posture, hand, target.model, distance)
    while distance > 0.0 and _depth(grasp, hand, target) <= 0.0:
        distance -= _STEP
        grasp = _placed(posture, hand, target.model, distance)
    return grasp


def _depth(grasp: ClosedGrasp, hand: GraspingHand, target: TaskObject) -> float:
    """Return how deep the hand is inside the object [m]; negative: how far off."""
    spheres = hand_spheres(hand, grasp.T_object_hand, grasp.joints)
    return -float(sphere_clearance(hand, target.field, spheres).min())


def _chance(model: TaskModel, item: ObjectModel, posture: dict[str, Array], column: int) -> float:
    features = {**object_features(item, item.object_class)}
    features.update({name: value[None] for name, value in posture.items()})
    return float(task_chances(model, features, {item.object_class: 1.0})[0, column])


def _judged(
    test: ShakeTest,
    target: TaskObject,
    hand: GraspingHand,
    near: ClosedGrasp,
    touching: ClosedGrasp,
    chance: float,
) -> tuple[bool, float, float]:
    """Return whether a grasp holds, how deep the hand is inside the object and p(t | o, a)."""
    return bool(test.run(touching).held), max(0.0, _depth(near, hand, target)), chance


def _summary(rows: list[tuple[bool, float, float]]) -> dict[str, Any]:
    if not rows:
        return {"count": 0, "hold": None, "penetration_mm_median": None, "task_median": None}
    held, depth, chance = np.array(rows, dtype=np.float64).T
    return {
        "count": len(rows),
        "hold": float(held.mean()),
        "penetration_mm_median": 1e3 * float(np.median(depth)),
        "task_median": float(np.median(chance)),
    }
