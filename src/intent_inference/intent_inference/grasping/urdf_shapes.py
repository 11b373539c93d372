"""What a URDF's links collide by: spheres, cylinders, boxes, and meshes as a few boxes."""

import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Faces, Mesh, read_mesh
from intent_perception.geometry.transforms import make_pose
from intent_tracking.scene.joint_table import Capsules, LinkBoxes

_SLICE, _MOST_SLICES = 0.02, 5
"""A mesh is cut into slices about so long [m], but not more of them."""
_THINNEST = 0.0015
"""Half the least thickness of a box [m]."""
_READABLE = (".stl", ".obj", ".ply", ".glb", ".off")


def vector(text: str | None, default: str) -> Array:
    """Return three numbers of an attribute.

    Raises:
        ValueError: if they are not three.
    """
    values = np.array([float(value) for value in (text or default).split()])
    if values.shape != (3,) or not np.all(np.isfinite(values)):
        raise ValueError(f"expected three numbers, got {text!r}")
    return values


def origin_of(element: ElementTree.Element) -> Array:
    """Return the pose (4, 4) that an element's <origin> gives."""
    pose = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        pose[:3, :3] = rotation_from_roll_pitch_yaw(vector(origin.get("rpy"), "0 0 0"))
        pose[:3, 3] = vector(origin.get("xyz"), "0 0 0")
    return pose


def axis_of(joint: ElementTree.Element) -> Array:
    """Return the unit axis (3,) of a joint.

    Raises:
        ValueError: if it has no direction.
    """
    axis = joint.find("axis")
    direction = vector(None if axis is None else axis.get("xyz"), "1 0 0")
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise ValueError(f"joint {joint.get('name')!r} turns about an axis of length zero")
    return np.asarray(direction / length)


