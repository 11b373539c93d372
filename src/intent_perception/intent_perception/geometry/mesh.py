"""A triangle mesh: its measures, points on its surface, and files it is read from."""

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import ConvexHull

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_bytes
from intent_perception.geometry.mesh_colors import WITH_MATERIALS, material_color, mean_color
from intent_perception.geometry.transforms import transform_points

Faces = NDArray[np.int32]
_FORMATS = ("ply", "stl", "obj", "off", "glb")
_LARGEST_FILE = 256 << 20
_FARTHEST = 1e6
"""Coordinates of a mesh in any unit are nearer to its origin."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles whose corners are counter-clockwise seen from outside."""

    vertices: Array
    """(V, 3) [m]."""
    faces: Faces
    """(F, 3) indices of vertices."""

    def __post_init__(self) -> None:
        """Refuse arrays that are no mesh."""
        vertices, faces = self.vertices, self.faces
        if vertices.ndim != 2 or vertices.shape[1] != 3 or vertices.dtype != np.float64:
            raise ValueError(f"expected vertices (V, 3) float64, got {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype != np.int32:
            raise ValueError(f"expected faces (F, 3) int32, got {faces.shape} {faces.dtype}")
        if not len(faces) or faces.min() < 0 or faces.max() >= len(vertices):
            raise ValueError(f"expected faces of {len(vertices)} vertices, got none or others")
        if not np.all(np.isfinite(vertices)):
            raise ValueError("expected finite vertices, got NaN or infinity")

    @classmethod
    def of(cls, vertices: ArrayLike, faces: ArrayLike) -> "Mesh":
        """Return the mesh of vertices (V, 3) and faces (F, 3) of any number type."""
        return cls(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(faces, dtype=np.int32),
        )

    @cached_property
    def triangles(self) -> Array:
        """The corners of each face, (F, 3, 3) [m]."""
        return self.vertices[self.faces]

    @cached_property
    def _crosses(self) -> Array:
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        return np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> Array:
        """The area of each face, (F,) [m²]."""
        areas: Array = 0.5 * np.linalg.norm(self._crosses, axis=1)
        return areas

    @cached_property
    def normals(self) -> Array:
        """The outward unit normal of each face, (F, 3); zero for a face without area."""
        length = np.linalg.norm(self._crosses, axis=1, keepdims=True)
        normals: Array = self._crosses / np.where(length > 0.0, length, 1.0)
        return normals

    @cached_property
    def bounds(self) -> Array:
        """The least and the greatest corner of the bounding box, (2, 3) [m]."""
        used = self.vertices[np.unique(self.faces)]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @cached_property
    def open_edges(self) -> int:
        """Number of edges that do not join exactly two faces of the same orientation."""
        directed = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
        count = len(self.vertices)
        forward, forward_count = np.unique(directed @ [count, 1], return_counts=True)
        backward = np.unique(directed @ [1, count])
        single = np.setxor1d(forward, backward)
        return len(single) + int(np.sum(forward_count > 1))

    @property
    def is_watertight(self) -> bool:
        """Whether the surface is closed and consistently oriented, so that it has an inside."""
        return self.open_edges == 0

    @cached_property
    def volume(self) -> float:
        """The enclosed volume [m³]; meaningless unless the mesh is watertight."""
        return float(np.einsum("ij,ij->", self.triangles[:, 0], self._crosses) / 6.0)

    @cached_property
    def center_of_mass(self) -> Array:
        """The centre of the enclosed volume (3,) [m], of the surface for an open mesh."""
        center = self.triangles.mean(axis=1)
        if self.is_watertight and self.volume > 0.0:
            signed = np.einsum("ij,ij->i", self.triangles[:, 0], self._crosses) / 6.0
            return np.asarray(0.75 * (signed @ center) / self.volume)
        return np.asarray(self.areas @ center / self.areas.sum())

    @cached_property
    def convex_hull(self) -> "Mesh":
        """The smallest convex mesh that contains this one."""
        return convex_hull(self.vertices[np.unique(self.faces)])

    def sample_surface(self, n: int, rng: np.random.Generator) -> tuple[Array, Array, Faces]:
        """Return n points spread evenly over the surface.

        Returns:
            (n, 3) points [m], (n, 3) outward unit normals of their faces, (n,) faces.
        """
        cumulative = np.cumsum(self.areas)
        # One draw in each of n equal slices of the area: evener than independent draws.
        draws = (np.arange(n) + rng.random(n)) / max(n, 1) * cumulative[-1]
        face = np.minimum(np.searchsorted(cumulative, draws), len(self.faces) - 1).astype(np.int32)
        u, v = np.sqrt(rng.random(n))[:, None], rng.random(n)[:, None]
        a, b, c = np.moveaxis(self.triangles[face], 1, 0)
        return (1.0 - u) * a + u * (1.0 - v) * b + u * v * c, self.normals[face], face

    def transformed(self, pose: ArrayLike) -> "Mesh":
        """Return the mesh in another frame a, given T_a_mesh (4, 4)."""
        return Mesh(transform_points(pose, self.vertices), self.faces)

    def scaled(self, factor: float) -> "Mesh":
        """Return the mesh with every coordinate multiplied by a factor above 0."""
        return Mesh(self.vertices * factor, self.faces)


def convex_hull(points: ArrayLike) -> Mesh:
    """Return the convex hull of points (N, 3) [m].

    Raises:
        ValueError: if the points lie in one plane.
    """
    points = np.asarray(points, dtype=np.float64)
    hull = _hull(points)
    used, index = np.unique(hull.simplices, return_inverse=True)
    faces = index.reshape(-1, 3)
    corners = points[used][faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", cross, hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh.of(points[used], faces)


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of points (N, 3) [m³].

    Raises:
        ValueError: if the points lie in one plane.
    """
    return float(_hull(points).volume)


def _hull(points: Array) -> ConvexHull:
    try:
        return ConvexHull(points)
    except Exception as error:  # scipy's QhullError is a RuntimeError without a public base
        raise ValueError("expected points that span a volume, got a flat set") from error


def merge_meshes(meshes: list[Mesh]) -> Mesh:
    """Return all meshes as one, without joining their surfaces."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh.of(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, offsets, strict=True)]),
    )


def read_mesh(path: Path) -> tuple[Mesh, Array | None]:
    """Return the mesh in a file (PLY, STL, OBJ, OFF, GLB) and its mean colour.

    Equal vertices are joined and faces without area dropped; of a closed surface the faces are
    turned outwards. Lengths stay in the file's unit.

    Returns:
        The mesh, and RGB (3,) in 0..1 or None where the file has no colours.

    Raises:
        ValueError: if the file is missing, unreadable or holds no triangles.
    """
    # 0.3 s of import that only a user's own mesh needs.
    import trimesh

    if not path.exists():
        raise ValueError(f"expected a mesh file, {path} does not exist")
    kind = path.suffix.lower().removeprefix(".")
    if kind not in _FORMATS:
        raise ValueError(f"expected a mesh as {', '.join(_FORMATS)}, got {path}")
    content = read_bytes(path, _LARGEST_FILE)
    try:
        loaded = trimesh.load(
            io.BytesIO(content), file_type=kind, force="mesh", process=False, skip_materials=True
        )
    except Exception as error:  # trimesh's readers raise whatever their parsers raise
        reason = str(error) or type(error).__name__
        raise ValueError(f"cannot read the mesh {path}: {reason}") from error
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))))
    if faces.ndim != 2 or not len(faces):
        raise ValueError(f"expected triangles, {path} holds none (a point cloud?)")
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    if faces.min() < 0 or faces.max() >= len(vertices) or not np.abs(vertices).max() < _FARTHEST:
        raise ValueError(
            f"{path} is damaged: it holds NaN, infinity or faces of vertices that are not there"
        )
    color = mean_color(loaded.visual, np.asarray(loaded.area_faces))
    if kind in WITH_MATERIALS and loaded.visual.kind != "vertex":
        color = material_color(path, content, kind)
    return _joined(vertices, faces), color


