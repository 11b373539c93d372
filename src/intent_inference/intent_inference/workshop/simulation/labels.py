"""Task labels of a stable grasp from the versioned rules in share/label_rules.yaml."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference import SHARE
from intent_inference.grasping.autograsp import hand_spheres, sphere_clearance
from intent_inference.grasping.contacts import Contacts, touching
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.label_terms import (
    GraspScene,
    Terms,
    column_terms,
    direction_terms,
    dish_washing_terms,
    hand_over_terms,
    pouring_terms,
    tool_use_terms,
    vessel_handle_terms,
)
from intent_inference.workshop.simulation.receivers import receiver_bank, with_forearm
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_yaml

RULES = SHARE / "label_rules.yaml"
TASKS = ("hand-over", "pouring", "tool-use", "dish-washing")
_SKIN = 0.006
"""A measured posture's skin counts as touching this far off: bones, thickness, soft flesh [m]."""
NOT_FOR_CLASS = -1.0
"""Margin of a task that no grasp of the class affords."""


@dataclass(frozen=True, eq=False)
class TaskLabel:
    """Whether a grasp affords a task, and how clearly."""

    afforded: bool | None
    """None where the object's annotations do not say."""
    margin: float
    """The least of the terms; at least 0 where the task is afforded; NaN where unknown."""
    terms: Terms
    """Margin of every term of the rule."""


@lru_cache(maxsize=4)
def load_rules(path: Path = RULES) -> dict[str, Any]:
    """Return the label rules of a YAML file."""
    rules = read_yaml(path)
    missing = [task for task in TASKS if task not in rules]
    if missing:
        raise ValueError(f"{path}: expected a rule for each of {TASKS}, {missing} are missing")
    return dict(rules)


def label_grasp(
    target: TaskObject,
    hand: GraspingHand,
    T_object_hand: Array,
    joints: Array,
    contacts: Contacts | None = None,
    *,
    friction: float = 0.8,
    with_forces: bool = True,
) -> dict[str, TaskLabel]:
    """Return which tasks a stable grasp affords.

    Args:
        target: the object.
        hand: the hand; a left hand's grasp is first mirrored (`features.as_right_hand`).
        T_object_hand: (4, 4).
        joints: (J,) [rad].
        contacts: contacts with their forces; None = where the posture touches the surface.
        friction: Coulomb coefficient of the holding forces.
        with_forces: False leaves out the terms that solve for holding forces, a quick look.
    """
    rules = load_rules()
    if target.model.functions is None:
        return {task: TaskLabel(None, float("nan"), {}) for task in TASKS}
    spheres = hand_spheres(hand, T_object_hand, joints)
    if contacts is None:
        clearance = sphere_clearance(hand, target.field, spheres)
        shift = max(0.0, float(clearance.min()))  # a tracked hand may float off the surface
        contacts = touching(hand, target.field, spheres, clearance - np.float32(shift + _SKIN))
    centers, radii = with_forearm(hand, T_object_hand, spheres)
    scene = GraspScene(
        target,
        hand,
        T_object_hand,
        joints,
        contacts,
        centers,
        radii,
        len(spheres),
        friction,
        with_forces,
    )
    return {task: _label(scene, task, rules) for task in TASKS}


def renewed_terms(
    target: TaskObject, hand: GraspingHand, T_object_hand: Array, joints: Array
) -> dict[str, Terms]:
    """Return of each task the terms that need neither measured forces nor receivers.

    Args:
        target: the object, with annotations.
        hand: the hand.
        T_object_hand: (4, 4).
        joints: (J,) [rad].
    """
    rules, kind = load_rules(), target.model.object_class
    spheres = hand_spheres(hand, T_object_hand, joints)
    clearance = sphere_clearance(hand, target.field, spheres)
    shift = max(0.0, float(clearance.min()))
    contacts = touching(hand, target.field, spheres, clearance - np.float32(shift))
    centers, radii = with_forearm(hand, T_object_hand, spheres)
    scene = GraspScene(
        target, hand, T_object_hand, joints, contacts, centers, radii, len(spheres), 0.8, False
    )
    functions = scene.functions
    renewed: dict[str, Terms] = {task: {} for task in TASKS}
    if functions.opening is not None and functions.handle:
        renewed["hand-over"] = vessel_handle_terms(scene, rules["hand-over"])
    if functions.opening is not None and kind in rules["pouring"]["classes"]:
        renewed["pouring"] = column_terms(scene, rules["pouring"])
    if kind in rules["tool-use"]["classes"]:
        renewed["tool-use"] = direction_terms(scene, "tool-use", rules["tool-use"])
    return renewed


def pointing_tasks(
    target: TaskObject, hand: GraspingHand, T_object_hand: Array, tasks: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the tasks that a hand of this orientation could still afford, whatever it touches."""
    rules, functions = load_rules(), target.model.functions
    if functions is None:
        return tasks
    none = Contacts(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))
    empty = np.zeros((0, 3)), np.zeros(0)
    scene = GraspScene(
        target, hand, T_object_hand, np.zeros(0), none, *empty, 0, 0.8, with_forces=False
    )
    kind = target.model.object_class
    return tuple(
        task
        for task in tasks
        if (rules[task]["classes"] == "all" or kind in rules[task]["classes"])
        and min(direction_terms(scene, task, rules[task]).values(), default=0.0) >= 0.0
    )


def _label(scene: GraspScene, task: str, rules: dict[str, Any]) -> TaskLabel:
    rule, kind = rules[task], scene.target.model.object_class
    if task == "pouring" and kind in rule["classes"] and scene.functions.opening is None:
        return TaskLabel(None, float("nan"), {})
    if rule["classes"] != "all" and kind not in rule["classes"]:
        known = kind in rules["known_classes"]
        return TaskLabel(False if known else None, NOT_FOR_CLASS if known else float("nan"), {})
    if task == "hand-over":
        bank = receiver_bank(scene.target, rule["receivers_on_handle"])
        terms = hand_over_terms(scene, rule, bank)
    elif task == "pouring":
        terms = pouring_terms(scene, rule)
    elif task == "tool-use":
        terms = tool_use_terms(scene, rule)
    else:
        terms = dish_washing_terms(scene, rule)
    margin = min(terms.values())
    return TaskLabel(bool(margin >= 0.0), float(np.clip(margin, -5.0, 5.0)), terms)
