"""Whether a user's mesh is what its entry says: spelling of the class, upright axis, usual size.

Vessels stand with their axis along z and the opening up, tools lie with z from the handle to the
working end: the features of a grasp (Table I) are told in that frame.
"""

import difflib
from typing import Literal

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.transforms import make_pose, rotation_between
from intent_perception.objects.model import OBJECT_CLASSES

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
UPS = ("x", "y", "z", "-x", "-y", "-z")
VESSELS = ("bottle", "glass", "mug")
USUAL_LENGTHS = {
    "bottle": (0.10, 0.42), "glass": (0.05, 0.26), "mug": (0.05, 0.18),
    "knife": (0.10, 0.45), "hammer": (0.15, 0.60), "screwdriver": (0.08, 0.45),
}  # fmt: skip
"""Least and greatest edge of the bounding box of ordinary ones [m]."""
_NEAR_SPELLING = 0.75
_SAMPLES = 3000
_ROUND = 0.7  # the axis of revolution misses the normals by this much less than another
_FLAT_END = 3.0  # the bottom's flat area, of that of the opened end
_END = 0.04  # of the height, what is an end
_SLENDER, _STOUT = 8.0, 3.3  # longest by shortest edge: more is no vessel, less is no tool


def checked_class(name: str) -> tuple[str, str]:
    """Return a class and a note on it, "" where it is one of those that tasks are known for.

    Raises:
        ValueError: for a misspelt one, with the nearest spelling.
    """
    if name in OBJECT_CLASSES:
        return name, ""
    near = difflib.get_close_matches(name.strip().lower(), OBJECT_CLASSES, 1, _NEAR_SPELLING)
    known = ", ".join(OBJECT_CLASSES)
    if near:
        raise ValueError(
            f"class {name!r} is not known, did you mean {near[0]!r}? (known: {known}; another "
            "class needs a name unlike these)"
        )
    return name, f"its class {name!r} is none of {known}: its tasks are told from its shape alone"


def turn_up(up: str) -> Array:
    """Return the rotation (4, 4) that takes an axis of the mesh's file to z.

    Raises:
        ValueError: if it is none.
    """
    if up not in UPS:
        raise ValueError(f"expected up as one of {', '.join(UPS)}, got {up!r}")
    return make_pose(rotation_between(_axis(up), [0.0, 0.0, 1.0]), np.zeros(3))


def _axis(up: str) -> Array:
    axis: Array = np.eye(3)["xyz".index(up[-1])]
    return -axis if up.startswith("-") else axis


def seen_up(mesh: Mesh) -> str | None:
    """Return which axis of a vessel's mesh points out of its opening, None where none stands out.

    The normals of a surface of revolution meet its axis; its bottom is flat, its other end open.
    """
    points, normals, _ = mesh.sample_surface(_SAMPLES, np.random.default_rng(0))
    misses = np.array([_miss(points, normals, k) for k in range(3)])
    best = int(np.argmin(misses))
    others = np.delete(misses, best)
    if not misses[best] < _ROUND * others.min():
        return None
    low, high = mesh.bounds[:, best]
    middle = mesh.triangles.mean(axis=1)[:, best]
    flat = mesh.areas * np.clip(np.abs(mesh.normals[:, best]) - 0.9, 0.0, None)
    near = _END * (high - low)
    ends = float(flat[middle < low + near].sum()), float(flat[middle > high - near].sum())
    name = "xyz"[best]
    if ends[1] > _FLAT_END * ends[0]:
        return f"-{name}"
    return name if ends[0] > _FLAT_END * ends[1] else f"±{name}"


def _miss(points: Array, normals: Array, axis: int) -> float:
    """Return how far the normals of a surface pass by the best line along an axis (median) [m]."""
    a, b = [k for k in range(3) if k != axis]
    side = np.hypot(normals[:, a], normals[:, b]) > 0.7
    if side.sum() < 50:
        return np.inf
    lines = np.stack([normals[side, b], -normals[side, a]], axis=1)
    values = np.einsum("ij,ij->i", lines, points[side][:, [a, b]])
    weights, center = np.ones(len(values)), np.zeros(2)
    for _ in range(20):
        weighted = lines * weights[:, None]
        center = np.linalg.solve(weighted.T @ lines + 1e-9 * np.eye(2), weighted.T @ values)
        weights = 1.0 / np.maximum(np.abs(lines @ center - values), 1e-4)
    return float(np.median(np.abs(lines @ center - values)))


def turned_upright(mesh: Mesh, object_class: str, up: str | None) -> tuple[Array, str]:
    """Return the turn (4, 4) that stands a mesh up, and a note where nobody asked for it.

    Args:
        mesh: as in its file, in metres.
        object_class: of the entry.
        up: the entry's key, None = not given: z, unless a vessel clearly lies.

    Raises:
        ValueError: if the given axis lays a vessel down.
    """
    stands = seen_up(mesh) if object_class in VESSELS else None
    if up is not None:
        if stands is not None and stands[-1] != up[-1]:
            advice = stands[-1]
            raise ValueError(
                f"up: {up} lays the {object_class} down, its axis is {stands[-1]}: "
                f"give up: {advice}"
            )
        return turn_up(up), ""
    if stands == "-z":  # a thick bottom may be hollow: nothing that is turned in silence
        return np.eye(4), f"the {object_class} seems to be upside down: if so, give up: -z"
    if stands is None or stands in ("z", "±z"):
        return np.eye(4), ""
    taken = stands[-1]
    return turn_up(taken), (
        f"the {object_class} does not stand along z: it was turned as with up: {taken}; write that "
        f"(or another of {', '.join(UPS)}) into its entry"
    )


def shape_notes(mesh: Mesh, object_class: str, unit: str, units: dict[str, float]) -> list[str]:
    """Return what about a mesh [m] does not go with its class, and the unit that would.

    Args:
        mesh: in its upright frame.
        object_class: of the entry.
        unit: of the entry.
        units: metres in each unit.
    """
    if object_class not in USUAL_LENGTHS:
        return []
    edges = np.ptp(mesh.bounds, axis=0)
    longest, notes = float(edges.max()), []
    low, high = USUAL_LENGTHS[object_class]
    if not low <= longest <= high:
        bare = longest / units[unit]
        fitting = [u for u in units if u not in (unit, "dm") and low <= bare * units[u] <= high]
        advice = f": is its unit {' or '.join(fitting)}?" if fitting else ""
        notes.append(f"{longest:.3g} m is an unusual length of a {object_class}{advice}")
    slender = longest / max(float(edges.min()), 1e-9)
    if object_class in VESSELS and slender > _SLENDER:
        notes.append(f"it is too slender for a {object_class}: is its class right?")
    if object_class not in VESSELS:
        if slender < _STOUT:
            notes.append(f"it is a vessel rather than a {object_class}: is its class right?")
        elif edges[2] < 0.9 * longest:
            notes.append(
                f"the {object_class} does not lie along z: give up so that z points from its "
                "handle to its working end"
            )
    return notes
