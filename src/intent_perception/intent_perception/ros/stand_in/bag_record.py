"""What `ros2 bag record` does: the messages of some topics, byte by byte, as a rosbag2 folder."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from intent_perception.bags.bag_checksums import write_checksums
from intent_perception.basics.checked_files import read_text
from intent_perception.ros.stand_in.interface_text import interface_file, nested_types

_FOREVER = QosTime(2147483647, 4294967295)
_LOOK = 1.0
"""New topics are looked for once in so many seconds."""


class TopicBag:
    """Hears topics and writes what comes to a bag.

    Messages are taken as they came over the wire: those that rclpy serialises itself end with bytes
    of no meaning, which readers of bags refuse.
    """

    def __init__(self, node: Node, folder: Path) -> None:
        """Create the bag.

        Args:
            node: that hears.
            folder: to be created.

        Raises:
            ValueError: if it exists.
        """
        if folder.exists():
            raise ValueError(f"{folder} exists; give another folder by -o")
        self._node, self._folder = node, folder
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        self._heard: set[str] = set()
        self.count = 0
        """Messages written."""

    def close(self) -> None:
        """Finish the bag."""
        self._writer.close()
        write_checksums(self._folder / f"{self._folder.name}.mcap")

    def hear(self, topic: str, message_class: Any, kind: str) -> None:
        """Begin to record a topic; a second time changes nothing."""
        if topic in self._heard:
            return
        self._heard.add(topic)
        self._learn(kind)
        qos = as_offered(self._node.get_publishers_info_by_topic(topic), 1000)
        connection = self._writer.add_connection(
            topic, kind, typestore=self._types, offered_qos_profiles=[_written(qos)]
        )

        def write(data: bytes) -> None:
            self._writer.write(connection, time.time_ns(), bytes(data))
            self.count += 1

        self._node.create_subscription(message_class, topic, write, qos, raw=True)

    def _learn(self, kind: str) -> None:
        """Register a type and those in it that the store does not know."""
        for name in (*nested_types(kind), kind):
            if name not in self._types.fielddefs:
                self._types.register(get_types_from_msg(read_text(interface_file(name)), name))


def as_offered(senders: Sequence[Any], depth: int) -> QoSProfile:
    """Return how to hear a topic as its publishers offer it.

    Args:
        senders: what the node knows of its publishers.
        depth: length of the queue.
    """
    profiles = [sender.qos_profile for sender in senders]
    reliable = all(one.reliability == ReliabilityPolicy.RELIABLE for one in profiles)
    latched = all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in profiles)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _written(qos: QoSProfile) -> Qos:
    """Return it as a bag has it."""
    reliable = qos.reliability == ReliabilityPolicy.RELIABLE
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return Qos(
        QosHistory.KEEP_LAST,
        10,
        QosReliability.RELIABLE if reliable else QosReliability.BEST_EFFORT,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )


def record(
    node: Node, topics: list[str], folder: Path, message_class: Any, seconds: float = 0.0
) -> int:
    """Record until Ctrl-C and return the number of messages.

    Args:
        node: that hears.
        topics: relative or full names; none: all that there are.
        folder: of the bag, to be created.
        message_class: returns the class of a type by its name.
        seconds: end by itself after so long; 0: never [s].
    """
    wanted = {node.resolve_topic_name(topic) for topic in topics}
    bag, start, looked = TopicBag(node, folder), time.monotonic(), -_LOOK
    try:
        while rclpy.ok() and not 0.0 < seconds < time.monotonic() - start:
            if time.monotonic() - looked >= _LOOK:
                looked = time.monotonic()
                for topic, kinds in node.get_topic_names_and_types():
                    if (topic in wanted or not wanted) and node.count_publishers(topic):
                        bag.hear(topic, message_class(kinds[0]), kinds[0])
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        bag.close()
    return bag.count
