"""Shapes of the tracked objects as arrays for compiled code, packed once for every subset."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_tracking.scene.decimation import decimated
from intent_tracking.scene.inverse_depth import MeshArrays, mesh_arrays
from intent_tracking.scene.object_kernel import ObjectArrays, ObjectGeometry, object_arrays

COARSE_FACES = 200
"""Triangles of an object on the swarm's tile: true to about a millimetre, a quarter of a pixel."""
MOST_FACES = 20_000
"""Triangles from which on the object as it is drawn otherwise is made coarser, to save time."""


class PackedObjects:
    """Arrays for compiled code of any subset of the objects."""

    def __init__(self, geometries: list[ObjectGeometry]) -> None:
        self.geometries = geometries
        self._packed: dict[tuple[int, ...], ObjectArrays] = {}
        self._meshes: dict[tuple[int, ...], MeshArrays] = {}

    def __call__(self, chosen: list[int]) -> ObjectArrays:
        """Return the arrays of the chosen objects."""
        key = tuple(chosen)
        if key not in self._packed:
            self._packed[key] = object_arrays([self.geometries[k] for k in chosen])
        return self._packed[key]

    def coarse_meshes(self, chosen: list[int]) -> MeshArrays:
        """Return the chosen objects with few triangles, for many small drawings."""
        key = tuple(chosen)
        if key not in self._meshes:
            self._meshes[key] = mesh_arrays([self.coarse[k] for k in chosen])
        return self._meshes[key]

    @cached_property
    def coarse(self) -> list[tuple[Array, NDArray[np.int32]]]:
        """Vertices (V, 3) and faces (F, 3) of every object with few triangles."""
        coarse = []
        for geometry in self.geometries:
            shape = geometry if len(geometry.mesh.faces) > MOST_FACES else geometry.mesh
            coarse.append(decimated(shape.vertices, shape.faces, COARSE_FACES))
        return coarse
