"""Joint tables from URDF files, and URDF text from joint tables for the physics engine."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from intent_inference.grasping.urdf_shapes import axis_of, collision_shapes, origin_of, tip_of
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.scene.joint_table import JointTable

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


def table_from_urdf(path: Path, base: str = "") -> JointTable:
    """Return the joint table of a URDF: its joints turn or slide, its shapes collide.

    Cylinders become capsules of the same length, meshes a few boxes. What is fixed to a link is a
    part of it. The tips of links without children are landmarks.

    Args:
        path: URDF file, xacro already carried out.
        base: link that the hand begins with; empty: the root.

    Raises:
        ValueError: if the file is not a URDF or describes something that is no hand.
    """
    try:
        robot = ElementTree.fromstring(_without_entities(read_text(path)))
        return _table_of(robot, path, base)
    except ElementTree.ParseError as error:
        raise ValueError(f"{path}: expected a readable URDF file ({error})") from error
    except (ValueError, IndexError, KeyError) as error:
        message = str(error)
        raise ValueError(message if str(path) in message else f"{path}: {message}") from error


def _without_entities(text: str) -> str:
    """Return XML that defines no entities: a few lines of them may stand for gigabytes."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("expected a URDF without a document type and entities")
    if "<xacro:" in text:
        raise ValueError("expected a URDF, got xacro: run xacro on it first")
    return text


def _table_of(robot: ElementTree.Element, path: Path, base: str) -> JointTable:
    """Return the joint table of a parsed URDF."""
    joints = {_child(joint, "child", "link"): joint for joint in robot.findall("joint")}
    names = _ordered_links(robot, joints, base)
    moving = [names[0]] + [name for name in names[1:] if _moves(joints[name])]
    free = [name for name in moving[1:] if joints[name].find("mimic") is None]
    joint_names = tuple(joints[name].get("name", name) for name in free)
    limits = np.array([_limits(joints[name]) for name in free]).reshape(-1, 2)
    carriers, mounts = _carriers(names, joints, set(moving))
    drivers, ratios = np.full(len(moving), -1), np.ones(len(moving))
    origins, axes = [np.eye(4)], [np.zeros(3)]
    for link, name in enumerate(moving[1:], start=1):
        joint = joints[name]
        mimic = joint.find("mimic")
        source = joint.get("name", "") if mimic is None else mimic.get("joint", "")
        if source not in joint_names:
            raise ValueError(f"{path}: joint {joint.get('name')} mimics unknown {source!r}")
        drivers[link] = joint_names.index(source)
        parent = _child(joint, "parent", "link")
        axes.append(axis_of(joint))
        origins.append(mounts[parent] @ origin_of(joint) @ _start(joint, mimic))
        ratios[link] = 1.0 if mimic is None else float(mimic.get("multiplier", "1"))
    parents = [moving.index(carriers[_child(joints[n], "parent", "link")]) for n in moving[1:]]
    capsules, boxes = collision_shapes(robot, path, carriers, mounts, moving)
    tips = [link for link in range(1, len(moving)) if link not in parents]
    return JointTable(
        str(robot.get("name", path.stem)),
        tuple(moving),
        np.array([-1, *parents]),
        np.array(origins),
        np.array(axes),
        drivers,
        ratios,
        joint_names,
        limits,
        capsules,
        np.array(tips, dtype=np.int64),
        np.array([tip_of(capsules, boxes, link) for link in tips]).reshape(-1, 3),
        boxes,
        tuple(k for k, n in enumerate(moving) if k and joints[n].get("type") == "prismatic"),
    )


def _carriers(
    names: list[str], joints: dict[str, ElementTree.Element], moving: set[str]
) -> tuple[dict[str, str], dict[str, Array]]:
    """Return for each link the moving link (or base) that it is fixed to, and its pose in it."""
    carriers, mounts = dict[str, str](), dict[str, Array]()
    for name in names:  # parents first
        if name in moving:
            carriers[name], mounts[name] = name, np.eye(4)
        else:
            parent = _child(joints[name], "parent", "link")
            carriers[name] = carriers[parent]
            mounts[name] = mounts[parent] @ origin_of(joints[name])
    return carriers, mounts


def _start(joint: ElementTree.Element, mimic: ElementTree.Element | None) -> Array:
    """Return where a mimicking joint stands when the one that it follows is at zero (4, 4)."""
    offset = 0.0 if mimic is None else float(mimic.get("offset", "0"))
    if joint.get("type") == "prismatic":
        return make_pose(np.eye(3), offset * axis_of(joint))
    return make_pose(rotation_from_vector(offset * axis_of(joint)), np.zeros(3))


def roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return URDF's fixed-axis angles [rad] of a rotation (3, 3)."""
    return (
        float(np.arctan2(rotation[2, 1], rotation[2, 2])),
        float(np.arctan2(-rotation[2, 0], np.hypot(rotation[2, 1], rotation[2, 2]))),
        float(np.arctan2(rotation[1, 0], rotation[0, 0])),
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
    slides = link in table.sliding
    if driver >= 0 and rigid:
        way = table.axes[link] * table.ratios[link] * locked[driver]
        moved = (np.eye(3), way) if slides else (rotation_from_vector(way), np.zeros(3))
        origin = origin @ make_pose(*moved)
    ends = (
        f'{_placement(origin)}<parent link="{table.link_names[table.parents[link]]}"/>'
        f'<child link="{table.link_names[link]}"/>'
    )
    if rigid:
        return f'<joint name="joint_{link}" type="fixed">{ends}</joint>'
    axis = " ".join(f"{value:.6g}" for value in table.axes[link])
    lower, upper = sorted(table.limits[driver] * table.ratios[link])
    return (
        f'<joint name="joint_{link}" type="{"prismatic" if slides else "revolute"}">{ends}'
        f'<axis xyz="{axis}"/>'
        f'<limit lower="{lower:.6g}" upper="{upper:.6g}" effort="{effort[driver]:.6g}" '
        'velocity="5"/></joint>'
    )


def _child(element: ElementTree.Element, tag: str, attribute: str) -> str:
    found = element.find(tag)
    if found is None:
        raise ValueError(f"expected <{tag}> in joint {element.get('name')!r}")
    return str(found.get(attribute))


def _ordered_links(
    robot: ElementTree.Element, joints: dict[str, ElementTree.Element], base: str
) -> list[str]:
    """Return link names depth first, so that the links of one finger follow one another."""
    names = [str(link.get("name")) for link in robot.findall("link")]
    roots = [base] if base else [name for name in names if name not in joints]
    if base and base not in names:
        raise ValueError(f"no link is called {base!r}; there are {', '.join(names)}")
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
    if not base and sorted(ordered) != sorted(names):
        raise ValueError(
            f"expected every link below {roots[0]}, got {len(ordered)} of {len(names)}"
        )
    return ordered


def _moves(joint: ElementTree.Element) -> bool:
    kind = joint.get("type")
    if kind not in ("revolute", "continuous", "prismatic", "fixed"):
        raise ValueError(
            f"joint {joint.get('name')!r} is {kind}; expected revolute, continuous, prismatic or "
            "fixed"
        )
    return kind != "fixed"


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    limit, slides = joint.find("limit"), joint.get("type") == "prismatic"
    if slides and (limit is None or limit.get("upper") is None):
        raise ValueError(f"joint {joint.get('name')!r} slides without limits")
    if limit is None or joint.get("type") == "continuous":
        return -np.pi, np.pi
    free = "0" if slides else str(-np.pi)
    return float(limit.get("lower", free)), float(limit.get("upper", str(np.pi)))
