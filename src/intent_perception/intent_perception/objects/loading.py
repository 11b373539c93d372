"""One entry of an object database file -> ObjectModel; what the entry leaves out is computed.

Optional keys of an entry: `class` (none: of no class that the networks know);
`up` (x, y, z, -x, -y or -z: the axis of the file that points up from a
standing vessel, or from a tool's handle to its working end; the object's frame is turned so that
it becomes z, and the keys below are in that frame); `color` [r, g, b] in 0..1; `mass` [kg] or
`density` [kg/m³]; `friction`;
`functions` {opening: {center, normal, radius}, edge: {start, end, direction},
face: {center, normal}, tip, handle: [names], functional: [names]};
`symmetry` {axis, center, turns}; `stable_poses`; poses and turns are rows of 6 values, position
and rotation vector; all lengths in these keys in m, in the frame of the object.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.array_files import read_arrays, require_finite
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays
from intent_perception.geometry.boxes import Box
from intent_perception.geometry.mesh import Mesh, read_mesh
from intent_perception.geometry.transforms import make_pose, pose_from_vector, require_pose
from intent_perception.objects.class_check import checked_class, shape_notes, turned_upright
from intent_perception.objects.model import (
    Edge,
    Face,
    Functions,
    ObjectModel,
    Opening,
    Part,
    Symmetry,
)
from intent_perception.objects.resting import stable_poses
from intent_perception.objects.symmetry import find_symmetry

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres in each unit that a mesh may be stored in."""

_KEYS = {"name", "mesh", "unit"}
_OPTIONAL = {
    "class", "up", "color", "mass", "density", "friction", "functions", "symmetry", "stable_poses",
}  # fmt: skip
_LARGEST, _SMALLEST = 1.0, 0.005
_FARTHEST = 10.0
"""Coordinates of an object [m] and turns [rad] beyond are mistakes."""
_LARGEST_NUMBER = 1e5
"""Of a mass [kg], density [kg/m³], friction or radius [m]."""
_MOST_MOTIONS = 120
"""The icosahedron has 60 rotations."""
_DENSITY = 1000.0  # plastic and wood are lighter, glass and metal heavier
_OPEN_MASS = 0.2
_FRICTION = 0.6
GREY = np.array([0.6, 0.6, 0.6])
"""Colour of objects whose mesh and entry give none: it says nothing."""


def load_entry(entry: dict[str, Any], file: Path) -> tuple[ObjectModel, tuple[str, ...]]:
    """Return the object of one entry of the database file, and notes on what looks wrong with it.

    Raises:
        ValueError: for missing or unknown keys, a mesh that cannot be read, a wrong unit, or
            values of the wrong shape, naming file, entry and remedy.
    """
    if not isinstance(entry, dict):
        raise ValueError(f"{file}: expected entries {{name, mesh, unit, class}}, got {entry!r}")
    where = f"{file}, object {entry.get('name')!r}"
    present = {key for key, value in entry.items() if value is not None}
    missing, unknown = _KEYS - present, set(entry) - _KEYS - _OPTIONAL
    if missing or unknown:
        problem = f"lacks {sorted(missing)}" if missing else f"has unknown {sorted(unknown)}"
        raise ValueError(f"{where} {problem}; keys: {sorted(_KEYS)}, or {sorted(_OPTIONAL)}")
    given = {key: value for key, value in entry.items() if value is not None}
    try:
        model, notes = _model(given, file.parent / str(given["mesh"]))
    except (
        ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError,
        np.linalg.LinAlgError, FloatingPointError,
    ) as error:  # fmt: skip
        raise ValueError(f"{where}: {error}") from error
    return model, tuple(f"{where}: {note}" for note in notes)


