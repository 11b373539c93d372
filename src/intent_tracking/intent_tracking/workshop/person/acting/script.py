"""A planned demonstration: who does what with which object, and the whole motion of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectModel
from intent_tracking.workshop.person.acting.going_on import (
    Going,
    Obstacle,
    filmed_on,
    in_mirror,
)
from intent_tracking.workshop.person.acting.hand_motion import Choreography, HandMotion
from intent_tracking.workshop.person.acting.person_grasp import OPEN, Grasp, Taker
from intent_tracking.workshop.person.acting.reaching import Reach, plan_reaches, preference
from intent_tracking.workshop.person.acting.task_moves import (
    Pace,
    come,
    home,
    leave,
    put_back,
    take_and_use,
)
from intent_tracking.workshop.person.body.felt_solid import graspable
from intent_tracking.workshop.person.body.person_arm import PersonBody
from intent_tracking.workshop.person.body.skin import Skin, wrist_turn

_TOUCH = 0.0015
_CROWD = 0.035


@dataclass(frozen=True)
class Act:
    """One thing that is taken for one purpose."""

    object: str
    """Model name."""
    task: str
    """Task of the contract."""
    grasped: bool = True
    """False: the hand only hovers there and goes on."""


@dataclass(frozen=True)
class Scenario:
    """What a bag shows."""

    name: str
    acts: tuple[Act, ...]
    """In the order in which they are shown; each with an object of its own."""
    others: tuple[str, ...] = ()
    """Models that only stand on the table."""
    side: str = "right"
    """Hand of the demonstrator."""
    hesitate: int = 0
    """Frames of a pause in front of the object."""
    pass_by: bool = False
    """Whether the hand first hovers over another object."""
    pace: Pace = field(default_factory=Pace)


@dataclass(frozen=True, eq=False)
class Script(Going):
    """F frames of a demonstration in the table frame, on the demonstrator's own side."""

    models: tuple[ObjectModel, ...]
    """The N objects: those of the acts, then the others."""
    edge: float
    """y of the table edge [m]."""
    grasp_frames: tuple[int, ...]
    """Per grasping act, the frame in which the grasp is stable."""
    touch_frames: tuple[int, ...]
    """Per grasping act, the first frame in which skin touches the object."""
    grips: Array
    """(D, 4, 4) T_object_hand of each grasping act."""
    grasps: tuple[Grasp, ...]
    """The same grasps in full, of the right hand."""


def rehearse(
    scenario: Scenario, models: Mapping[str, ObjectModel], skin: Skin, rng: np.random.Generator,
    accept: Callable[[ObjectModel, str, Grasp], bool] | None = None,
) -> Script:  # fmt: skip
    """Return the motion of a scenario.

    Args:
        scenario: what is shown.
        models: the objects by name.
        skin: the person's hand.
        rng: source of everything that varies.
        accept: a further condition on a grasp (right hand) of an object for a task.

    Raises:
        ValueError: if no comfortable grasp or no room on the table is found.
    """
    body = sample_body(rng)
    chosen = [models[act.object] for act in scenario.acts]
    takers = [Taker(skin, graspable(model), rng) for model in chosen]
    reaches = []
    spots = sample_spots(len(chosen), rng)
    for taker, model, act, spot in zip(takers, chosen, scenario.acts, spots, strict=True):
        suits = None if accept is None else partial(accept, model, act.task)
        found = plan_reaches(taker, model, act.task, body, spot, rng, suits)
        reaches.append(min(found, key=preference))
    return enact(scenario, models, body, takers, reaches, rng)


