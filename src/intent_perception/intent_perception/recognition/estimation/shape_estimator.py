"""Class, shape and pose of things that no database holds, from one frame (Sec. IV-D)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.families.designed_object import DesignedObject, finish
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.estimation.belongings import readings_of
from intent_perception.recognition.estimation.class_odds import CLASSES, class_odds
from intent_perception.recognition.estimation.completion import completed
from intent_perception.recognition.estimation.estimated_parts import Draft
from intent_perception.recognition.estimation.likeness import Likeness, likeness_of
from intent_perception.recognition.estimation.outlines import Outline
from intent_perception.recognition.estimation.things import SeenThing
from intent_perception.recognition.estimation.tool_shapes import hammer, knife, screwdriver
from intent_perception.recognition.estimation.vessel_shapes import lying_vessel, standing_vessel
from intent_perception.scene.scene_view import SceneView

Maker = Callable[[SeenThing, Outline], Draft | None]
_LEAST_ODDS = 0.5
_WORSE = 0.22  # a class whose shape is this much less like the thing than a plain one is none
_LEAST_LIKE = 0.40  # the same for a shape that is hardly like it at all
_DENSITY = 350.0  # of what nobody knows [kg/m^3]
_MASSES = (0.02, 3.0)
_TOOLS: dict[str, Maker] = {"knife": knife, "hammer": hammer, "screwdriver": screwdriver}


@dataclass(frozen=True, eq=False)
class EstimatedShape:
    """One thing, with the shape and class that explain it best."""

    model: ObjectModel
    """Mesh, class ("" = none of the known), colour, parts, annotations; without a name."""
    T_table_object: Array
    """(4, 4)."""
    confidence: float
    """Probability that the class is right."""
    likeness: Likeness
    """How well the shape explains what is seen."""
    thing: SeenThing
    """What it was estimated from."""
    odds: Array
    """(7,) probability of each of `class_odds.CLASSES`."""


def estimated_shapes(
    scene: SceneView, T_table_camera: Array, rng: np.random.Generator
) -> list[EstimatedShape]:
    """Return the shapes of everything in a scene that stands apart on its table.

    Args:
        scene: with a table, and the pixels that may be things.
        T_table_camera: (4, 4).
        rng: chooses the points that are looked at.
    """
    found = []
    for thing, outline in readings_of(scene, T_table_camera, rng):
        shape = estimated_shape(thing, outline, scene, T_table_camera)
        if shape is not None:
            found.append(shape)
    return found


def estimated_shape(
    thing: SeenThing, outline: Outline, scene: SceneView, T_table_camera: Array
) -> EstimatedShape | None:
    """Return the shape of one thing, None where not even a hull can be made of it."""
    odds = class_odds(outline.features)
    judge = _Judge(thing, scene, T_table_camera)
    plain = judge.best(_drafts(thing, outline, ""))
    best = int(np.argmax(odds))
    chosen, object_class = plain, ""
    if CLASSES[best] and odds[best] >= _LEAST_ODDS:
        special = judge.best(_drafts(thing, outline, CLASSES[best]))
        if special is not None and _stands_up(special[1], plain and plain[1]):
            chosen, object_class = special, CLASSES[best]
    if chosen is None:
        return None
    draft, likeness = chosen
    confidence = float(odds[CLASSES.index(object_class)])
    model = finish(_weighed(draft.made, object_class), "estimated", object_class)
    T_table_object = draft.T_table_draft @ make_pose(np.eye(3), draft.made.mesh.bounds.mean(axis=0))
    return EstimatedShape(model, T_table_object, confidence, likeness, thing, odds)


def _stands_up(special: Likeness, plain: Likeness | None) -> bool:
    if special.share < _LEAST_LIKE:
        return False
    return plain is None or special.share > plain.share - _WORSE


def _drafts(thing: SeenThing, outline: Outline, object_class: str) -> list[Draft]:
    """Return the shapes that a thing of a class may have."""
    drafts: list[Draft | None] = []
    if object_class in _TOOLS:
        drafts.append(_TOOLS[object_class](thing, outline))
    else:
        drafts.append(standing_vessel(thing, outline, object_class))
        drafts.append(lying_vessel(thing, outline, object_class))
    if not object_class:
        drafts.append(completed(thing))
    return [draft for draft in drafts if draft is not None]


def _weighed(made: DesignedObject, object_class: str) -> DesignedObject:
    """Return a draft of no class with a mass that goes with its size."""
    if object_class:
        return made
    return replace(made, mass=float(np.clip(_DENSITY * made.mesh.convex_hull.volume, *_MASSES)))


class _Judge:
    """Compares drafts with one thing."""

    def __init__(self, thing: SeenThing, scene: SceneView, T_table_camera: Array) -> None:
        self._thing, self._scene, self._T_table_camera = thing, scene, T_table_camera

    def best(self, drafts: list[Draft]) -> tuple[Draft, Likeness] | None:
        """Return the draft that is most like the thing, None without drafts."""
        judged = [
            (
                draft,
                likeness_of(
                    draft.made.mesh,
                    draft.T_table_draft,
                    self._thing,
                    self._scene,
                    self._T_table_camera,
                ),
            )
            for draft in drafts
        ]
        return max(judged, key=lambda pair: pair[1].share, default=None)
