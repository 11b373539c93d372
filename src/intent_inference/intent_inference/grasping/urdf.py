"""Joint tables from URDF files, and URDF text from joint tables for the physics engine."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.scene.joint_table import Capsules, JointTable, LinkBoxes

_PALM_MASS, _LINK_MASS = 0.3, 0.02  # [kg]; the base is fixed and gravity acts on the object alone
_INERTIA = 1e-4
"""Links and what drives them, motor or muscle, about each axis [kg m²]: links as light as fingers
alone need thousands of solver iterations to press on a heavy object."""


def urdf_text(table: JointTable, effort: Array, locked: Array | None = None) -> str:
    """Return a URDF of capsules and boxes; a coupled joint becomes a joint of its own.

    Args:
        table: the hand; every link becomes a URDF link of the same name and order.
        effort: (J,) torque limits [N m].
        locked: (J,) angle at which a joint is rigid, NaN where it moves [rad]; None = all move.
    """
    angles = np.full(len(table.joint_names), np.nan) if locked is None else locked
    lines = [f'<robot name="{table.name}">']
    for link, name in enumerate(table.link_names):
        mass = _LINK_MASS if link else _PALM_MASS
        inertia = " ".join(f'i{axis}="{_INERTIA}"' for axis in ("xx", "yy", "zz"))
        lines.append(
            f'<link name="{name}"><inertial><mass value="{mass}"/>'
            f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        for shape in _shapes(table, link):
            lines += [f"<{kind}>{shape}</{kind}>" for kind in ("visual", "collision")]
        lines.append("</link>")
        if link:
            lines.append(_joint(table, link, effort, angles))
    lines.append("</robot>")
    return "\n".join(lines)


def table_from_urdf(path: Path) -> JointTable:
    """Return the joint table of a URDF whose collision shapes are spheres, cylinders or boxes.

    Cylinders become capsules of the same length. The tips of links without children are landmarks.

    Raises:
        ValueError: if the file is not a URDF or a collision shape is a mesh.
    """
    try:
        robot = ElementTree.fromstring(_without_entities(read_text(path)))
        return _table_of(robot, path)
    except ElementTree.ParseError as error:
        raise ValueError(f"{path}: expected a readable URDF file ({error})") from error
    except (ValueError, IndexError, KeyError) as error:
        message = str(error)
        raise ValueError(message if str(path) in message else f"{path}: {message}") from error


def _without_entities(text: str) -> str:
    """Return XML that defines no entities: a few lines of them may stand for gigabytes."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("expected a URDF without a document type and entities")
    return text


def _table_of(robot: ElementTree.Element, path: Path) -> JointTable:
    """Return the joint table of a parsed URDF."""
    joints = {_child(joint, "child", "link"): joint for joint in robot.findall("joint")}
    names = _ordered_links(robot, joints)
    driven = [name for name in names if name in joints and _moves(joints[name])]
    free = [name for name in driven if joints[name].find("mimic") is None]
    joint_names = tuple(joints[name].get("name", name) for name in free)
    limits = np.array([_limits(joints[name]) for name in free]).reshape(-1, 2)
    drivers, ratios = np.full(len(names), -1), np.ones(len(names))
    for name in driven:
        mimic = joints[name].find("mimic")
        source = joints[name].get("name", "") if mimic is None else mimic.get("joint", "")
        if source not in joint_names:
            raise ValueError(f"{path}: joint {joints[name].get('name')} mimics unknown {source!r}")
        drivers[names.index(name)] = joint_names.index(source)
        ratios[names.index(name)] = 1.0 if mimic is None else float(mimic.get("multiplier", "1"))
    capsules, boxes = _collision_shapes(robot, names, path)
    tips = [link for link in range(len(names)) if not _has_child(names[link], joints)]
    return JointTable(
        str(robot.get("name", path.stem)),
        tuple(names),
        np.array([-1] + [names.index(_child(joints[n], "parent", "link")) for n in names[1:]]),
        np.array([np.eye(4)] + [_origin(joints[name]) for name in names[1:]]),
        np.array([np.zeros(3)] + [_axis(joints[name]) for name in names[1:]]),
        drivers,
        ratios,
        joint_names,
        limits,
        capsules,
        np.array(tips),
        np.array([_tip(capsules, link) for link in tips]),
        boxes,
    )


def roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return URDF's fixed-axis angles [rad] of a rotation (3, 3)."""
    return (
        float(np.arctan2(rotation[2, 1], rotation[2, 2])),
        float(np.arctan2(-rotation[2, 0], np.hypot(rotation[2, 1], rotation[2, 2]))),
        float(np.arctan2(rotation[1, 0], rotation[0, 0])),
    )


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


def _placement(pose: Array) -> str:
    xyz = " ".join(f"{value:.6g}" for value in pose[:3, 3])
    rpy = " ".join(f"{value:.6g}" for value in roll_pitch_yaw(pose[:3, :3]))
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _shapes(table: JointTable, link: int) -> list[str]:
    shapes = []
    for index in np.flatnonzero(table.capsules.links == link):
        start, end = table.capsules.ends[index]
        length = float(np.linalg.norm(end - start))
        axis = (end - start) / length if length > 0 else np.array([0.0, 0.0, 1.0])
        pose = np.eye(4)
        pose[:3, 2] = axis
        pose[:3, 0] = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
        pose[:3, 0] /= np.linalg.norm(pose[:3, 0])
        pose[:3, 1] = np.cross(axis, pose[:3, 0])
        pose[:3, 3] = (start + end) / 2
        radius = table.capsules.radii[index]
        shapes.append(
            f'{_placement(pose)}<geometry><capsule radius="{radius:.6g}" length="{length:.6g}"/>'
            "</geometry>"
        )
    for index in np.flatnonzero(table.boxes.links == link):
        size = " ".join(f"{2 * half:.6g}" for half in table.boxes.half_sizes[index])
        shapes.append(
            f'{_placement(table.boxes.poses[index])}<geometry><box size="{size}"/></geometry>'
        )
    return shapes


def _joint(table: JointTable, link: int, effort: Array, locked: Array) -> str:
    driver, origin = table.drivers[link], table.origins[link]
    rigid = driver < 0 or not np.isnan(locked[driver])
    if driver >= 0 and rigid:
        turn = rotation_from_vector(table.axes[link] * table.ratios[link] * locked[driver])
        origin = origin @ make_pose(turn, np.zeros(3))
    ends = (
        f'{_placement(origin)}<parent link="{table.link_names[table.parents[link]]}"/>'
        f'<child link="{table.link_names[link]}"/>'
    )
    if rigid:
        return f'<joint name="joint_{link}" type="fixed">{ends}</joint>'
    axis = " ".join(f"{value:.6g}" for value in table.axes[link])
    lower, upper = sorted(table.limits[driver] * table.ratios[link])
    return (
        f'<joint name="joint_{link}" type="revolute">{ends}<axis xyz="{axis}"/>'
        f'<limit lower="{lower:.6g}" upper="{upper:.6g}" effort="{effort[driver]:.6g}" '
        'velocity="5"/></joint>'
    )


def _child(element: ElementTree.Element, tag: str, attribute: str) -> str:
    found = element.find(tag)
    if found is None:
        raise ValueError(f"expected <{tag}> in joint {element.get('name')!r}")
    return str(found.get(attribute))


def _has_child(name: str, joints: dict[str, ElementTree.Element]) -> bool:
    return any(_child(joint, "parent", "link") == name for joint in joints.values())