def enact(
    scenario: Scenario, models: Mapping[str, ObjectModel], body: PersonBody, takers: list[Taker],
    reaches: list[Reach], rng: np.random.Generator,
) -> Script:  # fmt: skip
    """Return the motion of a scenario whose grasps are planned.

    Args:
        scenario: what is shown.
        models: the objects by name.
        body: the person.
        takers: per act, the person's hand around its object.
        reaches: per act, the grasp.
        rng: source of everything that varies.

    Raises:
        ValueError: if there is no room on the table.
    """
    chosen = [models[act.object] for act in scenario.acts]
    rest = np.array([reach.T_table_object for reach in reaches])
    stage = Choreography(home(body), OPEN["power"], rest, rng)
    stables, ends = _play(stage, scenario, takers, reaches, body, rng)
    motion = stage.motion(rng.uniform(0.7, 1.3))
    touches = tuple(
        _first_touch(taker, motion, index, stage_stable)
        for index, (taker, stage_stable) in enumerate(zip(takers, stables, strict=True))
        if stage_stable is not None
    )
    elbows, shoulders = body.arms(motion.hands)
    wrists = np.array([wrist_turn(T, e) for T, e in zip(motion.hands, elbows, strict=True)])
    grips = [r.grasp.T_object_hand for r, s in zip(reaches, stables, strict=True) if s is not None]
    grip = np.array(grips).reshape(-1, 4, 4)
    shown = Going(motion.hands, motion.angles, wrists, elbows, shoulders, motion.objects)
    own = shown
    if scenario.side == "left":
        own, flip = in_mirror(shown), np.diag([1.0, -1.0, 1.0, 1.0])
        grip = flip @ grip @ flip
    swept = _swept(own.hands, own.elbows, own.objects, chosen)
    others = [models[name] for name in scenario.others]
    placed = _place_others(others, swept, own.objects[0], chosen, rng)
    late = np.zeros(len(stables), dtype=np.int64)
    if scenario.pace.go_on:
        tasks = [act.task for act in scenario.acts]
        stand = _obstacles(others, placed, scenario.side)
        further = rng.spawn(1)[0]  # what is drawn here moves nothing that is drawn elsewhere
        parts, late = filmed_on(shown, ends, tasks, scenario.pace, body, stand, further)
        own = in_mirror(parts) if scenario.side == "left" else parts
    still = np.tile(np.array(placed).reshape(1, -1, 4, 4), (len(own.hands), 1, 1, 1))
    acted = [n for n, stable in enumerate(stables) if stable is not None]
    return Script(
        own.hands, own.angles, own.wrists, own.elbows, own.shoulders,
        np.concatenate([own.objects, still], axis=1), (*chosen, *others), body.edge,
        tuple(int(s + late[n]) for n, s in enumerate(stables) if s is not None),
        tuple(int(touch + late[n]) for touch, n in zip(touches, acted, strict=True)), grip,
        tuple(reaches[n].grasp for n in acted),
    )  # fmt: skip


def sample_body(rng: np.random.Generator) -> PersonBody:
    """Return how tall a person is and how far from the table."""
    edge = rng.uniform(0.28, 0.34)
    shoulder = np.array([rng.uniform(-0.22, -0.17), edge + rng.uniform(0.10, 0.17), 0.0])
    shoulder[2] = rng.uniform(0.34, 0.42)
    return PersonBody(shoulder, rng.uniform(0.28, 0.31), rng.uniform(0.25, 0.275), edge)


def sample_spots(count: int, rng: np.random.Generator) -> Array:
    """Return places (count, 2) on the table for the objects that are taken [m]."""
    first = np.array([rng.uniform(-0.10, 0.06), rng.uniform(-0.06, 0.06)])
    spots = [first]
    for _ in range(count - 1):
        side = 1.0 if spots[-1][0] < 0.0 else -1.0
        spots.append(
            np.array([spots[-1][0] + side * rng.uniform(0.22, 0.27), rng.uniform(-0.05, 0.05)])
        )
    return np.array(spots)


