"""Grasp hypotheses of an object and their features: from the library, or planned on the fly."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from intent_imitation.planner.class_from_shape import shape_of
from intent_imitation.planner.grasp_library import GraspLibrary, GraspSet, empty_set, grasp_set
from intent_inference.grasping.grasp_candidates import CandidateSource
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.quantisation.feature_table import Features
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import quaternion_from_rotation
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_perception.objects.model_memory import ModelMemory
from intent_tracking.grasp.grasp_features import palm_center

_FEW = 24
"""Tries of a rehearsal."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """G grasps of one object with Table I, ready for BN^R."""

    grasps: GraspSet
    features: Features
    """O, A and C of every grasp, G rows."""
    object_features: Features
    """O alone, one row."""


class HypothesisSource:
    """Gives the hypotheses of any object of a database, each computed once."""

    def __init__(
        self, database: ObjectDatabase, library: GraspLibrary, hand: GraspingHand, tries: int
    ) -> None:
        self._models = database
        self._library = library
        self._hand = hand
        self._tries = tries
        self._distances = ModelMemory(database, lambda model: SignedDistance.from_mesh(model.mesh))
        self._of_class = ModelMemory[dict[str, Hypotheses]](database, lambda _: {})

    def knows(self, name: str) -> bool:
        """Return whether the database holds a model."""
        return name in self._models

    def unpractised(self) -> list[str]:
        """Return the models of a known class of which the library has no grasps."""
        names = (name for name in self._models.names if name not in self._library.sets)
        return [name for name in names if self._models[name].object_class]

    def rehearse(self, model: ObjectModel) -> None:
        """Go once through what an object without a library needs, with a few tries."""
        hypotheses_of(model, model.object_class, plan_unshaken(model, self._hand, _FEW), self._hand)

    def model(self, name: str) -> ObjectModel:
        """Return a model of the database."""
        return self._models[name]

    def distance(self, model: str) -> SignedDistance:
        """Return the signed distance of a model's mesh, in its object frame."""
        return self._distances[model]

    def kinds(self, model: str, object_class: str) -> Mapping[str, float]:
        """Return p(class) of a model: as told, or from its shape where it is "" = unknown."""
        if object_class:
            return {object_class: 1.0}
        return self._library.kinds.chances(shape_of(self._models[model], self.distance(model)))

    def of(self, model: str, object_class: str) -> Hypotheses:
        """Return the hypotheses of a model as one of a class ("" = unknown)."""
        known = self._of_class[model]
        if object_class not in known:
            known[object_class] = hypotheses_of(
                self._models[model], object_class, self._grasps(model), self._hand
            )
        return known[object_class]

    def _grasps(self, model: str) -> GraspSet:
        stored = self._library.sets.get(model)
        if stored is not None:
            return stored
        return plan_unshaken(self._models[model], self._hand, self._tries)


def hypotheses_of(
    model: ObjectModel, object_class: str, grasps: GraspSet, hand: GraspingHand
) -> Hypotheses:
    """Return grasps of a model with their features.

    Args:
        model: the object; its mesh gives size and convexity.
        object_class: as recognised, "" where unknown.
        grasps: of that object.
        hand: the robot's hand.
    """
    count = len(grasps)
    known = object_features(model, object_class)
    features = {name: np.repeat(value, count, axis=0) for name, value in known.items()}
    palms = grasps.T_object_hand[:, :3, :3] @ palm_center(hand.table)
    palms += grasps.T_object_hand[:, :3, 3] - model.center
    features["npos"] = palms / np.linalg.norm(palms, axis=1, keepdims=True)
    features["dir"] = quaternion_from_rotation(grasps.T_object_hand[:, :3, :3])
    features["fcon"] = grasps.grasp_joints
    features["fvol"] = grasps.free_volume
    features["coc"] = grasps.contact_center
    features["gbvl"] = grasps.grasped_box
    return Hypotheses(grasps, features, known)


def plan_unshaken(model: ObjectModel, hand: GraspingHand, tries: int) -> GraspSet:
    """Return grasps of an object that nobody has practised with: static filter, no shake test.

    The same tries give the same grasps: the source of randomness starts from zero for each object.

    Args:
        model: the object; without a volume it gets no grasps.
        hand: the robot's hand.
        tries: number of hypotheses tried.
    """
    try:
        target = TaskObject(model)
    except ValueError:
        return empty_set(len(hand.table.joint_names))
    source = CandidateSource(target, hand, np.random.default_rng(0))
    found = source.take(tries, tries)
    poses = [candidate.grasp.T_object_hand for candidate in found]
    return grasp_set(
        target.geometry,
        hand,
        np.array(poses).reshape(-1, 4, 4),
        np.array([candidate.hypothesis.approach for candidate in found]).reshape(-1, 3),
        [candidate.hypothesis.joints for candidate in found],
        [candidate.grasp.joints for candidate in found],
        np.array([0.5 * (1.0 - candidate.residual) for candidate in found]),
        shaken=False,
    )


def object_features(model: ObjectModel, object_class: str) -> Features:
    """Return the O features of a model as one row; an open mesh has no convexity."""
    features: Features = {"obcl": np.array([object_class]), "size": model.size[None]}
    if model.mesh.is_watertight and model.mesh.volume > 0.0:
        features["conv"] = np.array([[model.convexity]])
    return features
