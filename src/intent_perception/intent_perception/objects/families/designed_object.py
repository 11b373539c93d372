"""What a maker of a parametric object returns, and how it becomes an ObjectModel."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.model import (
    Edge,
    Face,
    Functions,
    ObjectModel,
    Opening,
    Part,
    Symmetry,
)
from intent_perception.objects.resting import rest_pose, stable_poses

Color = tuple[float, float, float]
"""RGB in 0..1."""
AXIS = Symmetry(np.array([0.0, 0.0, 1.0]))
"""Any turn about z. Flutes and facets below 1.5 mm, less than the sensor's noise, do not count."""
NOTHING = Symmetry()
"""No symmetry at all."""


def turns_about_z(fold: int) -> Symmetry:
    """Return the symmetry of fold equal turns about z."""
    angles = 2.0 * np.pi / fold * np.arange(1, fold)
    rotations = rotation_from_vector(np.array([[0.0, 0.0, angle] for angle in angles]))
    return Symmetry(None, tuple(make_pose(rotation, np.zeros(3)) for rotation in rotations))


@dataclass(frozen=True, eq=False)
class DesignedObject:
    """An object in the frame that it was drawn in."""

    mesh: Mesh
    """Closed surface [m]."""
    parts: tuple[Part, ...] | Callable[[], tuple[Part, ...]]
    """Convex parts in the same frame, or what makes them; see `parts_of`."""
    functions: Functions
    """Annotations in the same frame."""
    symmetry: Symmetry
    """About the z axis through the bounding box's centre."""
    mass: float
    """Mass [kg]."""
    friction: float
    """Coulomb coefficient."""
    color: tuple[float, float, float]
    """RGB in 0..1."""
    upright: bool
    """Whether z is up when it stands in its natural pose."""
    rests: int = 12
    """Greatest number of stable poses (a ball has but one)."""


def parts_of(draft: DesignedObject) -> tuple[Part, ...]:
    """Return the convex parts of a draft: made when they are first needed, as many never are."""
    return draft.parts() if callable(draft.parts) else draft.parts


def finish(draft: DesignedObject, name: str, object_class: str) -> ObjectModel:
    """Return the object with its origin moved to the centre of the bounding box."""
    shift = -draft.mesh.bounds.mean(axis=0)
    mesh = Mesh(draft.mesh.vertices + shift, draft.mesh.faces)
    parts = tuple(
        Part(part.name, Mesh(part.mesh.vertices + shift, part.mesh.faces))
        for part in parts_of(draft)
    )
    poses = stable_poses(mesh, draft.symmetry)
    if draft.upright:
        # The natural pose comes first, though a thin bottle lies down more often than it stands.
        others = [pose for pose in poses if pose[2, 2] < 0.999]
        poses = np.stack([rest_pose(mesh, np.array([0.0, 0.0, -1.0])), *others])
    return ObjectModel(
        name=name,
        object_class=object_class,
        mesh=mesh,
        color=np.array(draft.color),
        annotated_parts=parts,
        functions=_moved(draft.functions, shift),
        mass=draft.mass,
        friction=draft.friction,
        symmetry=draft.symmetry,
        stable_poses=poses[: draft.rests],
    )


def _moved(functions: Functions, shift: Array) -> Functions:
    opening, edge, face, tip = functions.opening, functions.edge, functions.face, functions.tip
    return replace(
        functions,
        opening=opening and Opening(opening.center + shift, opening.normal, opening.radius),
        edge=edge and Edge(edge.start + shift, edge.end + shift, edge.direction),
        face=face and Face(face.center + shift, face.normal),
        tip=None if tip is None else tip + shift,
    )
