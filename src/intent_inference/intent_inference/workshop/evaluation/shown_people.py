"""What rendered demonstrations show: objects in no training set, people of their own, true labels.

One person shows one object several times, half of the people in grasps that afford the task shown.
The object is one of the parametric makers' with other proportions, so it is in no database; the
person's hand is not the one that grasps were simulated with; a grasp is found by closing that
person's fingers, and what it affords is what the label rules say of it and of the contacts of that
person's skin.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from intent_inference.grasping.contacts import Contacts
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.labels import TASKS, label_grasp
from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.families.designed_object import DesignedObject, finish, parts_of
from intent_perception.objects.model import Functions, ObjectModel, Part
from intent_perception.workshop.things.object_catalogue import MAKERS
from intent_tracking.workshop.person.acting.person_grasp import Grasp, Taker
from intent_tracking.workshop.person.acting.reaching import Reach, plan_reaches
from intent_tracking.workshop.person.acting.script import (
    Act,
    Scenario,
    Script,
    enact,
    sample_body,
    sample_spots,
)
from intent_tracking.workshop.person.acting.task_moves import Pace
from intent_tracking.workshop.person.body.felt_solid import graspable
from intent_tracking.workshop.person.body.person_arm import PersonBody
from intent_tracking.workshop.person.body.person_hand import sample_hand
from intent_tracking.workshop.person.body.skin import Skin, make_skin

SHOWN = {
    "mug": {"pouring": 3, "dish-washing": 2, "hand-over": 1},
    "knife": {"tool-use": 4, "hand-over": 2},
    "bottle": {"pouring": 4, "hand-over": 2},
    "hammer": {"tool-use": 4, "hand-over": 2},
    "glass": {"pouring": 3, "dish-washing": 2, "hand-over": 1},
    "screwdriver": {"tool-use": 4, "hand-over": 2},
}
"""Class to the purposes for which the demonstrator takes it, and how often: `TIMES` in all. What
nearly every grasp affords is shown less often."""
TIMES = 6
"""Demonstrations of one object by one person."""
_PACE = Pace(go_on=21)
"""The motion goes on until more than a second after lift-off."""
_STRETCH = 0.15
_SPACING = 0.0032
"""Grid in which a person's skin is meshed: two pixels of the picture [m]."""


@dataclass(frozen=True, eq=False)
class Showing:
    """One demonstration before it is filmed."""

    scenario: Scenario
    script: Script
    skin: Skin
    target: TaskObject
    labels: dict[str, bool | None]
    """Task to whether the true grasp affords it; None: unknown."""


@dataclass(frozen=True, eq=False)
class _Lesson:
    """One person with one object, and the grasps that this person found."""

    model: ObjectModel
    target: TaskObject
    skin: Skin
    taker: Taker
    body: PersonBody
    reaches: tuple[tuple[str, Reach], ...]
    """Purpose and grasp of each demonstration."""