def _play(
    stage: Choreography, scenario: Scenario, takers: list[Taker], reaches: list[Reach],
    body: PersonBody, rng: np.random.Generator,
) -> tuple[list[int | None], list[int | None]]:  # fmt: skip
    """Append all acts; return the frames in which grasps are stable and their tasks have begun.

    Both are None for an act without a grasp.
    """
    pace = replace(scenario.pace, hesitate=scenario.hesitate)
    stage.wait(9)
    stables: list[int | None] = []
    ends: list[int | None] = []
    if scenario.pass_by:
        beside = reaches[0].T_table_pregrasp.copy()
        beside[:3, 3] += [rng.uniform(0.09, 0.13), rng.uniform(-0.08, -0.03), 0.10]
        come(stage, beside, reaches[0].grasp.open_angles, body, pace.reach)
    for index, (act, taker, reach) in enumerate(zip(scenario.acts, takers, reaches, strict=True)):
        if not act.grasped:
            come(stage, reach.T_table_pregrasp, reach.grasp.open_angles, body, pace.reach)
            halfway = reach.grasp.open_angles + 0.4 * (reach.grasp.angles - reach.grasp.open_angles)
            stage.close(8, halfway)
            stage.wait(10)
            stage.close(6, reach.grasp.open_angles)
            stables.append(None)
            ends.append(None)
            continue
        stables.append(take_and_use(stage, taker, reach, index, act.task, pace, body, rng))
        ends.append(stage.frame)
        if index + 1 < len(scenario.acts):
            put_back(stage, reach, index, pace)
    if stables[-1] is None:
        leave(stage, OPEN["power"], body, pace.reach)
    return stables, ends


def _obstacles(others: list[ObjectModel], placed: list[Array], side: str) -> list[Obstacle]:
    """Return what stands on the table as the right hand would meet it."""
    swap = np.array([-1.0, 1.0]) if side == "left" else np.ones(2)
    return [
        (pose[:2, 3] * swap, _radius(model, pose), _top(model, pose))
        for model, pose in zip(others, placed, strict=True)
    ]


def _first_touch(taker: Taker, motion: HandMotion, index: int, stable: int) -> int:
    """Return the first frame in which the skin comes within 1.5 mm of an object."""
    before = stable
    for frame in range(stable, -1, -1):
        T_object_hand = inverse(motion.objects[frame, index]) @ motion.hands[frame]
        if taker.distances(motion.angles[frame], T_object_hand).min() > _TOUCH:
            break
        before = frame
    return before


def _swept(hands: Array, elbows: Array, objects: Array, models: list[ObjectModel]) -> Array:
    """Return points (P, 3) that hand, forearm and carried objects pass through, table frame [m]."""
    local = np.array([[x, y, z] for x in (0.02, 0.09, 0.15) for y in (-0.05, 0.0, 0.05)
                      for z in (0.0, 0.04)])  # fmt: skip
    points = []
    for T_hand, elbow, poses in zip(hands[::3], elbows[::3], objects[::3], strict=True):
        points.append(local @ T_hand[:3, :3].T + T_hand[:3, 3])
        points.append(T_hand[:3, 3] + np.linspace(0, 1, 5)[:, None] * (elbow - T_hand[:3, 3]))
        for pose, model in zip(poses, models, strict=True):
            corners = model.mesh.vertices[:: max(1, len(model.mesh.vertices) // 60)]
            points.append(corners @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(points)


def _place_others(
    others: list[ObjectModel], swept: Array, taken: Array, models: list[ObjectModel],
    rng: np.random.Generator,
) -> list[Array]:  # fmt: skip
    """Return poses for the objects that stay: out of the way and beside each other."""
    placed: list[Array] = []
    circles = [(T[:2, 3], _radius(model, T)) for T, model in zip(taken, models, strict=True)]
    for model in others:
        for attempt in range(4000):
            rest = model.stable_poses[0]
            spot = np.array([rng.uniform(-0.32, 0.32), rng.uniform(-0.14, 0.16)])
            turn = make_pose(
                rotation_from_vector(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])),
                np.append(spot, 0.0),
            )
            pose = turn @ rest
            radius, top = _radius(model, pose), _top(model, pose)
            near = np.hypot(*(swept[swept[:, 2] < top + 0.02][:, :2] - spot).T)
            crowd = _CROWD if attempt < 2500 else 0.012
            free = near.size == 0 or near.min() > radius + crowd
            if free and all(
                np.hypot(*(spot - other)) > radius + size + crowd for other, size in circles
            ):
                placed.append(pose)
                circles.append((spot, radius))
                break
        else:
            raise ValueError(f"no room on the table for {model.name}")
    return placed


def _radius(model: ObjectModel, pose: Array) -> float:
    points = model.mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
    return float(np.hypot(*(points[:, :2] - pose[:2, 3]).T).max())


def _top(model: ObjectModel, pose: Array) -> float:
    return float((model.mesh.vertices @ pose[2, :3] + pose[2, 3]).max())