def rotation_from_roll_pitch_yaw(angles: Array) -> Array:
    """Return the rotation (3, 3) of URDF's fixed-axis angles [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def collision_shapes(
    robot: ElementTree.Element,
    path: Path,
    carriers: dict[str, str],
    mounts: dict[str, Array],
    moving: list[str],
) -> tuple[Capsules, LinkBoxes]:
    """Return what all links collide by, in the frames of the links that carry them.

    Args:
        robot: the URDF.
        path: its file; meshes are looked for from there.
        carriers: the moving link that each link is fixed to.
        mounts: pose (4, 4) of each link in its carrier.
        moving: names of the links of the table.

    Raises:
        ValueError: if there is no shape or a mesh cannot be read.
    """
    round_links, ends, radii = list[int](), list[Array](), list[float]()
    box_links, poses, halves = list[int](), list[Array](), list[Array]()
    for link in robot.findall("link"):
        name = str(link.get("name"))
        if name not in carriers:  # of the arm, not of the hand
            continue
        index = moving.index(carriers[name])
        for collision in link.findall("collision"):
            pose = mounts[name] @ origin_of(collision)
            shape = next(iter(collision.findall("geometry/*")), None)
            if shape is not None and shape.tag in ("cylinder", "capsule", "sphere"):
                half = np.array([0.0, 0.0, float(shape.get("length", "0")) / 2])
                round_links.append(index)
                ends.append(np.array([pose[:3, :3] @ end + pose[:3, 3] for end in (-half, half)]))
                radii.append(float(shape.get("radius", "0")))
                continue
            for placed, size in _boxes(shape, path, name):
                box_links.append(index)
                poses.append(pose @ placed)
                halves.append(size)
    if not round_links and not box_links:
        raise ValueError(f"{path}: expected links with collision shapes, got none")
    boxes = LinkBoxes(
        np.array(box_links, dtype=np.int64),
        np.array(poses).reshape(-1, 4, 4),
        np.array(halves).reshape(-1, 3),
    )
    round_ones = Capsules(
        np.array(round_links, dtype=np.int64), np.array(ends).reshape(-1, 2, 3), np.array(radii)
    )
    return round_ones, boxes


def _boxes(
    shape: ElementTree.Element | None, path: Path, link: str
) -> Iterator[tuple[Array, Array]]:
    """Yield pose (4, 4) and half edges (3,) of the boxes of a box or a mesh."""
    if shape is not None and shape.tag == "box":
        yield np.eye(4), vector(shape.get("size"), "0 0 0") / 2
    elif shape is not None and shape.tag == "mesh":
        mesh = read_mesh(mesh_file(str(shape.get("filename")), path.parent))[0]
        scale = vector(shape.get("scale"), "1 1 1")
        yield from mesh_boxes(Mesh(mesh.vertices * scale, mesh.faces))
    else:
        tag = "nothing" if shape is None else shape.tag
        raise ValueError(
            f"{path}: link {link} collides by {tag}; expected box, cylinder, capsule, sphere "
            "or mesh"
        )


def mesh_file(name: str, folder: Path) -> Path:
    """Return the file of a mesh as a URDF names it: package://…, file://… or a path.

    Packages are looked for in the folders above the URDF, then where ROS has them. COLLADA is not
    read; a mesh of the same name in another format is taken in its place.

    Raises:
        ValueError: if there is none.
    """
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        homes = [folder, *folder.parents]
        places = [home / package / rest for home in homes]
        places += [home / rest for home in homes if home.name == package]
        places += [Path(p) / "share" / package / rest for p in _paths("AMENT_PREFIX_PATH")]
        places += [Path(p) / package / rest for p in _paths("ROS_PACKAGE_PATH")]
    else:
        places = [folder / name.removeprefix("file://")]
    for place in places:
        for kind in (place.suffix, *_READABLE):
            file = place.with_suffix(kind)
            if file.is_file() and kind.lower() in _READABLE:
                return file
    raise ValueError(
        f"the mesh {name} was not found as {', '.join(_READABLE)}: looked at {places[0]} and "
        f"{len(places) - 1} more places; convert COLLADA (.dae) to .stl, or write a path in its "
        "place"
    )


def _paths(variable: str) -> list[str]:
    return [path for path in os.environ.get(variable, "").split(os.pathsep) if path]


def mesh_boxes(mesh: Mesh) -> list[tuple[Array, Array]]:
    """Return boxes around slices of a mesh: poses (4, 4) and half edges (3,) [m].

    The slices follow one another along its longest extent, in the axes of its frame or in its
    principal axes, whichever make the smaller box.
    """
    axes = np.eye(3)
    centered = mesh.vertices - mesh.vertices.mean(axis=0)
    principal = np.linalg.svd(centered, full_matrices=False)[2]
    if np.ptp(centered @ principal.T, axis=0).prod() < 0.8 * np.ptp(centered, axis=0).prod():
        axes = principal * np.sign(np.linalg.det(principal))
    points = mesh.vertices @ axes.T
    low, high = points.min(axis=0), points.max(axis=0)
    along = int(np.argmax(high - low))
    count = int(np.clip(np.ceil((high - low)[along] / _SLICE), 1, _MOST_SLICES))
    cuts = np.linspace(low[along], high[along], count + 1)
    found = []
    for start, end in itertools.pairwise(cuts):
        inside = _slice_points(points, mesh.faces, along, start, end)
        if len(inside) == 0:
            continue
        least, most = inside.min(axis=0), inside.max(axis=0)
        least[along], most[along] = start, end
        half = np.maximum((most - least) / 2, _THINNEST)
        found.append((make_pose(axes.T, axes.T @ ((most + least) / 2)), half))
    return found


def _slice_points(points: Array, faces: Faces, along: int, start: float, end: float) -> Array:
    """Return the vertices between two planes, and where edges cross the planes (N, 3)."""
    value = points[:, along]
    kept = [points[(value >= start) & (value <= end)]]
    pairs = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    first, second = points[pairs[:, 0]], points[pairs[:, 1]]
    for plane in (start, end):
        below, above = first[:, along] - plane, second[:, along] - plane
        crossing = below * above < 0.0
        share = (below / np.where(crossing, below - above, 1.0))[crossing, None]
        kept.append(first[crossing] + share * (second[crossing] - first[crossing]))
    return np.concatenate(kept)


def tip_of(capsules: Capsules, boxes: LinkBoxes, link: int) -> Array:
    """Return the far end of a link's last round shape, or of its boxes [m]; else the origin."""
    found = np.flatnonzero(capsules.links == link)
    if len(found):
        return np.asarray(capsules.ends[found[-1], 1])
    faces = [
        pose[:3, 3] + sign * half * pose[:3, axis]
        for pose, halves in zip(
            boxes.poses[boxes.links == link], boxes.half_sizes[boxes.links == link], strict=True
        )
        for axis, half in enumerate(halves)
        for sign in (-1.0, 1.0)
    ]
    return np.asarray(max(faces, key=lambda face: float(np.linalg.norm(face)), default=np.zeros(3)))
