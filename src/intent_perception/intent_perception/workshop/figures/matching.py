"""Is a detection right? The pose errors that the recognition benchmark counts by."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import rotation_angle, transform_points
from intent_perception.objects.model import ObjectModel

FOUND = 0.1
"""Largest ADD of an object that counts as found, in diameters."""
_SAMPLES = 800


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the truth, over the object's true symmetries."""

    distance: float
    """Mean distance between points of both placed surfaces (ADD, ADD-S) [m]."""
    translation: float
    """Distance between both origins [m]."""
    rotation: float
    """Angle between both orientations [rad]."""


def surface_points(model: ObjectModel) -> Array:
    """Return points (N, 3) of a model's surface, always the same ones, object frame [m]."""
    return model.mesh.sample_surface(_SAMPLES, np.random.default_rng(0))[0]


def pose_error(model: ObjectModel, points: Array, T_found: Array, T_true: Array) -> PoseError:
    """Return the error of a pose against the true one (4, 4), for the best of all symmetries.

    Args:
        model: the object.
        points: `surface_points` of it.
        T_found: pose found.
        T_true: true pose in the same frame.
    """
    true = transform_points(T_true, points)
    best = PoseError(np.inf, np.inf, np.inf)
    for T_object_object in model.symmetry.transforms(72):
        T_same = T_found @ T_object_object
        distance = np.linalg.norm(transform_points(T_same, points) - true, axis=1).mean()
        if distance < best.distance:
            shift = float(np.linalg.norm(T_same[:3, 3] - T_true[:3, 3]))
            turn = float(rotation_angle(T_same[:3, :3].T @ T_true[:3, :3]))
            best = PoseError(float(distance), shift, turn)
    return best


def surface_gap(placed: Array, true: Array) -> float:
    """Return the mean distance between two placed surfaces of points (N, 3), the larger way [m]."""
    there = float(np.mean(cKDTree(true).query(placed)[0]))
    back = float(np.mean(cKDTree(placed).query(true)[0]))
    return max(there, back)
