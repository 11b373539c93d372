"""Solids from cross-sections: lofts, hollow vessels and swept handles, and their convex parts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh, convex_hull, hull_volume
from intent_perception.objects.model import Part

SEGMENTS = 48
"""Corners of a cross-section of the surface; divisible by 4, so that bounding boxes are exact."""
WEDGES = 24
"""Convex wedges around a hollow wall."""

Join = Callable[[list[Mesh]], Mesh]
"""Makes one mesh of several: their union, or all of them side by side where they overlap little."""
Piece = tuple[Mesh, Callable[[], list[Part]]]
"""A closed solid and what makes its convex parts."""
_TO_X = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def row(
    z: float,
    rx: float,
    ry: float | None = None,
    power: float = 2.0,
    cx: float = 0.0,
    cy: float = 0.0,
    flute: float = 0.0,
) -> Array:
    """Return one cross-section (7,): a superellipse across z.

    Args:
        z: height [m].
        rx: half width along x [m].
        ry: half width along y [m]; as rx where None.
        power: exponent; 2 = ellipse, 4 to 6 = rounded rectangle.
        cx: centre along x [m].
        cy: centre along y [m].
        flute: depth of the grooves along z [m].
    """
    return np.array([z, cx, cy, rx, rx if ry is None else ry, power, flute])


def rounded(rows: list[Array], times: int = 2) -> Array:
    """Return (K, 7) cross-sections whose corners are cut (Chaikin), the ends kept."""
    current = np.stack(rows)
    for _ in range(times):
        first = 0.75 * current[:-1] + 0.25 * current[1:]
        second = 0.25 * current[:-1] + 0.75 * current[1:]
        middle = np.stack([first, second], axis=1).reshape(-1, current.shape[1])
        current = np.concatenate([current[:1], middle[1:-1], current[-1:]])
    return current


def ring(section: Array, segments: int = SEGMENTS, lobes: int = 6) -> Array:
    """Return the corners (segments, 3) of a cross-section (7,), counter-clockwise about z."""
    z, cx, cy, rx, ry, power, flute = section
    angle = np.arange(segments) * (2.0 * np.pi / segments)
    cosine, sine = np.cos(angle), np.sin(angle)
    # Equal angles, not equal parameters: corners of rounded rectangles keep even triangles.
    radius = (np.abs(cosine / rx) ** power + np.abs(sine / ry) ** power) ** (-1.0 / power)
    radius = radius - flute * 0.5 * (1.0 - np.cos(lobes * angle))
    return np.stack([cx + radius * cosine, cy + radius * sine, np.full(segments, z)], axis=1)


def rings_of(rows: Array, segments: int = SEGMENTS, lobes: int = 6) -> Array:
    """Return the corners (K, segments, 3) of cross-sections (K, 7)."""
    return np.stack([ring(section, segments, lobes) for section in rows])


def loft(rings: Array) -> Mesh:
    """Return the closed surface through rings (K, N, 3), with a flat cap at both ends."""
    count, corners = rings.shape[:2]
    vertices = np.concatenate(
        [rings.reshape(-1, 3), [rings[0].mean(axis=0)], [rings[-1].mean(axis=0)]]
    )
    here = np.arange(corners)
    after = (here + 1) % corners
    faces = []
    for k in range(count - 1):
        low, high = k * corners, (k + 1) * corners
        faces.append(np.stack([low + here, low + after, high + after], axis=1))
        faces.append(np.stack([low + here, high + after, high + here], axis=1))
    bottom, top = count * corners, count * corners + 1
    last = (count - 1) * corners
    faces.append(np.stack([np.full(corners, bottom), after, here], axis=1))
    faces.append(np.stack([np.full(corners, top), last + here, last + after], axis=1))
    return Mesh.of(vertices, np.concatenate(faces))


def loft_parts(name: str, rings: Array, gain: float = 0.015) -> list[Part]:
    """Return convex parts of a loft: as many rings in one hull as add less than gain to it."""
    between = [loft(rings[k : k + 2]).volume for k in range(len(rings) - 1)]
    parts: list[Part] = []
    start = 0
    while start < len(rings) - 1:
        end = start + 1
        while end + 1 < len(rings):
            longer = rings[start : end + 2].reshape(-1, 3)
            if hull_volume(longer) > (1.0 + gain) * sum(between[start : end + 1]):
                break
            end += 1
        parts.append(Part(name, convex_hull(rings[start : end + 1].reshape(-1, 3))))
        start = end
    return parts


def rod(name: str, rows: list[Array], times: int = 2, lobes: int = 6) -> Piece:
    """Return a loft along z and its convex parts."""
    sections = rounded(rows, times)
    mesh = loft(rings_of(sections, 32, lobes))
    return mesh, lambda: loft_parts(name, rings_of(sections, 24, lobes), 0.03)


def parts_of_pieces(pieces: Sequence[Piece]) -> Callable[[], tuple[Part, ...]]:
    """Return what makes the convex parts of some pieces; many a draft is dropped before."""
    return lambda: tuple(part for _, parts in pieces for part in parts())


def grip_rows(sizes: list[tuple[float, ...]], power: float = 2.6) -> list[Array]:
    """Return rows of a handle from (z, half height along x, half thickness along y[, x])."""
    return [row(s[0], s[1], s[2], power, s[3] if len(s) > 3 else 0.0) for s in sizes]


def along_x(mesh: Mesh, z: float) -> Mesh:
    """Return a mesh turned so that its z becomes x and its x becomes -z, at a height z [m]."""
    return Mesh(mesh.vertices @ _TO_X.T + [0.0, 0.0, z], mesh.faces)


@dataclass(frozen=True, eq=False)
class Vessel:
    """A hollow body of revolution (or superellipse) that is open at the top."""

    mesh: Mesh
    """Closed surface: outside, rim, inside, floor."""
    rows: Array
    """(K, 7) cross-sections of the outside."""
    wall: float
    """Thickness of the wall [m]."""
    floor: float
    """Height of the inside's bottom [m]."""
    lobes: int
    """Grooves around, where rows have any."""
    radius: float
    """Radius of the free opening [m]."""

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Wedges of the wall and what is below the floor."""
        heights, floor = self.rows[:, 0], self.floor
        below = np.stack([np.interp([floor], heights, column) for column in self.rows.T], axis=1)
        solid = np.concatenate([self.rows[heights < floor - 1e-6], below])
        bottom = loft_parts("bottom", rings_of(solid, 24, self.lobes))
        return tuple(bottom + _wall_wedges(self.rows, self.wall, floor))


def vessel(rows: Array, wall: float, floor: float, lobes: int = 6) -> Vessel:
    """Return the vessel with an outside of cross-sections (K, 7).

    Args:
        rows: outside from the bottom to the rim, heights rising.
        wall: thickness of the wall [m].
        floor: height of the inside's bottom [m].
        lobes: grooves around, where rows have any.
    """
    heights = rows[:, 0]
    inner_heights = np.concatenate([[floor], heights[heights > floor + 0.3 * wall]])
    inside = np.stack([np.interp(inner_heights, heights, column) for column in rows.T], axis=1)
    inside[:, 3:5] = np.maximum(inside[:, 3:5] - wall, 0.001)
    inside[:, 6] = 0.0
    # The floor meets the wall in a small round.
    inside = np.concatenate([inside[:1], inside])
    inside[0, 3:5] *= 0.8
    inside[1, 0] += 0.15 * wall
    outer = rings_of(rows, lobes=lobes)
    mesh = loft(np.concatenate([outer, rings_of(inside)[::-1]]))
    rim = rows[-1]
    return Vessel(mesh, rows, wall, floor, lobes, float(min(rim[3], rim[4]) - wall))


def _wall_wedges(rows: Array, wall: float, floor: float) -> list[Part]:
    above = rows[rows[:, 0] > floor + 1e-6]
    start = np.stack([np.interp([floor], rows[:, 0], column) for column in rows.T], axis=1)
    chosen = simplified(np.concatenate([start, above]), 0.0006)
    # Corners a little outside, sides a little inside the true circle: equal on average.
    swell = 2.0 / (1.0 + np.cos(np.pi / WEDGES))
    inner = chosen.copy()
    inner[:, 3:5] = np.maximum(inner[:, 3:5] - wall, 0.001)
    shells = []
    for sections in (chosen, inner):
        corners = rings_of(sections, WEDGES)
        centers = np.stack([sections[:, 1], sections[:, 2]], axis=1)[:, None]
        corners[:, :, :2] = centers + (corners[:, :, :2] - centers) * swell
        shells.append(corners)
    outer_shell, inner_shell = shells
    parts = []
    for k in range(len(chosen) - 1):
        for j in range(WEDGES):
            pair = [j, (j + 1) % WEDGES]
            corners = np.concatenate(
                [shell[level][pair] for shell in (outer_shell, inner_shell) for level in (k, k + 1)]
            )
            parts.append(Part("wall", convex_hull(corners)))
    return parts


def simplified(rows: Array, tolerance: float) -> Array:
    """Return the fewest of the cross-sections whose straight joins stay within a tolerance."""
    kept = [0]
    while kept[-1] < len(rows) - 1:
        start, end = kept[-1], len(rows) - 1
        while end > start + 1:
            between = rows[start : end + 1]
            span = rows[end, 0] - rows[start, 0]
            share = (between[:, 0] - rows[start, 0]) / span if span > 0 else 0.0 * between[:, 0]
            straight = rows[start] + share[:, None] * (rows[end] - rows[start])
            if np.abs(straight - between)[:, 3:5].max() <= tolerance:
                break
            end -= 1
        kept.append(end)
    return rows[kept]


def sweep(path: Array, thickness: float, width: float, power: float = 2.5) -> Array:
    """Return rings (K, 16, 3) along a path (K, 2) in the plane y = 0, given as (x, z).

    Args:
        path: points whose left side is the inside of the handle [m].
        thickness: half thickness in the plane [m].
        width: half width along y [m].
        power: exponent of the cross-section.
    """
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    section = ring(row(0.0, thickness, width, power), 16)[:, :2]
    rings = np.zeros((len(path), 16, 3))
    rings[:, :, 0] = path[:, None, 0] + tangent[:, None, 1] * section[None, :, 0]
    rings[:, :, 1] = section[None, :, 1]
    rings[:, :, 2] = path[:, None, 1] - tangent[:, None, 0] * section[None, :, 0]
    return rings


def union(meshes: list[Mesh]) -> Mesh:
    """Return the watertight union of closed meshes.

    Raises:
        ValueError: if the result is not closed.
    """
    # Only the generator needs this library; the shipped database is loaded without it.
    import manifold3d

    solids = [
        manifold3d.Manifold(
            manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64), tolerance=1e-7)
        )
        for mesh in meshes
    ]
    for mesh, solid in zip(meshes, solids, strict=True):
        if solid.is_empty():
            raise ValueError(f"expected a closed solid, got {mesh.open_edges} open edges")
    joined = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    surface = joined.simplify(2e-6).to_mesh64()
    result = Mesh.of(surface.vert_properties[:, :3], surface.tri_verts)
    if not result.is_watertight:
        raise ValueError(f"union has {result.open_edges} open edges")
    return result
