"""Class, shape and pose of things that no database holds, from one frame (Sec. IV-D)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, make_pose
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
from intent_perception.recognition.verification.explanation import settle
from intent_perception.scene.scene_view import SceneView

Maker = Callable[[SeenThing, Outline], Draft | None]
_LEAST_ODDS, _LEAST_RATIO = 0.3, 0.6
"""A class less probable, or of less than this share of what "none" has, is not said. Of things of
seeds below 1000, with networks that had seen neither their scene nor their mesh, .072 of no class
are called one and .87 of the others are told; with a ratio of 1 .040 and .853."""
_SURE = 0.8
"""Of what "none" and the class have together, from when on the class is said though no shape of it
was found: whether it is a mug or a glass does not make it neither."""
_WORSE, _DOUBTFULLY_WORSE = 0.45, 0.30
"""A shape of a class that is so much less like the thing than a plain one is not its shape."""
_LEAST_LIKE = 0.25
"""Nor is one that is hardly like it at all."""
_SETTLING = np.array([0.016, 0.012, 0.010, 0.008, 0.006, 0.005], np.float32)
"""Largest residuals in the refinements of a tool's pose [m]."""
_DENSITY = 350.0  # of what nobody knows [kg/m^3]
_MASSES = (0.02, 3.0)
_TOOLS: dict[str, Maker] = {"knife": knife, "hammer": hammer, "screwdriver": screwdriver}


@dataclass(frozen=True, eq=False)
class EstimatedShape:
    """One thing, with the shape and class that explain it best."""

    object_class: str
    """"" = none of the known."""
    make: Callable[[], ObjectModel]
    """Makes the model; only of what no known object explains is it needed."""
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

    @property
    def model(self) -> ObjectModel:
        """Mesh, class, colour, parts, annotations; without a name."""
        return self.make()


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
    best = 1 + int(np.argmax(odds[1:]))  # of the classes; the first is none
    chosen, object_class, bare = plain, "", False
    if odds[best] >= max(_LEAST_ODDS, _LEAST_RATIO * odds[0]):
        object_class = CLASSES[best]
        special = judge.best(_drafts(thing, outline, object_class), object_class in _TOOLS)
        if special is not None and _stands_up(special[1], plain and plain[1], odds[best]):
            chosen = special
        elif odds[best] < _SURE * (odds[best] + odds[0]):
            object_class = ""
        bare = chosen is not special
    if chosen is None:
        return None
    draft, likeness = chosen
    confidence = float(odds[CLASSES.index(object_class)])

    @cache
    def make() -> ObjectModel:
        model = finish(_weighed(draft.made, object_class), "estimated", object_class)
        if object_class and bare:  # what it is was told, but not where its parts are
            model = replace(model, functions=None)
        return model

    T_table_object = draft.T_table_draft @ make_pose(np.eye(3), draft.made.mesh.bounds.mean(axis=0))
    return EstimatedShape(object_class, make, T_table_object, confidence, likeness, thing, odds)


def _stands_up(special: Likeness, plain: Likeness | None, odds: float) -> bool:
    """Return whether the shape of a class explains a thing nearly as well as one of none."""
    if special.share < _LEAST_LIKE:
        return False
    allowed = _WORSE if odds >= _SURE else _DOUBTFULLY_WORSE
    return plain is None or special.share > plain.share - allowed


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

    def best(self, drafts: list[Draft], refined: bool = False) -> tuple[Draft, Likeness] | None:
        """Return the draft that is most like the thing, None without drafts.

        Args:
            drafts: the shapes to choose from.
            refined: whether their poses are refined on the depth image too.
        """
        tried = drafts + [self._settled(draft) for draft in drafts if refined]
        judged = [(draft, self._likeness(draft)) for draft in tried]
        return max(judged, key=lambda pair: pair[1].share, default=None)

    def _likeness(self, draft: Draft) -> Likeness:
        place = (self._thing, self._scene, self._T_table_camera)
        return likeness_of(draft.made.mesh, draft.T_table_draft, *place)

    def _settled(self, draft: Draft) -> Draft:
        """Return a draft with its pose refined on the pixels of the thing."""
        thing, scene, mesh = self._thing, self._scene, draft.made.mesh
        mask = np.zeros(scene.shape, np.uint8)
        mask[thing.window] = thing.mask
        middle = mesh.bounds.mean(axis=0)  # a pose is turned about its origin
        T_camera = inverse(self._T_table_camera) @ draft.T_table_draft
        T_camera = T_camera @ make_pose(np.eye(3), middle)
        pose = np.concatenate([T_camera[:3, :3].ravel(), T_camera[:3, 3]]).astype(np.float32)
        smooth, normals, _, intrinsics = scene.surface
        vertices = (mesh.vertices - middle).astype(np.float32)
        settle(pose, vertices, mesh.faces, smooth, normals, mask, intrinsics, _SETTLING, 1)
        u, _, vt = np.linalg.svd(pose[:9].reshape(3, 3).astype(np.float64))
        found = make_pose(u @ vt, pose[9:].astype(np.float64)) @ make_pose(np.eye(3), -middle)
        return Draft(draft.made, self._T_table_camera @ found)
