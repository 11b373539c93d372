"""Estimated shapes to and from messages."""

from typing import Any

import numpy as np
from geometry_msgs.msg import Point
from intent_msgs import msg as msgs

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.model import (
    Edge,
    Face,
    Functions,
    ObjectModel,
    Opening,
    Part,
    Symmetry,
)
from intent_perception.recognition.estimation.shape_memory import shape_name
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_perception.ros.convert import (
    TABLE_FRAME,
    header_at,
    pose_from_msg,
    pose_to_msg,
    vector_from_msg,
    vector_to_msg,
)

_DENSITY = 400.0
"""Of things of which nobody knows what they are made of [kg/m^3]; messages carry no mass."""
_FRICTION = 0.5


def shapes_to_msg(objects: RecognizedObjects, table_frame: str = TABLE_FRAME) -> Any:
    """Return the message of the estimated shapes among recognised objects."""
    shapes = [
        shape_to_msg(item.id, item.revision, item.shape)
        for item in objects.objects
        if item.shape is not None
    ]
    return msgs.ObjectShapes(header=header_at(objects.stamp, table_frame), shapes=shapes)


def shape_to_msg(object_id: str, revision: int, model: ObjectModel) -> Any:
    """Return the message of one estimated shape."""
    symmetry = model.symmetry
    functions = model.functions or Functions()
    message = msgs.ObjectShape(
        id=object_id,
        object_class=model.object_class,
        revision=revision,
        closed=bool(model.mesh.is_watertight),
        vertices=_numbers(model.mesh.vertices),
        triangles=_indices(model.mesh.faces),
        color=[float(value) for value in model.color],
        parts=[_part_to_msg(part, functions) for part in model.annotated_parts or ()],
        annotated=model.functions is not None,
        symmetry_axis=vector_to_msg(np.zeros(3) if symmetry.axis is None else symmetry.axis),
        symmetry_center=_point(np.zeros(3) if symmetry.center is None else symmetry.center),
        symmetry_turns=[pose_to_msg(turn) for turn in symmetry.turns],
        stable_poses=[pose_to_msg(pose) for pose in model.stable_poses],
    )
    _annotate(message, functions)
    return message


def _annotate(message: Any, functions: Functions) -> None:
    opening, edge, face, tip = functions.opening, functions.edge, functions.face, functions.tip
    if opening is not None:
        message.has_opening, message.opening_radius = True, float(opening.radius)
        message.opening_center = _point(opening.center)
        message.opening_normal = vector_to_msg(opening.normal)
    if edge is not None:
        message.has_edge = True
        message.edge_start, message.edge_end = _point(edge.start), _point(edge.end)
        message.edge_direction = vector_to_msg(edge.direction)
    if face is not None:
        message.has_face = True
        message.face_center, message.face_normal = (
            _point(face.center),
            vector_to_msg(face.normal),
        )
    if tip is not None:
        message.has_tip, message.tip = True, _point(tip)


def _part_to_msg(part: Part, functions: Functions) -> Any:
    role = msgs.ShapePart.PLAIN
    if part.name in functions.handle:
        role = msgs.ShapePart.HANDLE
    elif part.name in functions.functional:
        role = msgs.ShapePart.FUNCTIONAL
    return msgs.ShapePart(
        name=part.name,
        role=role,
        vertices=_numbers(part.mesh.vertices),
        triangles=_indices(part.mesh.faces),
    )


def shape_from_msg(message: Any) -> ObjectModel:
    """Return the shape of a message, under the name of its thing and revision.

    Raises:
        ValueError: if it is no mesh.
    """
    mesh = _mesh(message.vertices, message.triangles)
    parts = tuple(Part(part.name, _mesh(part.vertices, part.triangles)) for part in message.parts)
    axis = vector_from_msg(message.symmetry_axis)
    turning = bool(axis.any())
    poses = [pose_from_msg(pose) for pose in message.stable_poses]
    return ObjectModel(
        name=shape_name(message.id, message.revision),
        object_class=message.object_class,
        mesh=mesh,
        color=np.array(message.color),
        annotated_parts=parts or None,
        functions=_functions(message) if message.annotated else None,
        mass=float(np.clip(_DENSITY * abs(mesh.convex_hull.volume), 0.02, 3.0)),
        friction=_FRICTION,
        symmetry=Symmetry(
            axis if turning else None,
            tuple(pose_from_msg(turn) for turn in message.symmetry_turns),
            vector_from_msg(message.symmetry_center) if turning else None,
        ),
        stable_poses=np.reshape(poses, (-1, 4, 4)),
    )


def _functions(message: Any) -> Functions:
    roles: dict[int, list[str]] = {
        role: [] for role in (msgs.ShapePart.HANDLE, msgs.ShapePart.FUNCTIONAL)
    }
    for part in message.parts:
        if part.role in roles and part.name not in roles[part.role]:
            roles[part.role].append(part.name)
    opening = edge = face = None
    if message.has_opening:
        center, normal = message.opening_center, message.opening_normal
        opening = Opening(vector_from_msg(center), vector_from_msg(normal), message.opening_radius)
    if message.has_edge:
        ends = (message.edge_start, message.edge_end, message.edge_direction)
        edge = Edge(*(vector_from_msg(value) for value in ends))
    if message.has_face:
        face = Face(vector_from_msg(message.face_center), vector_from_msg(message.face_normal))
    return Functions(
        opening,
        edge,
        face,
        vector_from_msg(message.tip) if message.has_tip else None,
        tuple(roles[msgs.ShapePart.HANDLE]),
        tuple(roles[msgs.ShapePart.FUNCTIONAL]),
    )


def _mesh(vertices: Any, triangles: Any) -> Mesh:
    corners, faces = np.asarray(vertices, np.float64), np.asarray(triangles, np.int64)
    if corners.size % 3 or faces.size % 3:
        raise ValueError(f"expected triples of an estimated shape, got {corners.size} {faces.size}")
    return Mesh.of(corners.reshape(-1, 3), faces.reshape(-1, 3))


def _numbers(vertices: Array) -> list[float]:
    values: list[float] = np.asarray(vertices, np.float32).ravel().tolist()
    return values


def _indices(faces: Any) -> list[int]:
    values: list[int] = faces.ravel().tolist()
    return values


def _point(place: Array) -> Any:
    x, y, z = (float(value) for value in place)
    return Point(x=x, y=y, z=z)
