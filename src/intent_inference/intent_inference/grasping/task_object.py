"""An object prepared for simulation: distance field, boxes, named parts, functional surfaces."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from intent_inference.grasping.contacts import Contacts
from intent_perception.basics.arrays import Array
from intent_perception.geometry.boxes import Box
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectModel
from intent_tracking.grasp.grasp_features import GraspedShape


class TaskObject:
    """What simulation and labels need of an object, each computed once when it is first used.

    Raises:
        ValueError: if the mesh encloses no volume or is no household object's size, with reason.
    """

    def __init__(self, model: ObjectModel) -> None:
        self.mesh = model.require_volume()
        if not 0.01 <= float(model.size.max()) <= 1.0:
            raise ValueError(
                f"{model.name}: its largest edge is {model.size.max():.3g} m; expected 0.01 to 1 m "
                "(is the unit of the mesh right?)"
            )
        self.model = model
        self.geometry = GraspedShape(model)
        self.center_of_mass = self.mesh.center_of_mass

    @cached_property
    def field(self) -> SignedDistance:
        """Signed distance of the surface."""
        return SignedDistance.from_mesh(self.mesh)

    @property
    def weight(self) -> float:
        """Weight [N]."""
        return 9.81 * self.model.mass

    @property
    def extent(self) -> float:
        """No point of the surface is farther from the origin [m]."""
        return float(np.linalg.norm(self.geometry.points, axis=1).max())

    @cached_property
    def reach(self) -> float:
        """Greatest distance of the surface from the centre of mass [m]."""
        return float(np.linalg.norm(self.geometry.points - self.center_of_mass, axis=1).max())

    @cached_property
    def _sample_parts(self) -> NDArray[np.int64]:
        """Return the convex part (N,) that each surface sample lies on."""
        gaps = []
        for part in self.model.parts:
            offsets = np.einsum("fi,fi->f", part.mesh.normals, part.mesh.triangles[:, 0])
            gaps.append((self.geometry.points @ part.mesh.normals.T - offsets).max(axis=1))
        return np.asarray(np.argmin(gaps, axis=0))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.geometry.points)

    def part_names(self, points: Array) -> NDArray[np.str_]:
        """Return the name (K,) of the part nearest to each point (K, 3)."""
        names = np.array([part.name for part in self.model.parts])
        if len(points) == 0:
            return names[:0]
        return np.asarray(names[self._sample_parts[self._tree.query(points)[1]]])

    def handle_share(self, contacts: Contacts) -> float | None:
        """Return the share of the contact force on the handle; None where there is no handle."""
        functions = self.model.functions
        if functions is None or not functions.handle:
            return None
        return contacts.of_force(np.isin(self.part_names(contacts.points), functions.handle))

    def is_loop(self, box: Box) -> bool:
        """Return whether a box is a vessel's handle, which fingers can go through."""
        functions = self.model.functions
        if functions is None or functions.opening is None or not functions.handle:
            return False
        inside = np.abs((self.geometry.points - box.center) @ box.rotation) <= box.half_size
        names = np.array([part.name for part in self.model.parts])[
            self._sample_parts[inside.all(axis=1)]
        ]
        return bool(len(names)) and float(np.isin(names, functions.handle).mean()) > 0.5

    def on_handle(self, point: Array) -> bool:
        """Return whether the part nearest to a point (3,) is a handle."""
        functions = self.model.functions
        handle = () if functions is None else functions.handle
        return bool(np.isin(self.part_names(point[None]), handle)[0])

    @cached_property
    def functional_points(self) -> Array:
        """Surface samples (M, 3) of the parts that do the work [m]."""
        functions = self.model.functions
        wanted = () if functions is None else functions.functional
        names = np.array([part.name for part in self.model.parts])[self._sample_parts]
        return np.asarray(self.geometry.points[np.isin(names, wanted)])

    def edge_distance(self, points: Array) -> Array:
        """Return the distance (K,) of points (K, 3) to the cutting edge [m]; 1 without an edge."""
        edge = None if self.model.functions is None else self.model.functions.edge
        if edge is None:
            return np.ones(len(points))
        along = edge.end - edge.start
        share = np.clip((points - edge.start) @ along / (along @ along), 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - edge.start - share[:, None] * along, axis=1))
