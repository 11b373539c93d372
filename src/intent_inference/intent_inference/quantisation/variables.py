"""The variables of Table I and the coordinates in which each is learnt.

Orientations live on SO(3) (q and -q are the same one), unit positions on the sphere, lengths are
positive: Gaussians are fitted in coordinates where distances mean what they should, and results are
brought back onto the manifold.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import quaternion_from_rotation, rotation_from_quaternion

OBJECT_CLASS = "obcl"
OBJECT = ("obcl", "size", "conv")
ACTION = ("dir", "npos", "fcon")
CONSTRAINT = ("fvol", "coc", "gbvl")
VARIABLES = (*OBJECT, *ACTION, *CONSTRAINT)

_SHORTEST = 1e-3  # m: edges below a millimetre are equal
_CROSS = np.array([
    [[0, 0, 0], [0, 0, 1], [0, -1, 0]],
    [[0, 0, -1], [0, 0, 0], [1, 0, 0]],
    [[0, 1, 0], [-1, 0, 0], [0, 0, 0]],
], dtype=np.float64)  # fmt: skip
"""Levi-Civita symbol: (w x r)_i = e_ijk w_j r_k."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """How one kind of variable is embedded in the space of the mixture, and back."""

    embed: Callable[[Array], Array]
    """Values (N, D) to coordinates (N, E)."""
    jacobian: Callable[[Array, Array], Array]
    """Values (N, D) and their standard deviations (N, D) to (N, E, R): columns are one standard
    deviation of independent noises, in coordinates."""
    project: Callable[[Array], Array]
    """Coordinates (N, E) to the nearest valid values (N, D)."""


def _diagonal(deviation: Array) -> Array:
    result: Array = deviation[:, :, None] * np.eye(deviation.shape[1])
    return result


def _embed_rotation(quaternion: Array) -> Array:
    rotation = rotation_from_quaternion(quaternion)
    coordinates: Array = np.concatenate([rotation[:, :, 0], rotation[:, :, 2]], axis=1)
    return coordinates


def _rotation_jacobian(quaternion: Array, deviation: Array) -> Array:
    coordinates = _embed_rotation(quaternion)
    # A rotation by the small angle a moves the unit quaternion by a / 2, spread over 3 directions.
    angle = 2.0 * np.linalg.norm(deviation, axis=1) / np.sqrt(3.0)
    moved = [np.einsum("ijk,nk->nij", _CROSS, coordinates[:, part : part + 3]) for part in (0, 3)]
    jacobian: Array = np.concatenate(moved, axis=1) * angle[:, None, None]
    return jacobian


def _project_rotation(coordinates: Array) -> Array:
    x = coordinates[:, :3] / np.maximum(np.linalg.norm(coordinates[:, :3], axis=1), 1e-9)[:, None]
    z = coordinates[:, 3:] - np.sum(coordinates[:, 3:] * x, axis=1, keepdims=True) * x
    z /= np.maximum(np.linalg.norm(z, axis=1), 1e-9)[:, None]
    return quaternion_from_rotation(np.stack([x, np.cross(z, x), z], axis=2))


def _embed_direction(position: Array) -> Array:
    length = np.linalg.norm(position, axis=1, keepdims=True)
    if np.any(length < _SHORTEST):
        raise ValueError("npos: expected unit vectors, got one of length zero")
    return position / length


def _direction_jacobian(position: Array, deviation: Array) -> Array:
    unit = _embed_direction(position)
    tangent = np.eye(3) - unit[:, :, None] * unit[:, None]
    return np.asarray(tangent * deviation[:, None])


def _identity(values: Array) -> Array:
    return values


_PLAIN = Coordinates(_identity, lambda _, deviation: _diagonal(deviation), _identity)
_LENGTHS = Coordinates(
    lambda edges: np.log(np.maximum(edges, _SHORTEST)),
    lambda edges, deviation: _diagonal(deviation / np.maximum(edges, _SHORTEST)),
    np.exp,
)
_SHARES = Coordinates(
    _identity, lambda _, deviation: _diagonal(deviation), lambda share: np.clip(share, 0.0, 1.0)
)
_COORDINATES = {
    "size": _LENGTHS,
    "gbvl": _LENGTHS,
    "conv": _SHARES,
    "fvol": _SHARES,
    "dir": Coordinates(_embed_rotation, _rotation_jacobian, _project_rotation),
    "npos": Coordinates(_embed_direction, _direction_jacobian, _embed_direction),
}


def coordinates_of(variable: str) -> Coordinates:
    """Return the coordinates in which a continuous variable of Table I is learnt."""
    return _COORDINATES.get(variable, _PLAIN)


def split_observed(variables: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Return the sets of observed variables for which posteriors are calibrated, by name."""
    masks = {
        "full": variables,
        "partial": tuple(v for v in variables if v not in CONSTRAINT),
        "partial_fig5": tuple(v for v in variables if v not in ("fvol", "gbvl")),
        "position": tuple(v for v in variables if v in (OBJECT_CLASS, "npos")),
        "object": tuple(v for v in variables if v in OBJECT),
        "no_class": tuple(v for v in variables if v != OBJECT_CLASS),
        "no_class_partial": tuple(
            v for v in variables if v != OBJECT_CLASS and v not in CONSTRAINT
        ),
        "shape": tuple(v for v in variables if v in OBJECT and v != OBJECT_CLASS),
    }
    return {name: chosen for name, chosen in masks.items() if chosen}
