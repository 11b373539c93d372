"""A bag as frames to publish: options of the player, and the messages grouped by frame."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from intent_perception.bags.bag_files import BagMessage, image_topics, read_messages
from intent_perception.bags.bag_topics import (
    COLOR_TOPIC,
    DEPTH_TOPIC,
    INFO_TOPIC,
    BagInput,
    ImageTopics,
    add_image_options,
    bag_input,
)
from intent_perception.bags.frame_assembly import SynchroniserConfig


@dataclass(frozen=True)
class Bundle:
    """The messages of one frame, in the order in which they were recorded."""

    stamp: int
    """Stamp of the depth image [ns]; of the last message where there is none."""
    time: float
    """Time of the recording since its first message [s]."""
    messages: tuple[BagMessage, ...]


def parse_options(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the player's options; their names are those of `ros2 bag play`."""
    parser = argparse.ArgumentParser(
        prog="replay", description="Play a bag's RGB-D images on the topics of the nodes."
    )
    add = parser.add_argument
    add("bag", help="rosbag2 folder")
    add("-r", "--rate", type=float, default=1.0, help="speed, 1 = as recorded")
    add("-l", "--loop", action="store_true", help="start over at the end")
    add("--start-offset", type=float, default=0.0, help="skip the first seconds")
    add("-p", "--start-paused", action="store_true", help="wait for the service ~/resume")
    add("--also", nargs="*", default=[], help="play these too, as they were recorded")
    add("--topics", nargs=3, metavar=("COLOR", "DEPTH", "INFO"), default=[], help="the images")
    add("--clock", type=float, nargs="?", const=40.0, default=0.0, help="publish /clock, in Hz")
    add("--lockstep", action="store_true", help="wait for /intent/scene_state after every frame")
    add("--objects-only", action="store_true", help="with --lockstep: end once objects are known")
    add("--subscribers", type=int, default=1, help="wait for so many subscribers of the depth")
    add("--listeners", type=int, default=0, help="... and of /intent/scene_state, this one counts")
    add("--await", nargs="*", default=[], dest="nodes", help="wait until these nodes are ready")
    add("--wait", type=float, default=30.0, help="longest wait for subscribers and nodes [s]")
    add("--timeout", type=float, default=60.0, help="with --lockstep: longest wait for an answer")
    options = parser.parse_args(arguments)
    if options.rate <= 0.0 or options.start_offset < 0.0:
        parser.error("--rate must be above 0 and --start-offset not negative")
    return options


def target_topic(message: BagMessage, topics: ImageTopics) -> str:
    """Return where a message is played: the nodes' input for images, else where it was recorded."""
    targets = {
        topics.color: (COLOR_TOPIC, "/compressed"),
        topics.depth: (DEPTH_TOPIC, "/compressedDepth"),
        topics.info: (INFO_TOPIC, ""),
    }
    if message.topic not in targets:
        return message.topic
    name, transport = targets[message.topic]
    # Relative, so that a namespace or a remapping of the player moves it.
    return name[1:] + (transport if message.type.endswith("CompressedImage") else "")


def transports(bag: str, named: Sequence[str] = ()) -> tuple[str, str]:
    """Return the nodes' parameters color_transport and depth_transport that fit a bag.

    Args:
        bag: rosbag2 folder.
        named: its topics of colour, depth and camera_info; empty: they are found.

    Raises:
        ValueError: if the bag cannot be read or holds no images.
    """
    topics = image_topics(bag, named)
    kinds: dict[str, str] = {}
    for message in read_messages(bag, (topics.color, topics.depth), lambda _: None):
        kinds.setdefault(message.topic, message.type)
        if len(kinds) == 2:
            break
    compressed = [kinds[t].endswith("CompressedImage") for t in (topics.color, topics.depth)]
    return ("compressed" if compressed[0] else "raw", "compressedDepth" if compressed[1] else "raw")


def bundles(
    bag: str,
    start_offset: float = 0.0,
    extra: Sequence[str] = (),
    on_damage: Callable[[str], None] = lambda _: None,
    named: Sequence[str] = (),
) -> Iterator[Bundle]:
    """Yield the frames of a bag: everything up to and around each depth image that has a partner.

    Args:
        bag: rosbag2 folder.
        start_offset: leave out what was recorded before this time [s].
        extra: topics to play beside the images.
        on_damage: told of messages that cannot be read and are left out.
        named: topics of colour, depth and camera_info; empty: they are found.

    Raises:
        ValueError: if the bag cannot be read or holds no images.
    """
    topics = image_topics(bag, named)
    tolerance = int(SynchroniserConfig().tolerance * 1e9)
    names = [topics.color, topics.depth, *([topics.info] if topics.info else []), *extra]
    waiting: list[BagMessage] = []
    first = None
    for message in read_messages(bag, names, on_damage):
        if message.topic not in extra and not _has_stamp(message):
            on_damage(f"a message on {message.topic} is cut off: left out")
            continue
        first = message.received if first is None else first
        if _time([message], first) < start_offset:
            continue
        complete = None if message.topic in extra else _frame_stamp(waiting, topics, tolerance)
        if complete is not None and message.stamp > complete + tolerance:
            yield Bundle(complete, _time(waiting, first) - start_offset, tuple(waiting))
            waiting = []
        waiting.append(message)
    if waiting:
        last = _frame_stamp(waiting, topics, tolerance)
        stamp = waiting[-1].stamp if last is None else last
        yield Bundle(stamp, _time(waiting, first or 0) - start_offset, tuple(waiting))


def _has_stamp(message: BagMessage) -> bool:
    try:
        return message.stamp >= 0
    except ValueError:
        return False


def _time(messages: list[BagMessage], first: int) -> float:
    return (messages[0].received - first) * 1e-9


def _frame_stamp(messages: list[BagMessage], topics: ImageTopics, tolerance: int) -> int | None:
    """Return the stamp of the depth image that has its colour image, None while there is none."""
    colors = [message.stamp for message in messages if message.topic == topics.color]
    for message in messages:
        if message.topic == topics.depth:
            stamp = message.stamp
            if any(abs(color - stamp) <= tolerance for color in colors):
                return stamp
    return None


def node_arguments(bag: str, given: BagInput) -> str:
    """Return the ROS arguments with which the nodes hear a bag that is played to them.

    Raises:
        ValueError: if the bag cannot be read or holds no images.
    """
    topics = image_topics(bag, given.topics)
    color, depth = transports(bag, given.topics)
    words = [f"-p color_transport:={color} -p depth_transport:={depth}"]
    straight = (
        given.images.straight(topics.color, "color"),
        given.images.straight(topics.depth, "depth"),
    )
    if straight != (True, True):  # the nodes' own topics say "rect"
        name = {(True, False): "color", (False, True): "depth"}.get(straight, "neither")
        words.append(f"-p rectified:={name}")
    if given.images.depth_scale > 0.0:
        words.append(f"-p depth_scale:={given.images.depth_scale!r}")
    return " ".join(words)


def main() -> None:
    """Print the ROS arguments with which the nodes hear a bag."""
    parser = argparse.ArgumentParser(
        description="Print the ROS arguments with which the nodes hear a bag. "
        "`ros2 run intent_perception replay BAG` plays it; see its --help."
    )
    parser.add_argument("bag", help="rosbag2 folder")
    add_image_options(parser)
    options = parser.parse_args()
    try:
        print(node_arguments(options.bag, bag_input(options)))
    except ValueError as error:
        raise SystemExit(f"error: {error}") from None
