"""What a frame asks of a hypothesis about the scene, and what answers it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.image.appearance import AppearanceModel
from intent_tracking.image.frame_evidence import FrameEvidence, KeyEvidence, Labelled, Prior
from intent_tracking.image.labelling import Pixels
from intent_tracking.image.tile import Tile
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_model import FITTED_LIMITS
from intent_tracking.scene.object_kernel import ObjectArrays, geometry_of
from intent_tracking.scene.packed_objects import PackedObjects
from intent_tracking.scene.posture_prior import shipped_posture

SINGLE_LIMITS = np.ascontiguousarray(FITTED_LIMITS, dtype=np.float32)


class Ties(NamedTuple):
    """What the fit expects of each active object, see `Prior`."""

    touch: Floats
    place: Floats
    turn: Floats


@dataclass(frozen=True, eq=False)
class View:
    """One frame cut out and labelled for one prediction."""

    tile: Tile
    pixels: Pixels
    evidence: FrameEvidence
    seen: Labelled


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What all hypotheses about a scene share: its objects, its table, its colours, its camera."""

    objects: PackedObjects
    appearance: AppearanceModel
    table: Array | None
    """(4,) plane in the camera's frame; None: there is none."""
    T_table_camera: Array
    """(4, 4)."""


def surroundings_of(
    objects: RecognizedObjects, models: Sequence[ObjectModel], table: bool
) -> Surroundings:
    """Return what is known of a scene when its objects have been recognised.

    Args:
        objects: with the pose of the camera.
        models: of the objects, one each.
        table: False: a table is not to be counted on.
    """
    T_table_camera = np.asarray(objects.T_table_camera, dtype=np.float64)
    T_camera_table = inverse(T_table_camera)
    normal = T_camera_table[:3, 2]
    plane = np.concatenate([normal, [-normal @ T_camera_table[:3, 3]]])
    return Surroundings(
        PackedObjects([geometry_of(model) for model in models]),
        AppearanceModel([model.color for model in models]),
        plane if table and objects.table_seen else None,
        T_table_camera,
    )


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked of a fit: the frame seen around a guess, and what is expected there."""

    view: View
    guess: BodyState
    """Of the hand and all objects."""
    active: tuple[int, ...]
    """Objects that take part; the others rest where they are."""
    objects: ObjectArrays
    """The active ones."""
    ties: Ties
    keys: KeyEvidence
    """Of the hand, if a network has seen it."""
    seed: int
    """Of its random draws."""

    @property
    def start(self) -> BodyState:
        """The guess of the hand and the active objects."""
        return self.guess.chosen(list(self.active))

    def prior(self, start: BodyState, ties: Ties | None = None) -> Prior:
        """Return what the refinement expects: to stay near a start, by these ties."""
        ties = self.ties if ties is None else ties
        return Prior(start.values, start.rotations, SINGLE_LIMITS, shipped_posture(), *ties)


@dataclass(frozen=True, eq=False)
class Fit:
    """Hand and active objects after a frame."""

    state: BodyState
    """Of the hand and the active objects only."""
    normal: Floats
    """(D, D) normal matrix (lower triangle) in the order of the state."""
    cost: float
    """C per hand pixel, see `objective`."""
    total: float
    """C plus penetration, what decides between fits of one view."""