def _joined(vertices: Array, faces: NDArray[np.int64]) -> Mesh:
    """Return the mesh with equal vertices joined, empty faces dropped and faces outwards."""
    step = max(float(np.ptp(vertices, axis=0).max()), 1e-12) * 1e-7
    _, first, index = np.unique(
        np.round(vertices / step), axis=0, return_index=True, return_inverse=True
    )
    faces = index.reshape(-1)[faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
    faces = faces[distinct & (faces[:, 2] != faces[:, 0])]
    faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
    mesh = Mesh.of(vertices[first], faces)
    if not mesh.is_watertight:
        return Mesh(mesh.vertices, _consistent(mesh))
    return Mesh.of(mesh.vertices, mesh.faces[:, ::-1]) if mesh.volume < 0.0 else mesh


def _consistent(mesh: Mesh) -> Faces:
    """Return faces of which neighbours have the same orientation and most look outwards."""
    faces = mesh.faces
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    forward = ends[:, 0] < ends[:, 1]
    key = np.sort(ends, axis=1) @ [len(mesh.vertices), 1]
    order = np.argsort(key, kind="stable")
    _, start, count = np.unique(key[order], return_index=True, return_counts=True)
    # Only an edge of exactly two faces tells how one lies to the other.
    first, second = order[start[count == 2]], order[start[count == 2] + 1]
    against = forward[first] == forward[second]
    size = (len(faces), len(faces))
    links = coo_array((1 + against.astype(np.int8), (first // 3, second // 3)), shape=size)
    # the matrix type: picked elements come back dense, however many there are
    graph = csr_matrix(links + links.T)
    count_pieces, piece = connected_components(graph, directed=False)
    flipped = np.zeros(len(faces), dtype=bool)
    for root in np.unique(piece, return_index=True)[1]:
        reached, before = breadth_first_order(graph, root, directed=False)
        parents = before[reached[1:]]
        if len(parents) == 0:
            continue
        turn = np.asarray(graph[reached[1:], parents]).ravel() == 2
        for face, parent, turned in zip(reached[1:], parents, turn, strict=True):
            flipped[face] = flipped[parent] ^ turned
    normals = mesh.normals * np.where(flipped, -1.0, 1.0)[:, None] * mesh.areas[:, None]
    middle = mesh.triangles.mean(axis=1)
    weight = np.maximum(np.bincount(piece, weights=mesh.areas, minlength=count_pieces), 1e-20)
    centers = np.stack(
        [np.bincount(piece, weights=mesh.areas * middle[:, k]) / weight for k in range(3)], axis=1
    )
    outward = np.einsum("ij,ij->i", normals, middle - centers[piece])
    flipped ^= (np.bincount(piece, weights=outward, minlength=count_pieces) < 0.0)[piece]
    return np.ascontiguousarray(np.where(flipped[:, None], faces[:, ::-1], faces), dtype=np.int32)