def _model(entry: dict[str, Any], path: Path) -> tuple[ObjectModel, list[str]]:
    name = str(entry["name"])
    if not name or any(character.isspace() or character == "/" for character in name):
        raise ValueError(f"expected a name without blanks and slashes, got {name!r}")
    object_class, note = checked_class(str(entry["class"])) if "class" in entry else ("", None)
    if entry["unit"] not in UNITS:
        raise ValueError(f"expected a unit of {', '.join(UNITS)}, got {entry['unit']!r}")
    scale = UNITS[entry["unit"]]
    parts: tuple[Part, ...] | None = None
    boxes: tuple[Box, ...] | None = None
    color = None
    if path.suffix == ".npz":
        mesh, parts, boxes = read_parts(path)
    else:
        mesh, color = read_mesh(path)
    if scale != 1.0:
        mesh, boxes = mesh.scaled(scale), None
    _check_size(mesh, str(entry["unit"]))
    _ = mesh.convex_hull  # refuses a flat sheet
    notes = [note] if note else []
    if "functions" not in entry or "up" in entry:  # who annotates a mesh knows its frame
        turn, note = turned_upright(mesh, object_class, entry.get("up"))
        notes += [note] if note else []
        if not np.array_equal(turn, np.eye(4)):
            mesh, boxes = mesh.transformed(turn), None
            parts = parts and tuple(Part(p.name, p.mesh.transformed(turn)) for p in parts)
        notes += shape_notes(mesh, object_class, str(entry["unit"]), UNITS)
    if "color" in entry:
        color = _vector(entry["color"], "color", farthest=1e3)
        if color.min() < 0.0 or color.max() > 1.0:
            raise ValueError(f"expected a color of values in 0..1, got {entry['color']}")
    symmetry = _symmetry(entry["symmetry"]) if "symmetry" in entry else find_symmetry(mesh)
    poses = (
        _motions(entry["stable_poses"], "stable_poses")
        if "stable_poses" in entry
        else stable_poses(mesh, symmetry)
    )
    model = ObjectModel(
        name=name,
        object_class=object_class,
        mesh=mesh,
        color=GREY if color is None else color,
        annotated_parts=parts,
        functions=_functions(entry["functions"]) if "functions" in entry else None,
        mass=_mass(entry, mesh),
        friction=_positive(entry.get("friction", _FRICTION), "friction"),
        symmetry=symmetry,
        stable_poses=poses,
        stored_boxes=boxes,
    )
    return model, notes


def write_parts(path: Path, model: ObjectModel) -> None:
    """Write mesh [m], convex parts and boxes of an object as one compressed npz file."""
    mesh, parts, boxes = model.mesh, model.parts, model.boxes
    arrays: dict[str, NDArray[Any]] = dict(
        vertices=mesh.vertices.astype(np.float32),
        faces=mesh.faces.astype(np.uint16),
        part_names=np.array([part.name for part in parts]),
        part_vertices=np.concatenate([p.mesh.vertices for p in parts]).astype(np.float32),
        part_faces=np.concatenate([p.mesh.faces for p in parts]).astype(np.uint16),
        part_counts=np.array([(len(p.mesh.vertices), len(p.mesh.faces)) for p in parts]),
        boxes=np.stack([[*box.center, *box.rotation.ravel(), *box.half_size] for box in boxes]),
    )
    write_arrays(path, arrays)


def read_parts(path: Path) -> tuple[Mesh, tuple[Part, ...], tuple[Box, ...] | None]:
    """Return mesh, convex parts and, if they are there, boxes in a file of `write_parts`.

    Raises:
        ValueError: if the file is missing or damaged.
    """
    stored = read_arrays(path, "mesh with parts")
    try:
        require_finite(stored)
        mesh = Mesh.of(stored["vertices"], stored["faces"])
        names = [str(name) for name in stored["part_names"]]
        counts = stored["part_counts"].astype(np.int64)
        totals = len(stored["part_vertices"]), len(stored["part_faces"])
        if counts.min() < 1 or tuple(counts.sum(axis=0)) != totals:
            raise ValueError(f"its parts have {totals} vertices and faces, not those counted")
        ends = np.cumsum(counts, axis=0)[:-1]
        vertices = np.split(stored["part_vertices"], ends[:, 0])
        faces = np.split(stored["part_faces"], ends[:, 1])
        meshes = [Mesh.of(v, f) for v, f in zip(vertices, faces, strict=True)]
        parts = tuple(Part(n, m) for n, m in zip(names, meshes, strict=True))
        return mesh, parts, _boxes(stored["boxes"]) if "boxes" in stored else None
    except (KeyError, ValueError, IndexError, TypeError, OverflowError) as error:
        raise ValueError(f"cannot read the mesh {path}: {error}") from error


