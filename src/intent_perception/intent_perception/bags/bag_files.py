"""Bags: RGB-D frames out of a rosbag2 folder, and into one.

Needs no ROS installation. A bag of another set-up is read as it is: its colour, depth and
camera_info topics are recognised by type and name.
"""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from intent_perception.bags.bag_checksums import write_checksums
from intent_perception.bags.bag_images import (
    DEPTH_FORMATS,
    STORE,
    color_message,
    depth_message,
    header_message,
    info_message,
)
from intent_perception.bags.bag_opening import intact_messages, opened
from intent_perception.bags.bag_topics import (
    COMPRESSED,
    IMAGE,
    INFO_TOPIC,
    BagInput,
    ImageTopics,
    chosen_topics,
    holds_depth,
)
from intent_perception.bags.frame_assembly import (
    NANOSECONDS,
    FrameSynchroniser,
    Straight,
    SynchroniserConfig,
    depth_from,
)
from intent_perception.geometry.camera import RgbdFrame

_FEW = 3
"""Fewer repeated stamps are no sign of a camera without a clock."""
_FOREVER = QosTime(2147483647, 4294967295)
_QOS = Qos(
    QosHistory.KEEP_LAST,
    10,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    _FOREVER,
    _FOREVER,
    QosLiveliness.AUTOMATIC,
    _FOREVER,
    avoid_ros_namespace_conventions=False,
)


@dataclass(frozen=True)
class BagMessage:
    """One message as it is stored."""

    topic: str
    """Name of the topic it was recorded from."""
    type: str
    """ROS type, for instance sensor_msgs/msg/Image."""
    received: int
    """Time at which the recorder received it [ns]."""
    data: bytes
    """The message in CDR."""

    @property
    def stamp(self) -> int:
        """Time in the message's header [ns]; only for types that begin with a header.

        Raises:
            ValueError: if the message is cut off.
        """
        if len(self.data) < 12:
            raise ValueError(f"a message on {self.topic} is cut off: {len(self.data)} bytes")
        order = "<" if self.data[1] & 1 else ">"
        seconds, nanoseconds = struct.unpack_from(f"{order}iI", self.data, 4)
        return int(seconds) * NANOSECONDS + int(nanoseconds)

    def decoded(self) -> Any:
        """Return the message with its fields.

        Raises:
            ValueError: if its bytes are no message of its type.
        """
        try:
            return STORE.deserialize_cdr(self.data, self.type)
        except Exception as error:  # struct's, UTF-8's, numpy's and rosbags' own
            raise ValueError(
                f"a message on {self.topic} is damaged or no {self.type}: {error or type(error)}"
            ) from error


def image_topics(path: Path | str, named: Sequence[str] = ()) -> ImageTopics:
    """Return the topics of a bag that carry colour, depth and camera_info.

    Args:
        path: a rosbag2 folder.
        named: those that the user has named; empty: they are found.

    Raises:
        ValueError: if the bag cannot be read, one of them is not there, or several would do.
    """
    with opened(path) as reader:
        types = {c.topic: c.msgtype for c in reader.connections if c.msgcount}
    if not types:
        raise ValueError(f"bag {path} is empty: it holds no message")
    depth = () if named else _depth_topics(path, types)
    return chosen_topics(path, types, depth, named)


def _depth_topics(path: Path | str, types: Mapping[str, str]) -> list[str]:
    """Return the topics whose first image holds depth; of a damaged one its name tells."""
    waiting = {topic for topic, kind in types.items() if kind in (IMAGE, COMPRESSED)}
    found = []
    with opened(path) as reader:
        wanted = [c for c in reader.connections if c.topic in waiting]
        for connection, received, data in intact_messages(reader, wanted, lambda _: None, path):
            if connection.topic not in waiting:
                continue
            waiting.discard(connection.topic)
            first = BagMessage(connection.topic, connection.msgtype, received, data)
            if _is_depth(first):
                found.append(first.topic)
            if not waiting:
                break
    return found + [topic for topic in waiting if "depth" in topic.lower()]


def _is_depth(first: BagMessage) -> bool:
    try:
        return holds_depth(first.topic, first.type, first.decoded())
    except ValueError:
        return "depth" in first.topic.lower()


def read_messages(
    path: Path | str,
    topics: Sequence[str] = (),
    on_damage: Callable[[str], None] | None = None,
) -> Iterator[BagMessage]:
    """Yield the messages of a bag in the order of their reception.

    Args:
        path: a rosbag2 folder (mcap or sqlite3, compressed or not), or one such file.
        topics: only these; empty: all.
        on_damage: told at the end how many messages could not be read and were left out; without
            it the first such message raises.

    Raises:
        ValueError: if the bag is missing, truncated, damaged or empty.
    """
    count = 0
    with opened(path) as reader:
        wanted = [c for c in reader.connections if not topics or c.topic in topics]
        messages = intact_messages(reader, wanted, on_damage, path) if wanted else iter(())
        for connection, received, data in messages:
            count += 1
            yield BagMessage(connection.topic, connection.msgtype, received, data)
    if not count:
        raise ValueError(f"bag {path} is empty: no message on {', '.join(topics) or 'any topic'}")