def _ordered_links(robot: ElementTree.Element, joints: dict[str, ElementTree.Element]) -> list[str]:
    """Return link names depth first, so that the links of one finger follow one another."""
    names = [str(link.get("name")) for link in robot.findall("link")]
    roots = [name for name in names if name not in joints]
    if len(roots) != 1:
        raise ValueError(f"expected one base link, got {roots}")
    if len(set(names)) != len(names):
        raise ValueError("two links have one name")
    ordered: list[str] = []
    waiting = [roots[0]]
    while waiting:
        name = waiting.pop()
        ordered.append(name)
        waiting += [
            child for child, joint in joints.items() if _child(joint, "parent", "link") == name
        ][::-1]
    if sorted(ordered) != sorted(names):
        raise ValueError(
            f"expected every link below {roots[0]}, got {len(ordered)} of {len(names)}"
        )
    return ordered


def _moves(joint: ElementTree.Element) -> bool:
    kind = joint.get("type")
    if kind not in ("revolute", "continuous", "fixed"):
        raise ValueError(
            f"joint {joint.get('name')!r} is {kind}; expected revolute, continuous or fixed: "
            "a hand whose fingers slide cannot be described here"
        )
    return kind != "fixed"


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    limit = joint.find("limit")
    if limit is None:
        return -np.pi, np.pi
    if joint.get("type") == "continuous":
        return -np.pi, np.pi
    return float(limit.get("lower", -np.pi)), float(limit.get("upper", np.pi))


def _vector(text: str | None, default: str) -> Array:
    values = np.array([float(value) for value in (text or default).split()])
    if values.shape != (3,) or not np.all(np.isfinite(values)):
        raise ValueError(f"expected three numbers, got {text!r}")
    return values


def _origin(element: ElementTree.Element) -> Array:
    pose = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        pose[:3, :3] = rotation_from_roll_pitch_yaw(_vector(origin.get("rpy"), "0 0 0"))
        pose[:3, 3] = _vector(origin.get("xyz"), "0 0 0")
    return pose


def _axis(joint: ElementTree.Element) -> Array:
    axis = joint.find("axis")
    vector = _vector(None if axis is None else axis.get("xyz"), "1 0 0")
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise ValueError(f"joint {joint.get('name')!r} turns about an axis of length zero")
    return np.asarray(vector / length)


def _collision_shapes(
    robot: ElementTree.Element, names: list[str], path: Path
) -> tuple[Capsules, LinkBoxes]:
    links, ends, radii = [], [], []
    box_links, poses, halves = [], [], []
    for link in robot.findall("link"):
        index = names.index(str(link.get("name")))
        for collision in link.findall("collision"):
            pose, geometry = _origin(collision), collision.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is not None and shape.tag == "box":
                box_links.append(index)
                poses.append(pose)
                halves.append(_vector(shape.get("size"), "0 0 0") / 2)
            elif shape is not None and shape.tag in ("cylinder", "capsule", "sphere"):
                half = np.array([0.0, 0.0, float(shape.get("length", "0")) / 2])
                links.append(index)
                ends.append([pose[:3, :3] @ end + pose[:3, 3] for end in (-half, half)])
                radii.append(float(shape.get("radius", "0")))
            else:
                tag = "nothing" if shape is None else shape.tag
                raise ValueError(
                    f"{path}: link {link.get('name')} collides by {tag}; expected "
                    "box, cylinder, capsule or sphere"
                )
    if not links:
        raise ValueError(f"{path}: expected at least one cylinder, capsule or sphere")
    boxes = LinkBoxes(
        np.array(box_links, dtype=np.int64),
        np.array(poses).reshape(-1, 4, 4),
        np.array(halves).reshape(-1, 3),
    )
    return Capsules(np.array(links), np.array(ends), np.array(radii)), boxes


def _tip(capsules: Capsules, link: int) -> Array:
    """Return the far end of a link's last capsule, on the skin [m]; the origin if it has none."""
    found = np.flatnonzero(capsules.links == link)
    return np.zeros(3) if len(found) == 0 else capsules.ends[found[-1], 1]
