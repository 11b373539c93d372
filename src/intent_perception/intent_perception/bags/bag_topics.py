"""Which topics of a bag make RGB-D frames, and the options by which a user says so.

Depth is known by what its messages hold, not by its name; of several, the one that is aligned to
the colour image comes first, and colour, depth and camera_info are of one camera.
"""

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from intent_perception.bags.frame_assembly import ImageConfig

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
INFO = "sensor_msgs/msg/CameraInfo"
COLOR_TOPIC = "/rgb/image_rect_color"
DEPTH_TOPIC = "/depth_registered/image_rect"
INFO_TOPIC = "/rgb/camera_info"

_DEPTH_ENCODINGS = ("16UC1", "mono16", "32FC1")
_NO_IMAGE = (
    "infra", "/ir", "_ir", "debug", "overlay", "annotat", "mask", "segment", "confidence",
    "disparity", "heatmap", "thermal", "theora", "ffmpeg", "amplitude",
)  # fmt: skip
"""What in a topic's name says that it is neither the colour nor the depth image."""
_ALIGNED = ("aligned", "depth_to_rgb", "depth_to_color", "registered", "rect")
"""What in a topic's name says that depth is in the colour image's plane, best first."""
_TRANSPORTS = ("/compressed", "/compressedDepth")
_PNG, _BITS = b"\x89PNG\r\n\x1a\n", 24
"""Beginning of a PNG, and where it says how many bits a channel has."""


@dataclass(frozen=True)
class ImageTopics:
    """The three topics of a bag that make RGB-D frames."""

    color: str
    depth: str
    info: str


@dataclass(frozen=True)
class BagInput:
    """What a user says of a bag's images."""

    topics: tuple[str, ...] = ()
    """Those of colour, depth and camera_info; empty: they are found."""
    images: ImageConfig = field(default_factory=ImageConfig)


def add_image_options(parser: argparse.ArgumentParser) -> None:
    """Add --topics and --depth-scale to a command that reads a bag."""
    names = ("COLOR", "DEPTH", "INFO")
    parser.add_argument(
        "--topics", nargs=3, metavar=names, default=[], help="of the bag; default: they are found"
    )
    parser.add_argument(
        "--depth-scale", type=float, default=0.0, help="length of one unit of depth in metres"
    )


def bag_input(options: argparse.Namespace) -> BagInput:
    """Return what the options of `add_image_options` say.

    Raises:
        ValueError: if the scale is out of range.
    """
    return BagInput(tuple(options.topics), ImageConfig(depth_scale=options.depth_scale))


def holds_depth(topic: str, kind: str, first: Any) -> bool:
    """Return whether a topic carries depth, by its first message."""
    if kind == IMAGE:
        return first.encoding in _DEPTH_ENCODINGS
    if topic.endswith("/compressedDepth") or "compressedDepth" in first.format:
        return True
    if any(encoding in first.format for encoding in ("16UC1", "32FC1")):
        return True
    head = bytes(first.data[: _BITS + 1])
    return head.startswith(_PNG) and head[_BITS] == 16


def chosen_topics(
    path: object, types: Mapping[str, str], depth: Iterable[str], named: Sequence[str]
) -> ImageTopics:
    """Return the topics of one camera's colour, depth and camera_info.

    Args:
        path: of the bag, for messages.
        types: of all its topics that hold messages.
        depth: which of them hold depth.
        named: those that the user has named; empty: they are found.

    Raises:
        ValueError: if one is missing, or several would do as well, with the choices.
    """
    if named:
        return _named(path, types, named)
    images = [topic for topic, kind in types.items() if kind in (IMAGE, COMPRESSED)]
    images = [topic for topic in images if not any(word in topic.lower() for word in _NO_IMAGE)]
    deep = _one_transport([topic for topic in images if topic in set(depth)], types)
    flat = [t for t in images if t not in set(depth) and "depth" not in _base(t).lower()]
    color = _one_transport(flat, types)
    if not deep or not color:
        raise ValueError(
            f"bag {path} needs a colour image, a depth image and camera_info, "
            f"but holds only {', '.join(sorted(types))}"
        )
    pairs = [(_worth(c, d), c, d) for c in color for d in deep]
    best = max(worth for worth, *_ in pairs)
    equal = [(c, d) for worth, c, d in pairs if worth == best]
    if len(equal) > 1:
        listed = "; ".join(f"{c} {d} {_info(types, c, d)}" for c, d in sorted(equal))
        raise ValueError(
            f"bag {path} holds several cameras: choose one by --topics COLOR DEPTH INFO of {listed}"
        )
    ((found, measured),) = equal
    return ImageTopics(found, measured, _info(types, found, measured))


def _named(path: object, types: Mapping[str, str], named: Sequence[str]) -> ImageTopics:
    missing = [topic for topic in named if topic not in types]
    if missing or len(named) != 3:
        raise ValueError(
            f"expected --topics COLOR DEPTH INFO of those in the bag {path} "
            f"({', '.join(sorted(types))}), got {' '.join(missing or named)}"
        )
    for topic, kinds in zip(
        named, ((IMAGE, COMPRESSED), (IMAGE, COMPRESSED), (INFO,)), strict=True
    ):
        if types[topic] not in kinds:
            raise ValueError(f"expected {topic} of type {' or '.join(kinds)}, got {types[topic]}")
    return ImageTopics(*named)


def _base(topic: str) -> str:
    """Return a topic without the suffix of its transport."""
    for suffix in _TRANSPORTS:
        topic = topic.removesuffix(suffix)
    return topic


def _one_transport(topics: Sequence[str], types: Mapping[str, str]) -> list[str]:
    """Return each image once: raw where it is there, compressed otherwise."""
    best: dict[str, str] = {}
    for topic in sorted(topics, key=lambda t: (types[t] != IMAGE, not t.endswith(_TRANSPORTS[1]))):
        best.setdefault(_base(topic), topic)
    return list(best.values())


def _worth(color: str, depth: str) -> tuple[int, ...]:
    """Return how well two topics go together, to be compared in this order."""
    own = (_base(color) == COLOR_TOPIC) + (_base(depth) == DEPTH_TOPIC)
    low = depth.lower()
    ranks = [len(_ALIGNED) - k for k, word in enumerate(_ALIGNED) if word in low]
    named = sum(word in color.lower() for word in ("color", "rgb"))
    return (
        own,
        _shared(color, depth) > 0,
        max(ranks, default=0),
        _shared(color, depth),
        named,
        ("rect" in color.lower()),
    )


def _shared(one: str, other: str) -> int:
    """Return how many parts at their beginning two names have in common."""
    count = 0
    for a, b in zip(one.split("/")[1:-1], other.split("/")[1:-1], strict=False):
        if a != b:
            break
        count += 1
    return count


def _info(types: Mapping[str, str], color: str, depth: str) -> str:
    """Return the camera_info of an image: beside it, else that of the depth, else the nearest."""
    infos = [topic for topic, kind in types.items() if kind == INFO]
    beside = [f"{_base(image).rsplit('/', 1)[0]}/camera_info" for image in (color, depth)]
    ranked = sorted(
        (t for t in infos if not any(word in t.lower() for word in _NO_IMAGE)),
        key=lambda t: (t != beside[0], t != beside[1], t != INFO_TOPIC, -_shared(t, color), t),
    )
    return ranked[0] if ranked else ""