def read_frames(
    path: Path | str,
    config: SynchroniserConfig | None = None,
    on_bad_frame: Callable[[str], None] | None = None,
    given: BagInput | None = None,
) -> Iterator[RgbdFrame]:
    """Yield the RGB-D frames of a bag, the same ones that a node makes of its messages.

    Args:
        path: a rosbag2 folder.
        config: which images belong together.
        on_bad_frame: called with the reason for each frame that cannot be decoded, which is then
            left out, and at the end with what else is missing; without it such a frame raises.
        given: topics and depth's unit as the user says them; None = both are found.

    Raises:
        ValueError: if the bag is missing, truncated, damaged, empty, makes no frame, or its images
            carry no times.
    """
    given = given or BagInput()
    topics = image_topics(path, given.topics)
    if not topics.info:
        raise ValueError(f"bag {path} has no camera_info: record that topic too")
    straight = Straight(
        given.images.straight(topics.color, "color"), given.images.straight(topics.depth, "depth")
    )
    synchroniser = FrameSynchroniser(
        config or SynchroniserConfig(), given.images.depth_scale, straight
    )
    add = {
        topics.color: synchroniser.add_color,
        topics.depth: synchroniser.add_depth,
        topics.info: synchroniser.add_info,
    }
    count = 0
    for message in read_messages(path, (topics.color, topics.depth, topics.info), on_bad_frame):
        try:
            messages = add[message.topic](message.decoded())
            frame = messages.decoded() if messages is not None else None
        except ValueError as error:
            if on_bad_frame is None:
                raise ValueError(f"bag {path}: {error}") from error
            on_bad_frame(str(error))
            continue
        if synchroniser.repeated >= max(count, _FEW):
            raise ValueError(
                f"bag {path}: the depth images repeat their time stamps ({message.stamp} ns): "
                "the camera's driver must stamp its images; record it again"
            )
        if frame is not None:
            count += 1
            yield frame
    if not count:
        raise ValueError(f"bag {path}: no colour image has a depth image of the same time")
    if on_bad_frame is not None and (unused := synchroniser.dropped + synchroniser.waiting):
        on_bad_frame(
            f"{unused} images have no partner of the same time, come before the first camera_info "
            "or repeat a time stamp: left out"
        )


class BagWriter:
    """Writes RGB-D frames to a new rosbag2 folder; use it in a `with` statement.

    Depth is stored in whole millimetres in every format, so the formats hold the same values.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        depth: str = "compressedDepth",
        color: str = "jpeg",
        quality: int = 90,
    ) -> None:
        """Prepare a bag.

        Args:
            path: folder to create; it must not exist.
            depth: one of `DEPTH_FORMATS`.
            color: "jpeg" (smaller) or "raw".
            quality: of the JPEG, 1..100.

        Raises:
            ValueError: for unknown formats.
        """
        if depth not in DEPTH_FORMATS or color not in ("jpeg", "raw"):
            raise ValueError(
                f"expected depth in {DEPTH_FORMATS}, colour jpeg or raw: {depth} {color}"
            )
        self._depth, self._color, self._quality = depth, color, quality
        self._file = Path(path) / f"{Path(path).name}.mcap"
        self._writer = Writer(Path(path), version=9, storage_plugin=StoragePlugin.MCAP)
        if depth != "compressedDepth" or color == "raw":
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._connections: dict[str, Any] = {}

    def __enter__(self) -> Self:
        """Create the folder."""
        self._writer.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the bag."""
        self._writer.close()
        write_checksums(self._file)

    def write(self, frame: RgbdFrame) -> None:
        """Append one frame: colour, depth and camera_info with the same stamp."""
        header = header_message(frame.stamp)
        self.append(INFO_TOPIC, frame.stamp, info_message(header, frame.camera))
        topic, message = color_message(header, frame.color, self._color, self._quality)
        self.append(topic, frame.stamp, message)
        topic, message = depth_message(header, frame.depth, self._depth)
        self.append(topic, frame.stamp, message)

    def append(self, topic: str, stamp: int, message: Any) -> None:
        """Append any message of the ROS 2 Jazzy type store."""
        kind = message.__msgtype__
        self.append_raw(BagMessage(topic, kind, stamp, bytes(STORE.serialize_cdr(message, kind))))

    def append_raw(self, message: BagMessage) -> None:
        """Append a message as it was read from another bag."""
        if message.topic not in self._connections:
            self._connections[message.topic] = self._writer.add_connection(
                message.topic, message.type, typestore=STORE, offered_qos_profiles=[_QOS]
            )
        self._writer.write(self._connections[message.topic], message.received, message.data)


def transcode(source: Path | str, destination: Path | str, depth: str) -> None:
    """Copy a bag with its depth images stored in another format, everything else as it is.

    Raises:
        ValueError: if the source cannot be read or the format is unknown.
    """
    topics = image_topics(source)
    with BagWriter(destination, depth=depth) as writer:
        for message in read_messages(source):
            if message.topic != topics.depth:
                writer.append_raw(message)
                continue
            decoded = message.decoded()
            topic, image = depth_message(decoded.header, depth_from(decoded), depth)
            writer.append(topic, message.received, image)
