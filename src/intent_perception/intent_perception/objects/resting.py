"""Poses in which an object can stand or lie on a table."""

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import make_pose, rotation_between
from intent_perception.objects.model import Symmetry

_SAME_POSE = np.cos(np.deg2rad(12.0))
_NEAR = np.deg2rad(9.0)
_LOWER = 5e-5  # [m]
_LIKELY = 0.08  # a round thing that rolls meets no barrier, but rests on its side often
_SHALLOW = 3e-4  # [m]
_TILT = np.deg2rad(20.0)


def stable_poses(
    mesh: Mesh, symmetry: Symmetry, least_probability: float = 0.02, count: int = 12
) -> Array:
    """Return the poses in which a mesh rests on a plane, the likeliest first.

    Each facet of the convex hull whose plane has the centre of mass above its inside is a rest,
    unless a facet within 9° is lower; from every other facet the object rolls to the next. The
    probability of a rest is the share of directions, seen from the centre of mass, that end there.
    Rests that differ by a symmetry or by less than 12° of tilt are one; those that a tilt of 20°
    lets fall over (a knife on its spine) are left out.

    Args:
        mesh: object; an open one counts as a shell.
        symmetry: its symmetries.
        least_probability: rests that happen more rarely are left out.
        count: greatest number of poses.

    Returns:
        (S, 4, 4) T_table_object with x = y = 0 for the object's origin.
    """
    hull = ConvexHull(mesh.vertices)
    center = mesh.center_of_mass
    probability = _rest_probabilities(hull, center)
    rests = np.flatnonzero(probability > 0.0)
    down = hull.equations[rests, :3]
    corners = hull.points[hull.vertices] - center
    groups = [
        (share, direction)
        for share, direction in _grouped(down, probability[rests], symmetry)
        if _barrier(corners, direction) >= (-_LOWER if share >= _LIKELY else _SHALLOW)
    ] or _grouped(down, probability[rests], symmetry)
    kept = [(p, d) for p, d in groups if p >= least_probability] or groups[:1]
    return np.stack([rest_pose(mesh, direction) for _, direction in kept[:count]])


def rest_pose(mesh: Mesh, down: Array) -> Array:
    """Return T_table_object with object direction down (3,) pointing into the table."""
    rotation = rotation_between(down, [0.0, 0.0, -1.0])
    lowest = float(np.min(mesh.vertices @ rotation[2]))
    return make_pose(rotation, [0.0, 0.0, -lowest])


def _rest_probabilities(hull: ConvexHull, center: Array) -> Array:
    """Return for each hull facet the probability to come to rest on it, (F,)."""
    corners = hull.points[hull.simplices]
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    height = -(normals @ center + offsets)
    weights = _solid_angles(corners - center) / (4.0 * np.pi)
    # The object rolls over an edge that the centre of mass is beyond; and along a strip of facets,
    # which stands for a round surface, to a facet nearby that is lower.
    around = np.column_stack([np.arange(len(height)), hull.neighbors])
    over = _outside_edges(corners, normals, center + normals * -height[:, None])
    lowest = np.where(over, height[around], np.inf)
    over_edge = around[np.arange(len(height)), lowest.argmin(axis=1)]
    near = cKDTree(normals).query_ball_point(normals, 2.0 * np.sin(_NEAR / 2.0))
    along = np.array([facets[int(height[facets].argmin())] for facets in near])
    lower = height[along] < height - _LOWER
    target = np.where(lower, along, np.where(over.any(axis=1), over_edge, -1))
    probability = np.zeros(len(height))
    for facet in range(len(height)):
        current, steps = facet, 0
        while target[current] >= 0 and steps < 200:
            current, steps = int(target[current]), steps + 1
        probability[current] += weights[facet]
    return probability


def _outside_edges(corners: Array, normals: Array, foot: Array) -> Array:
    """Return (F, 4): column k + 1 says that the foot lies beyond the edge opposite corner k."""
    outside = np.zeros((len(corners), 4), dtype=bool)
    for k in range(3):
        a, b, opposite = corners[:, (k + 1) % 3], corners[:, (k + 2) % 3], corners[:, k]
        inward = np.cross(normals, b - a)
        inward *= np.sign(np.einsum("ij,ij->i", inward, opposite - a))[:, None]
        length = np.linalg.norm(inward, axis=1)
        outside[:, k + 1] = np.einsum("ij,ij->i", inward, foot - a) < -1e-9 * length
    return outside


def _solid_angles(corners: Array) -> Array:
    """Return the solid angles (F,) of triangles (F, 3, 3) around the origin."""
    a, b, c = np.moveaxis(corners, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    dots = [np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a))]
    bottom = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    angle: Array = 2.0 * np.arctan2(triple, bottom)
    return angle


def _barrier(corners: Array, down: Array) -> float:
    """Return how much a tilt of 20°, the easiest way, lifts the centre of mass [m].

    Args:
        corners: (V, 3) corners of the hull relative to the centre of mass [m].
        down: (3,) direction into the table.
    """
    turn = rotation_between([0.0, 0.0, 1.0], down)
    around = np.arange(16) * (2.0 * np.pi / 16)
    tilted = np.stack(
        [
            np.sin(_TILT) * np.cos(around),
            np.sin(_TILT) * np.sin(around),
            np.full(16, np.cos(_TILT)),
        ],
        axis=1,
    )
    heights = (corners @ (tilted @ turn.T).T).max(axis=0)
    return float(heights.min() - (corners @ down).max())


def _grouped(down: Array, probability: Array, symmetry: Symmetry) -> list[tuple[float, Array]]:
    """Return (probability, direction) of rests joined over symmetries, likeliest first."""
    rotations = symmetry.transforms(steps=72)[:, :3, :3]
    left = list(np.argsort(-probability, kind="stable"))
    groups: list[tuple[float, Array]] = []
    while left:
        leader = down[left[0]]
        images = rotations @ leader
        same = [k for k in left if float(np.max(images @ down[k])) > _SAME_POSE]
        groups.append((float(probability[same].sum()), leader))
        left = [k for k in left if k not in same]
    return sorted(groups, key=lambda group: -group[0])