def _boxes(rows: Array) -> tuple[Box, ...]:
    """Return the boxes of rows (K, 15): centre, rotation row by row, half edges."""
    if rows.ndim != 2 or rows.shape[1] != 15 or not len(rows):
        raise ValueError(f"expected boxes (K, 15), got {rows.shape}")
    for row in rows:
        require_pose(make_pose(row[3:12].reshape(3, 3), row[:3]), "the pose of each box")
        if not np.all(row[12:] > 0.0):
            raise ValueError("expected half edges of boxes above 0")
    return tuple(Box(row[:3], row[3:12].reshape(3, 3), row[12:]) for row in rows)


def _check_size(mesh: Mesh, unit: str) -> None:
    largest = float(np.ptp(mesh.bounds, axis=0).max())
    if _SMALLEST <= largest <= _LARGEST:
        return
    fitting = [
        other
        for other, scale in UNITS.items()
        if 0.03 <= largest / UNITS[unit] * scale <= 0.5 and other != "dm"
    ]
    advice = f"its unit is probably {' or '.join(fitting)}" if fitting else "scale it"
    raise ValueError(
        f"expected an object between {_SMALLEST * 1000:g} mm and {_LARGEST:g} m, got "
        f"{largest:.3g} m when read as unit {unit!r}: {advice}"
    )


def _vector(value: Any, what: str, farthest: float = _FARTHEST) -> Array:
    vector = np.asarray(value, dtype=np.float64)
    if vector.shape != (3,) or not np.abs(vector).max() <= farthest:
        raise ValueError(f"expected 3 numbers for {what}, none beyond {farthest:g}, got {value!r}")
    return vector


def _direction(value: Any, what: str) -> Array:
    vector = _vector(value, what)
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise ValueError(f"expected a direction for {what}, got zero")
    return vector / length


def _positive(value: Any, what: str) -> float:
    number = float(value)
    if not 0.0 < number < _LARGEST_NUMBER:
        raise ValueError(f"expected {what} above 0 and below {_LARGEST_NUMBER:g}, got {value!r}")
    return number


def _mass(entry: dict[str, Any], mesh: Mesh) -> float:
    if "mass" in entry:
        return _positive(entry["mass"], "mass")
    density = _positive(entry.get("density", _DENSITY), "density")
    solid = mesh.is_watertight and mesh.volume > 0.0
    return mesh.volume * density if solid else _OPEN_MASS


def _motions(value: Any, what: str) -> Array:
    """Return rigid motions (N, 4, 4) of rows of position [m] and rotation vector [rad]."""
    rows = np.asarray(value, dtype=np.float64).reshape(-1, 6)
    if len(rows) > _MOST_MOTIONS or (rows.size and not np.abs(rows).max() <= _FARTHEST):
        raise ValueError(
            f"expected at most {_MOST_MOTIONS} {what} of numbers within {_FARTHEST:g}, "
            f"got {len(rows)} or others"
        )
    return pose_from_vector(rows)


def _symmetry(stored: dict[str, Any]) -> Symmetry:
    return Symmetry(
        axis=_direction(stored["axis"], "axis") if stored.get("axis") is not None else None,
        turns=tuple(_motions(stored.get("turns", []), "turns")),
        center=_vector(stored["center"], "center") if stored.get("center") is not None else None,
    )


def _functions(stored: dict[str, Any]) -> Functions:
    opening, edge, face = stored.get("opening"), stored.get("edge"), stored.get("face")
    tip = stored.get("tip")
    return Functions(
        opening=opening
        and Opening(
            _vector(opening["center"], "opening center"),
            _direction(opening["normal"], "opening normal"),
            _positive(opening["radius"], "opening radius"),
        ),
        edge=edge
        and Edge(
            _vector(edge["start"], "edge start"),
            _vector(edge["end"], "edge end"),
            _direction(edge["direction"], "edge direction"),
        ),
        face=face
        and Face(_vector(face["center"], "face center"), _direction(face["normal"], "face normal")),
        tip=None if tip is None else _vector(tip, "tip"),
        handle=tuple(str(name) for name in stored.get("handle", ())),
        functional=tuple(str(name) for name in stored.get("functional", ())),
    )
