"""All models side by side in the arrays that the recogniser's kernels read (offline phase)."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.transforms import make_pose
from intent_perception.objects.loading import GREY
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.proposal.model_surface import surface_of
from intent_perception.recognition.proposal.pair_hash import PairTable
from intent_perception.recognition.proposal.proposal_arrays import ModelArrays, RestingArrays
from intent_perception.recognition.proposal.table_prior import resting_table
from intent_perception.recognition.verification.alternatives import (
    spin_axis,
    turns,
    turns_that_matter,
)

SURFACE_POINTS = 500
"""Oriented points kept of each model."""
COARSE_POINTS = 72
"""Of these, how many the coarse stage of the verification looks at."""
PAIR_DISTANCES = (0.03, 0.06, 0.10, 0.15)
"""Distances between the points of a pair [m], scaled with the library's median diameter."""
PAIR_TOLERANCE = 0.0035
PAIR_CAPACITY = 6000
_SECTOR = np.pi / 3.0  # azimuths that stand for the whole turn of a symmetric object


@dataclass(frozen=True, eq=False)
class ModelLibrary:
    """Models with their frames moved to the centres of their bounding boxes."""

    models: tuple[ObjectModel, ...]
    """In the order of their numbers."""
    centers: Floats
    """(M, 3) centre of each model's bounding box in its object frame [m]."""
    axes: Floats
    """(M, 3) direction of continuous symmetry, zero without."""
    colors: Floats
    """(M, 3) RGB in 0..1, NaN where the model has none."""
    points: Floats
    """(P, 3) oriented points of all models [m], and their normals."""
    normals: Floats
    """(P, 3)."""
    point_areas: Floats
    """(M,) area of the surface that one of a model's points stands for [m^2]."""
    offsets: NDArray[np.int64]
    """(M + 1,) where each model's points begin."""
    coarse: NDArray[np.int64]
    """(M,) how many of a model's points the coarse stage uses."""
    spin_points: Floats
    """(M, 3) a point of the axis about which each model is nearest to a surface of revolution."""
    turns: tuple[Floats, ...]
    """M times (K, 3, 3) turns that may look alike, see `alternatives`."""
    turns_matter: tuple[NDArray[np.bool_], ...]
    """M times (K,) which of them change what an ideal camera could see."""
    vertices: tuple[Floats, ...]
    """M times (V, 3) mesh vertices [m]."""
    faces: tuple[NDArray[np.int32], ...]
    """M times (F, 3)."""
    pairs: PairTable
    """The hash table of Sec. III-A."""
    resting: RestingArrays
    """Points of resting models, for the table prior."""

    @property
    def arrays(self) -> ModelArrays:
        """The points of all models for compiled code."""
        return ModelArrays(self.points, self.normals, self.offsets, self.coarse, self.axes)

    @classmethod
    def of(cls, models: Iterable[ObjectModel]) -> "ModelLibrary":
        """Return the library of some models; the same models give the same library.

        Raises:
            ValueError: if there are no models, or one shows no surface.
        """
        chosen = tuple(models)
        if not chosen:
            raise ValueError("expected at least one model to recognise, got none")
        centers = np.array([m.center for m in chosen], np.float32)
        surfaces = [
            surface_of(model, SURFACE_POINTS, np.random.default_rng(number))
            for number, model in enumerate(chosen)
        ]
        points = [s.points - c for s, c in zip(surfaces, centers, strict=True)]
        offsets = np.cumsum([0] + [len(p) for p in points]).astype(np.int64)
        axes = np.array([_axis(m) for m in chosen], np.float32)
        sectors = [_sector(p, a) for p, a in zip(points, axes, strict=True)]
        scale = float(np.median([m.diameter for m in chosen])) / 0.2
        pairs = PairTable.empty(
            tuple(d * max(1.0, scale) for d in PAIR_DISTANCES),
            PAIR_TOLERANCE * max(1.0, scale),
            PAIR_CAPACITY,
        ).with_models([(k, s, sectors[k]) for k, s in enumerate(surfaces)])
        all_points = np.concatenate(points)
        all_normals = np.concatenate([s.normals for s in surfaces])
        poses = [
            (m.stable_poses @ make_pose(np.eye(3), m.center)).astype(np.float32) for m in chosen
        ]
        spins = [spin_axis(p, s.normals) for p, s in zip(points, surfaces, strict=True)]
        turned = tuple(
            turns(direction, not axis.any())
            for (_, direction), axis in zip(spins, axes, strict=True)
        )
        return cls(
            models=chosen,
            centers=centers,
            axes=axes,
            colors=np.array([_color(m) for m in chosen], np.float32),
            points=all_points,
            normals=all_normals,
            point_areas=np.array(
                [m.mesh.areas.sum() / len(p) for m, p in zip(chosen, points, strict=True)],
                np.float32,
            ),
            offsets=offsets,
            coarse=np.minimum(COARSE_POINTS, np.diff(offsets)),
            spin_points=np.array([point for point, _ in spins], np.float32),
            turns=turned,
            turns_matter=tuple(
                turns_that_matter(p, s.normals, rotations, spin[0].astype(np.float32))
                for p, s, rotations, spin in zip(points, surfaces, turned, spins, strict=True)
            ),
            vertices=tuple((m.mesh.vertices - m.center).astype(np.float32) for m in chosen),
            faces=tuple(m.mesh.faces for m in chosen),
            pairs=pairs,
            resting=resting_table(
                all_points, all_normals, offsets, poses, axes, np.concatenate(sectors)
            ),
        )

    def named(self, name: str) -> ObjectModel:
        """Return the model with a name."""
        return next(model for model in self.models if model.name == name)

    def __len__(self) -> int:
        """Return the number of models."""
        return len(self.models)

    def __iter__(self) -> Iterator[ObjectModel]:
        """Iterate over the models in the order of their numbers."""
        return iter(self.models)

    def object_pose(self, number: int, pose: NDArray[Any]) -> Array:
        """Return T_camera_object (4, 4) of a pose (12,) of a model's centred frame."""
        rotation = pose[:9].reshape(3, 3).astype(np.float64)
        u, _, vt = np.linalg.svd(rotation)
        rotation = u @ vt
        return make_pose(
            rotation, pose[9:].astype(np.float64) - rotation @ self.centers[number].astype(float)
        )

    def centred_pose(self, number: int, T_camera_object: Array) -> Floats:
        """Return the pose (12,) of a model's centred frame: the inverse of `object_pose`."""
        rotation = T_camera_object[:3, :3]
        place = T_camera_object[:3, 3] + rotation @ self.centers[number].astype(float)
        return np.concatenate([rotation.ravel(), place]).astype(np.float32)


def _color(model: ObjectModel) -> Array:
    return np.full(3, np.nan) if np.array_equal(model.color, GREY) else np.asarray(model.color)


def _axis(model: ObjectModel) -> Array:
    return np.zeros(3) if model.symmetry.axis is None else np.asarray(model.symmetry.axis)


def _sector(points: Floats, axis: Floats) -> NDArray[np.bool_]:
    if not axis.any():
        return np.ones(len(points), dtype=bool)
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    azimuth = np.arctan2(points @ np.cross(axis, across), points @ across)
    near_axis = np.hypot(points @ np.cross(axis, across), points @ across) < 0.003
    sector: NDArray[np.bool_] = (np.abs(azimuth) < _SECTOR / 2.0) | near_axis
    return sector
