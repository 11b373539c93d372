"""One object: mesh, class, colour, convex parts, functional annotations, symmetry, stable poses."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.boxes import Box, decompose
from intent_perception.geometry.convex_parts import convex_pieces
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import rotation_from_vector

OBJECT_CLASSES = ("bottle", "glass", "mug", "knife", "hammer", "screwdriver")
"""Classes of the shipped database; a user's object may have any other class."""


@dataclass(frozen=True, eq=False)
class Part:
    """One convex piece of an object, in the object frame."""

    name: str
    """What it is: body, shoulder, neck, wall, bottom, stem, handle, blade, head, shaft, tip."""
    mesh: Mesh
    """Its convex, watertight mesh [m]."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The hole that a liquid is poured into or out of."""

    center: Array
    """(3,) in the object frame [m]."""
    normal: Array
    """(3,) unit vector that points out of the object."""
    radius: float
    """Radius of the free hole [m]."""


@dataclass(frozen=True, eq=False)
class Edge:
    """The cutting edge of a blade."""

    start: Array
    """(3,) end of the edge near the handle, object frame [m]."""
    end: Array
    """(3,) end of the edge at the tip, object frame [m]."""
    direction: Array
    """(3,) unit vector out of the blade, in which it cuts."""


@dataclass(frozen=True, eq=False)
class Face:
    """The face that a hammer strikes with."""

    center: Array
    """(3,) in the object frame [m]."""
    normal: Array
    """(3,) unit vector out of the head."""


@dataclass(frozen=True, eq=False)
class Functions:
    """What the parts of an object are for; None or () where it has no such part."""

    opening: Opening | None = None
    """Where liquid goes in and out."""
    edge: Edge | None = None
    """What cuts."""
    face: Face | None = None
    """What strikes."""
    tip: Array | None = None
    """(3,) the point that pricks or turns a screw, object frame [m]."""
    handle: tuple[str, ...] = ()
    """Names of the parts that are there to be held."""
    functional: tuple[str, ...] = ()
    """Names of the parts that do the work, e.g. blade, head, shaft and tip."""


@dataclass(frozen=True, eq=False)
class Symmetry:
    """The rigid motions of the object onto itself."""

    axis: Array | None = None
    """(3,) unit direction: any rotation about this line through `center` is a symmetry."""
    turns: tuple[Array, ...] = ()
    """(4, 4) T_object_object of the discrete symmetries other than the identity."""
    center: Array | None = None
    """(3,) a point of the axis in the object frame [m]; None = the origin."""

    def transforms(self, steps: int = 36) -> Array:
        """Return (K, 4, 4) symmetries, identity first, the continuous one in equal steps."""
        discrete = np.stack([np.eye(4), *self.turns])
        if self.axis is None:
            return discrete
        angles = np.arange(steps)[:, None] * (2.0 * np.pi / steps)
        spins = np.tile(np.eye(4), (steps, 1, 1))
        spins[:, :3, :3] = rotation_from_vector(angles * self.axis)
        if self.center is not None:
            spins[:, :3, 3] = self.center - spins[:, :3, :3] @ self.center
        products: Array = np.einsum("aij,bjk->abik", spins, discrete).reshape(-1, 4, 4)
        return products


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """An object that can be recognised, tracked, grasped and simulated.

    The object frame is the mesh's own. In the shipped database its origin is the centre of the
    bounding box; z is up in the natural pose (bottle, glass, mug) or points from the handle to the
    functional end (knife, hammer, screwdriver). A user's mesh keeps the frame of its file, so its
    origin can be anywhere: `center` is the middle of the bounding box.
    """

    name: str
    """Unique name in the database."""
    object_class: str
    """Class, one of OBJECT_CLASSES or any other word."""
    mesh: Mesh
    """Surface [m]; closed in the shipped database, possibly open in a user's."""
    color: Array
    """(3,) RGB in 0..1."""
    annotated_parts: tuple[Part, ...] | None
    """Convex parts with names; None = to be computed when `parts` is asked for."""
    functions: Functions | None
    """Functional annotations; None = unknown (not: has none)."""
    mass: float
    """Mass [kg]."""
    friction: float
    """Coulomb coefficient against skin, wood and rubber."""
    symmetry: Symmetry
    """Motions that cannot be seen."""
    stable_poses: Array
    """(S, 4, 4) T_table_object with x = y = 0, the likeliest (natural) first; any turn about the
    vertical is as stable."""
    stored_boxes: tuple[Box, ...] | None = None
    """Boxes that it decomposes into; None = to be computed when `boxes` is asked for."""

    @property
    def rest(self) -> Array:
        """(4, 4) T_table_object of its most stable pose; the identity where none is known."""
        return self.stable_poses[0] if len(self.stable_poses) else np.eye(4)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Convex parts whose union is the object to about a millimetre; physics uses them too.

        Those of a mesh without annotation are all named "body", computed at the first use and
        true to about 4 mm.
        """
        if self.annotated_parts is not None:
            return self.annotated_parts
        return tuple(Part("body", piece) for piece in convex_pieces(self.mesh))

    @cached_property
    def boxes(self) -> tuple[Box, ...]:
        """Boxes that the object decomposes into, the one with most of the surface first."""
        return decompose(self.mesh) if self.stored_boxes is None else self.stored_boxes

    @cached_property
    def size(self) -> Array:
        """Edges of the bounding box (3,), object frame [m]."""
        return np.asarray(self.mesh.bounds[1] - self.mesh.bounds[0])

    @cached_property
    def center(self) -> Array:
        """Middle of the bounding box (3,), object frame [m]."""
        return np.asarray(self.mesh.bounds.mean(axis=0))

    @cached_property
    def diameter(self) -> float:
        """Greatest distance between two points of the object [m]."""
        corners = self.mesh.convex_hull.vertices
        # Of two points this far apart each is nearly as far from the middle as any.
        far = np.linalg.norm(corners - corners.mean(axis=0), axis=1)
        least = np.linalg.norm(corners - corners[far.argmax()], axis=1).max()
        corners = corners[far >= (least - far.max()) * (1.0 - 1e-9)]
        squares = np.sum(corners**2, axis=1)
        distances = squares[:, None] + squares - 2.0 * corners @ corners.T
        return float(np.sqrt(max(distances.max(), 0.0)))

    @cached_property
    def convexity(self) -> float:
        """Volume of the object divided by that of its convex hull, `conv` of Table I."""
        return self.require_volume().volume / self.mesh.convex_hull.volume

    def require_volume(self) -> Mesh:
        """Return the mesh if it encloses a volume.

        Raises:
            ValueError: if it does not, with the reason and the remedy.
        """
        if self.mesh.is_watertight and self.mesh.volume > 0.0:
            return self.mesh
        reason = f"its mesh has {self.mesh.open_edges} open or inconsistent edges"
        if self.mesh.is_watertight:
            reason = "its surface is closed but encloses nothing"
        raise ValueError(
            f"{self.name} has no volume: {reason}. It can be recognised and tracked; for grasp "
            "simulation and physics close its holes (e.g. in MeshLab or Blender) and load it again"
        )
