"""Which of the possible grasps a person picks, how the object lies for it, and how the hand comes.

A grasp is tried on every way the object rests; the object is then turned on the table until the
arm is comfortable, as a person would put it there or walk around it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose, rotation_from_vector, transform_points
from intent_perception.objects.database import ObjectModel
from intent_tracking.workshop.person.acting.approach import approaches, leaves_function_free
from intent_tracking.workshop.person.acting.person_grasp import OPEN, Grasp, Taker
from intent_tracking.workshop.person.body.person_arm import PersonBody

_CLEARANCE = 0.0015
_BACKWARDS = np.array(
    [[-0.7, 0.0, -0.7], [-0.5, 0.0, -0.85], [-0.9, 0.0, -0.45], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0],
     [-0.6, 0.5, -0.6], [-0.6, -0.5, -0.6]]
)  # fmt: skip
"""Ways back from a grasp, in the hand frame."""


@dataclass(frozen=True, eq=False)
class Reach:
    """A grasp with everything that leads to it; table frame, right hand."""

    grasp: Grasp
    T_table_object: Array
    """(4, 4) where the object rests."""
    T_table_hand: Array
    """(4, 4) the wrist at the grasp."""
    T_table_pregrasp: Array
    """(4, 4) the wrist before the last straight move."""
    lift_to_close: bool
    """Whether the table keeps the fingers from closing until the object is lifted."""
    awkwardness: float


def plan_reaches(
    taker: Taker,
    model: ObjectModel,
    task: str,
    body: PersonBody,
    spot: Array,
    rng: np.random.Generator,
    accept: Callable[[Grasp], bool] | None = None,
    tries: int = 240,
    enough: int = 5,
) -> list[Reach]:
    """Return some grasps of an object for a task, at least one.

    Args:
        taker: closes the fingers.
        model: the object.
        task: what for.
        body: the person.
        spot: (2,) where on the table the object rests [m].
        rng: source of the variation.
        accept: a further condition on the grasp in the object frame.
        tries: at most so many approaches.
        enough: stop after so many grasps.

    Raises:
        ValueError: if no grasp is found.
    """
    found: list[Reach] = []
    for _ in range(max(1, tries // 24)):
        for rest in _rests(model, task):
            up = rest[:3, :3].T @ np.array([0.0, 0.0, 1.0])
            for grasp in taker.take(approaches(model, task, up, rng, 24)):
                skin = transform_points(grasp.T_object_hand, taker.points(grasp.angles))
                if not leaves_function_free(model, task, skin):
                    continue
                if accept is not None and not accept(grasp):
                    continue
                reach = _placed(taker, grasp, rest, body, spot, rng)
                if reach is not None:
                    found.append(reach)
            if len(found) >= enough:
                return found
    if found:
        return found
    raise ValueError(f"no comfortable grasp of {model.name} for {task!r} in {tries} tries")


def preference(reach: Reach) -> float:
    """Return how little a person likes a grasp: awkward for the arm, loose, with few fingers."""
    grasp = reach.grasp
    return reach.awkwardness + 3.0 * grasp.residual - 0.5 * len(grasp.touching)


def _rests(model: ObjectModel, task: str) -> Iterator[Array]:
    """Yield the ways the object rests that suit the task, (4, 4) each."""
    functions = model.functions
    opening = None if functions is None else functions.opening
    tool = functions is not None and opening is None and len(functions.handle) > 0
    plain = not tool and opening is None
    for rest in model.stable_poses[:1] if plain else model.stable_poses:
        if opening is not None:
            upright = float(rest[2, :3] @ opening.normal)
            wanted = -1.0 if task == "dish-washing" else 1.0
            if upright * wanted < 0.9:
                continue
        yield rest


def _placed(
    taker: Taker, grasp: Grasp, rest: Array, body: PersonBody, spot: Array, rng: np.random.Generator
) -> Reach | None:
    """Return the reach with the object turned to where the arm is most comfortable, or None."""
    if _heights(taker, grasp.open_angles, rest @ grasp.T_object_hand).min() < _CLEARANCE:
        grasp = replace(grasp, open_angles=OPEN["flat"])
        if _heights(taker, grasp.open_angles, rest @ grasp.T_object_hand).min() < _CLEARANCE:
            return None
        if taker.distances(grasp.open_angles, grasp.T_object_hand).min() < -0.002:
            return None
    closed = _heights(taker, grasp.angles, rest @ grasp.T_object_hand)
    best: Reach | None = None
    for yaw in rng.uniform(-np.pi, np.pi) + np.arange(24) * (np.pi / 12.0):
        turn = make_pose(rotation_from_vector(np.array([0, 0, yaw])), np.append(spot, 0.0))
        T_object = turn @ rest
        T_hand = T_object @ grasp.T_object_hand
        awkward = body.awkwardness(T_hand)
        if awkward > 4.0 or (best is not None and awkward >= best.awkwardness):
            continue
        before = _pregrasp(taker, grasp, T_object, T_hand, body)
        if before is not None:
            lift = bool(closed.min() < _CLEARANCE)
            best = Reach(grasp, T_object, T_hand, before, lift, awkward)
    return best


def _heights(taker: Taker, angles: Array, T_table_hand: Array) -> Array:
    """Return the height of the skin samples above the table (S,) [m]."""
    return np.asarray(transform_points(T_table_hand, taker.points(angles))[:, 2])


def _pregrasp(
    taker: Taker, grasp: Grasp, T_object: Array, T_hand: Array, body: PersonBody
) -> Array | None:
    """Return a wrist pose 9 cm back from where the open hand slides on without a collision."""
    ways = [T_hand[:3, :3] @ (way / np.linalg.norm(way)) for way in _BACKWARDS]
    ways = [way for way in ways if way[2] > -0.15]
    if grasp.T_object_hand is not None:
        ways.append(np.array([0.0, 0.0, 1.0]))
    best, cost = None, np.inf
    to_object = np.linalg.inv(T_object)
    for way in ways:
        clear = True
        for back in (0.015, 0.03, 0.05, 0.07, 0.09):
            pose = T_hand.copy()
            pose[:3, 3] += back * way + [0.0, 0.0, 0.1 * back]
            free = taker.distances(grasp.open_angles, to_object @ pose).min()
            if free < -0.0015 or _heights(taker, grasp.open_angles, pose).min() < _CLEARANCE:
                clear = False
                break
        if clear and body.awkwardness(pose) < cost:
            best, cost = pose, body.awkwardness(pose)
    return best


def free_closing(taker: Taker, reach: Reach, T_table_hand: Array) -> Array:
    """Return how far each finger can close over the table, (5,) shares of the way to the grasp."""
    start, end = reach.grasp.open_angles, reach.grasp.angles
    shares = np.zeros(5)
    for finger in range(5):
        low, high = 0.0, 1.0
        for step in range(7):
            share = 1.0 if step == 0 else 0.5 * (low + high)
            trial = start.copy()
            joints = slice(4 * finger, 4 * finger + 4)
            trial[joints] += share * (end[joints] - start[joints])
            if _heights(taker, trial, T_table_hand).min() > _CLEARANCE:
                low = share
                if step == 0:
                    break
            else:
                high = share
        shares[finger] = low
    return shares
