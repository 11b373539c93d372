"""Which tasks a demonstrated grasp affords, by the label rules of the simulated grasps."""

from functools import cache

import numpy as np

from intent_inference.grasping.contacts import Contacts
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.labels import TASKS, TaskLabel, label_grasp
from intent_perception.objects.database import ObjectModel
from intent_tracking.workshop.person.acting.person_grasp import Grasp

_HAND = GraspingHand.load("human")
_OBJECTS: dict[str, TaskObject] = {}


def task_labels(model: ObjectModel, grasp: Grasp) -> dict[str, TaskLabel]:
    """Return the labels of a demonstrator's (right) grasp, with the contacts of its own skin."""
    if model.name not in _OBJECTS:
        _OBJECTS[model.name] = TaskObject(model)
    link = np.array([_link(int(own)) for own in grasp.links], dtype=np.int64)
    contacts = Contacts(grasp.contacts, grasp.normals, link, np.ones(len(link)))
    return label_grasp(_OBJECTS[model.name], _HAND, grasp.T_object_hand, grasp.angles, contacts)


def label_row(model: ObjectModel, grasp: Grasp) -> list[float]:
    """Return 1, 0 or NaN for each of `TASKS`."""
    labels = task_labels(model, grasp)
    cells = [labels[task].afforded for task in TASKS]
    return [np.nan if cell is None else float(cell) for cell in cells]


@cache
def _link(own: int) -> int:
    """Return the link of the simulated hand (palm, then knuckle and three bones per finger)."""
    if own == 0:
        return 0
    finger, level = divmod(own - 1, 3)
    return 1 + 4 * finger + 1 + level