def showing(seed: int) -> Showing:
    """Return the demonstration of a seed; the seed decides everything.

    Raises:
        ValueError: if the person found no comfortable grasp for it.
    """
    lesson = _lesson(seed // TIMES)
    if seed % TIMES >= len(lesson.reaches):
        raise ValueError(f"{lesson.model.name}: no further comfortable grasp")
    task, reach = lesson.reaches[seed % TIMES]
    rng = np.random.default_rng([seed, 20_000])
    act = Act(lesson.model.name, task)
    scenario = Scenario("demonstration", (act,), side=lesson.skin.hand.side, pace=_PACE)
    models = {lesson.model.name: lesson.model}
    script = enact(scenario, models, lesson.body, [lesson.taker], [reach], rng)
    labels = true_labels(lesson.target, reach.grasp)
    return Showing(scenario, script, lesson.skin, lesson.target, labels)


@lru_cache(maxsize=1)
def _lesson(number: int) -> _Lesson:
    rng = np.random.default_rng([number, 20_001])
    names = tuple(SHOWN)
    model_class = names[number % len(names)]
    name = f"unseen_{model_class}_{number}"
    model = stretched(model_class, int(rng.integers(len(MAKERS[model_class]))), rng, name)
    skin = make_skin(sample_hand(rng, "left" if rng.random() < 0.15 else "right"), _SPACING)
    body = sample_body(rng)
    taker = Taker(skin, graspable(model), rng)
    target = TaskObject(model)
    proper = number // len(names) % 2 == 1  # else as it comes: many such grasps do not afford it
    reaches: list[tuple[str, Reach]] = []
    for task, times in SHOWN[model_class].items():
        spot = sample_spots(1, rng)[0]
        accept = partial(_affords, target, task) if proper else None
        try:
            found = plan_reaches(taker, model, task, body, spot, rng, accept, enough=times)
        except ValueError:
            continue  # this person cannot take this object so
        reaches.extend((task, reach) for reach in _different(found, times))
    return _Lesson(model, target, skin, taker, body, tuple(reaches))


def _affords(target: TaskObject, task: str, grasp: Grasp) -> bool:
    return true_labels(target, grasp)[task] is not False


def _different(found: Sequence[Reach], count: int) -> list[Reach]:
    """Return the most comfortable grasps, of several from one approach the first only."""
    kept: list[Reach] = []
    for reach in sorted(found, key=lambda own: own.awkwardness):
        pose = reach.grasp.T_object_hand
        if not any(np.allclose(pose, other.grasp.T_object_hand) for other in kept):
            kept.append(reach)
    return kept[:count]


def true_labels(target: TaskObject, grasp: Grasp) -> dict[str, bool | None]:
    """Return which tasks a demonstrator's (right) grasp affords, by its own skin's contacts."""
    links = np.array([_simulated_link(int(own)) for own in grasp.links], dtype=np.int64)
    contacts = Contacts(grasp.contacts, grasp.normals, links, np.ones(len(links)))
    labels = label_grasp(target, _human(), grasp.T_object_hand, grasp.angles, contacts)
    return {task: labels[task].afforded for task in TASKS}


def _simulated_link(own: int) -> int:
    """Return the simulated hand's link (palm; knuckle and three bones per finger)."""
    if own == 0:
        return 0
    finger, level = divmod(own - 1, 3)
    return 1 + 4 * finger + 1 + level


@lru_cache(maxsize=1)
def _human() -> GraspingHand:
    return GraspingHand.load("human")


def stretched(model_class: str, index: int, rng: np.random.Generator, name: str) -> ObjectModel:
    """Return an object of a class that is in no database: a parametric one with other proportions.

    Args:
        model_class: one of the six classes.
        index: which of its eight makers.
        rng: source of the factors.
        name: of the new object.
    """
    draft = MAKERS[model_class][index]()
    across, along = 1.0 + rng.uniform(-_STRETCH, _STRETCH, 2)
    factor = np.array([across, across, along])

    def scaled(mesh: Mesh) -> Mesh:
        return Mesh(mesh.vertices * factor, mesh.faces)

    return finish(
        replace(
            draft,
            mesh=scaled(draft.mesh),
            parts=tuple(Part(part.name, scaled(part.mesh)) for part in parts_of(draft)),
            functions=_stretched_functions(draft, factor),
        ),
        name,
        model_class,
    )


def _stretched_functions(draft: DesignedObject, factor: Array) -> Functions:
    functions = draft.functions
    opening, edge, face, tip = functions.opening, functions.edge, functions.face, functions.tip
    if opening is not None:
        opening = replace(
            opening, center=opening.center * factor, radius=float(opening.radius * factor[0])
        )
    if edge is not None:
        edge = replace(edge, start=edge.start * factor, end=edge.end * factor)
    if face is not None:
        face = replace(face, center=face.center * factor)
    return replace(
        functions, opening=opening, edge=edge, face=face,
        tip=None if tip is None else tip * factor,
    )  # fmt: skip
