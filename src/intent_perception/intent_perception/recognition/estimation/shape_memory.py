"""Estimated shapes over time: a thing keeps its id, and the better of its shapes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.objects.database import REVISION
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.estimation.shape_estimator import EstimatedShape

NAME = "thing"
"""Ids are this, and for further things this with a number: classes may change as more is seen."""
_SAME_PLACE = 0.05
"""A thing found again within this distance is the same [m]."""
_ALIKE = 0.25
"""Moved things are the same if their sizes differ by less than this share."""
_BETTER = 0.04
"""A new shape must explain this much more to replace one that is known."""


def shape_name(object_id: str, revision: int) -> str:
    """Return the name under which a revision of a thing's shape is looked up."""
    return f"{object_id}{REVISION}{revision}"


@dataclass(frozen=True, eq=False)
class KeptShape:
    """A thing that has an id."""

    id: str
    """Unique in the scene."""
    revision: int
    """Grows as the shape improves."""
    shape: EstimatedShape
    """What is known of it; its model has the name `shape_name(id, revision)`."""


def merit_of(shape: EstimatedShape) -> float:
    """Return how much a shape tells: it explains what is seen, and little of it is hidden."""
    return shape.likeness.share * (1.0 - min(shape.thing.hidden, 0.9))


class ShapeMemory:
    """The things of the answers so far; revisions never go back while a run lasts."""

    def __init__(self) -> None:
        self._revisions: dict[str, int] = {}
        self.forget()

    def forget(self) -> None:
        """Know no thing; ids may come again, with higher revisions."""
        self._kept: tuple[KeptShape, ...] = ()

    def named(self, shapes: Sequence[EstimatedShape], taken: set[str]) -> tuple[KeptShape, ...]:
        """Return things with their ids, each with the better of its old and its new shape.

        Args:
            shapes: of the present answer.
            taken: ids of known objects.
        """
        matches = self._matches(shapes)
        used = taken | {kept.id for kept in matches.values()}
        answer = []
        for number, shape in enumerate(shapes):
            before = matches.get(number)
            if before is None:
                fresh = _free(used)
                used.add(fresh)
                answer.append(self._revised(fresh, shape))
            elif self._improves(before.shape, shape):
                answer.append(self._revised(before.id, shape))
            else:
                answer.append(replace(before, shape=_moved(before.shape, shape)))
        self._kept = tuple(answer)
        return self._kept

    def _matches(self, shapes: Sequence[EstimatedShape]) -> dict[int, KeptShape]:
        """Return of which things before the present ones are, by number: near, else alike."""
        pairs = []
        for number, shape in enumerate(shapes):
            for kept in self._kept:
                gap = float(np.linalg.norm(_place(shape) - _place(kept.shape)))
                differs = _difference(shape.model, kept.shape.model)
                if gap < _SAME_PLACE:
                    pairs.append((gap, number, kept))
                elif differs < _ALIKE:
                    pairs.append((1.0 + differs, number, kept))
        found: dict[int, KeptShape] = {}
        for _, number, kept in sorted(pairs, key=lambda pair: pair[0]):
            if number not in found and kept not in found.values():
                found[number] = kept
        return found

    def _improves(self, old: EstimatedShape, new: EstimatedShape) -> bool:
        """Return whether a new shape tells more: a class where there was none, or a better fit."""
        if new.object_class != old.object_class:
            return new.confidence * merit_of(new) > old.confidence * merit_of(old) + _BETTER
        return merit_of(new) > merit_of(old) + _BETTER

    def _revised(self, object_id: str, shape: EstimatedShape) -> KeptShape:
        revision = self._revisions.get(object_id, -1) + 1
        self._revisions[object_id] = revision
        model = replace(shape.model, name=shape_name(object_id, revision))
        return KeptShape(object_id, revision, replace(shape, make=lambda: model))


def _moved(old: EstimatedShape, new: EstimatedShape) -> EstimatedShape:
    """Return an old shape where the thing is now.

    A thing that has hardly moved keeps its pose: a worse look shall not shake it.
    """
    near = float(np.linalg.norm(_place(old) - _place(new))) < 0.3 * _SAME_PLACE
    return old if near else replace(old, T_table_object=new.T_table_object)


def _place(shape: EstimatedShape) -> Array:
    return np.asarray(shape.T_table_object[:3, 3])


def _difference(first: ObjectModel, second: ObjectModel) -> float:
    if first.object_class != second.object_class:
        return 1.0
    sizes = np.sort(first.size), np.sort(second.size)
    return float(np.max(np.abs(sizes[0] - sizes[1]) / np.maximum(sizes[1], 1e-3)))


def _free(used: set[str]) -> str:
    number = 1
    while (name := NAME if number == 1 else f"{NAME}.{number}") in used:
        number += 1
    return name
