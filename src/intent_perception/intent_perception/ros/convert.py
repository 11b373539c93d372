"""Results of this package to and from messages; poses, transforms and markers for all packages."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped, Vector3
from intent_msgs import msg as msgs
from std_msgs.msg import ColorRGBA, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from intent_perception.bags.frame_assembly import NANOSECONDS, stamp_of
from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    make_pose,
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

TABLE_FRAME = "table"
CAMERA_FRAME = "camera_color_optical_frame"


@dataclass(frozen=True)
class TableFrame(Checked):
    """What the table is called on /tf and in the headers of messages."""

    table_frame: str = TABLE_FRAME
    """Name of the table's frame; two graphs that share one /tf need two."""


@dataclass(frozen=True)
class FrameNames(TableFrame):
    """What the frames are called in which hand and objects are published."""

    hand_frame: str = "hand_wrist"
    """Name of the wrist's frame."""
    object_frames: str = "object_"
    """What comes before an object's id in the name of its frame."""

    def of_object(self, object_id: str) -> str:
        """Return the frame of an object."""
        return f"{self.object_frames}{object_id}"


_NAMES = FrameNames()


def header_at(stamp: int, frame: str = TABLE_FRAME) -> Any:
    """Return a header at a time [ns]."""
    seconds, nanoseconds = divmod(stamp, NANOSECONDS)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame)


def pose_to_msg(pose: Array) -> Any:
    """Return a geometry_msgs/Pose of a transform (4, 4)."""
    x, y, z = (float(value) for value in pose[:3, 3])
    qx, qy, qz, qw = (float(value) for value in quaternion_from_rotation(pose[:3, :3]))
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def pose_from_msg(pose: Any) -> Array:
    """Return the transform (4, 4) of a geometry_msgs/Pose."""
    p, q = pose.position, pose.orientation
    rotation = rotation_from_quaternion(np.array([q.x, q.y, q.z, q.w]))
    return make_pose(rotation, np.array([p.x, p.y, p.z]))


def vector_to_msg(vector: Sequence[float] | Array) -> Any:
    """Return a geometry_msgs/Vector3."""
    x, y, z = (float(value) for value in vector)
    return Vector3(x=x, y=y, z=z)


def vector_from_msg(vector: Any) -> Array:
    """Return (3,) of a Vector3 or Point."""
    return np.array([vector.x, vector.y, vector.z])


def transforms_to_msg(header: Any, poses: Iterable[tuple[str, Array]]) -> Any:
    """Return a TFMessage of child frames and their poses (4, 4) in the header's frame."""
    transforms = []
    for child, pose in poses:
        message = pose_to_msg(pose)
        transform = TransformStamped(header=header, child_frame_id=child)
        transform.transform.translation = vector_to_msg(pose[:3, 3])
        transform.transform.rotation = message.orientation
        transforms.append(transform)
    return TFMessage(transforms=transforms)


def objects_to_msg(
    objects: RecognizedObjects,
    database: ObjectDatabase,
    camera_frame: str = CAMERA_FRAME,
    table_frame: str = TABLE_FRAME,
) -> Any:
    """Return the message of recognised objects."""
    return msgs.RecognizedObjects(
        header=header_at(objects.stamp, table_frame),
        objects=[
            _object_to_msg(item, item.shape or database[item.model]) for item in objects.objects
        ],
        camera_frame=camera_frame,
        camera_pose=pose_to_msg(objects.T_table_camera),
        complete=bool(objects.complete),
    )


def _object_to_msg(item: RecognizedObject, model: ObjectModel) -> Any:
    symmetry = model.symmetry
    return msgs.RecognizedObject(
        id=item.id,
        model="" if item.shape is not None else item.model,
        object_class=item.object_class,
        pose=pose_to_msg(item.T_table_object),
        confidence=float(item.confidence),
        visible_fraction=float(item.visible_fraction),
        symmetry_axis=vector_to_msg(np.zeros(3) if symmetry.axis is None else symmetry.axis),
        symmetry_turns=[pose_to_msg(turn) for turn in symmetry.turns],
    )


def objects_from_msg(
    message: Any, shapes: Mapping[str, tuple[int, ObjectModel]] | None = None
) -> RecognizedObjects:
    """Return the recognised objects of a message.

    Args:
        message: RecognizedObjects.
        shapes: revision and shape of each estimated thing, by id. Things without are left out.
    """
    known = shapes or {}
    return RecognizedObjects(
        stamp=stamp_of(message),
        objects=tuple(
            _object_from_msg(item, *known.get(item.id, (0, None)))
            for item in message.objects
            if item.model or item.id in known
        ),
        T_table_camera=pose_from_msg(message.camera_pose),
        complete=message.complete,
    )


def _object_from_msg(item: Any, revision: int, shape: ObjectModel | None) -> RecognizedObject:
    estimated = shape if not item.model else None
    return RecognizedObject(
        id=item.id,
        model=item.model if estimated is None else estimated.name,
        object_class=item.object_class,
        T_table_object=pose_from_msg(item.pose),
        confidence=item.confidence,
        visible_fraction=item.visible_fraction,
        shape=estimated,
        revision=0 if estimated is None else revision,
    )


def deletion(namespace: str) -> Any:
    """Return the marker that removes all markers of a namespace."""
    return Marker(header=header_at(0), ns=namespace, id=-1, action=Marker.DELETEALL)


def object_markers(items: Iterable[tuple[str, ObjectModel]], names: FrameNames = _NAMES) -> Any:
    """Return the meshes of objects (id, model), each locked to its own TF frame.

    They are sent once and move with /tf, so a mesh costs nothing per frame.
    """
    markers = [deletion("objects")]
    for index, (object_id, model) in enumerate(items):
        corners = model.mesh.vertices[model.mesh.faces.ravel()]
        red, green, blue = (float(value) for value in model.color)
        marker = Marker(
            header=header_at(0, names.of_object(object_id)),
            ns="objects",
            id=index,
            type=Marker.TRIANGLE_LIST,
            action=Marker.ADD,
            frame_locked=True,
            scale=Vector3(x=1.0, y=1.0, z=1.0),
            color=ColorRGBA(r=red, g=green, b=blue, a=0.8),
        )
        marker.pose.orientation.w = 1.0
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners.tolist()]
        markers.append(marker)
    return MarkerArray(markers=markers)
