"""Sensor messages to RGB-D frames: fields to arrays; colour, depth and camera_info to one frame.

Works on the messages of ROS and on those that a bag reader returns: both have the same fields, so
nodes and offline commands share every decision about which images belong together.
"""

from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import (
    ColorImage,
    DepthImage,
    RgbdFrame,
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
    require_metres,
)
from intent_perception.geometry.lens import camera_from, lens_from

NANOSECONDS = 1_000_000_000
_SETTLED = 90
"""Images after which a clock that went back is taken for the only one: about 1.5 s of a camera."""


def stamp_of(message: Any) -> int:
    """Return the time [ns] in the header of a message, or of the header itself.

    Raises:
        ValueError: if it is none.
    """
    stamp = getattr(message, "header", message).stamp
    if stamp.sec < 0 or stamp.nanosec >= NANOSECONDS:
        raise ValueError(f"expected a time from 1970 on, got {stamp.sec} s {stamp.nanosec} ns")
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def color_from(message: Any) -> ColorImage:
    """Return RGB (H, W, 3) from a sensor_msgs/Image or CompressedImage.

    Raises:
        ValueError: for unknown encodings and damaged data.
    """
    if hasattr(message, "format"):
        return decode_compressed_color(message.data)
    return decode_color(*_fields(message))


def depth_from(message: Any, scale: float = 0.0) -> DepthImage:
    """Return depth (H, W) [m] from a sensor_msgs/Image or a CompressedImage.

    Args:
        message: raw, compressedDepth, or a 16-bit PNG.
        scale: metres in one unit of the stored numbers; 0 = millimetres for integers, else metres.

    Raises:
        ValueError: for unknown encodings and damaged data.
    """
    if hasattr(message, "format"):
        whole = "32FC1" not in message.format
        depth = decode_compressed_depth(message.data, message.format)
    else:
        whole = message.encoding != "32FC1"
        depth = decode_depth(*_fields(message))
    return depth if scale <= 0.0 else depth * np.float32(scale * (1000.0 if whole else 1.0))


def _fields(message: Any) -> tuple[str, int, int, int, bool, Any]:
    return (
        message.encoding,
        message.height,
        message.width,
        message.step,
        bool(message.is_bigendian),
        message.data,
    )


@dataclass(frozen=True)
class SynchroniserConfig(Checked):
    """Which images belong together."""

    tolerance: float = 0.015
    """Largest difference of the stamps of colour and depth [s], 0..0.1; below half a frame period
    at most one colour image fits."""
    jump: float = 0.5
    """A stamp this much older than the newest means that the clock went back (a bag started over)
    and everything waiting is forgotten [s], 0.1..10."""
    queue: int = 10
    """Images of each kind that wait for their partner, 1..100."""


@dataclass(frozen=True)
class ImageConfig(Checked):
    """What the numbers in the images mean."""

    depth_scale: float = 0.0
    """Length of one unit of depth [m], for instance 0.001, 0.00025 or 0.0001; 0: integers are
    millimetres, other numbers metres; 0..1."""
    rectified: Literal["auto", "both", "color", "depth", "neither"] = "auto"
    """In which images the lens's distortion has been undone: auto says those whose topic has rect
    in its name."""

    def straight(self, topic: str, kind: Literal["color", "depth"]) -> bool:
        """Return whether the images of a topic, of colour or depth, are rectified."""
        if self.rectified == "auto":
            return "rect" in topic.lower()
        return self.rectified in ("both", kind)


@dataclass(frozen=True)
class Straight:
    """Which images are rectified already."""

    color: bool = True
    depth: bool = True


@dataclass(frozen=True, eq=False)
class FrameMessages:
    """The messages of one frame; decoding them costs more than everything before it."""

    stamp: int
    """Of the depth image [ns]."""
    color: Any
    depth: Any
    info: Any
    depth_scale: float = 0.0
    """See `ImageConfig`."""
    straight: Straight = Straight()

    def decoded(self) -> RgbdFrame:
        """Return the frame, rectified.

        Raises:
            ValueError: if it cannot be decoded, or its depth is in another unit.
        """
        color = color_from(self.color)
        depth = require_metres(depth_from(self.depth, self.depth_scale))
        if self.straight.color and self.straight.depth:
            return RgbdFrame(self.stamp, color, depth, camera_from(self.info))
        lens = lens_from(self.info)
        if not self.straight.color:
            color = lens.rectified(color, nearest=False)
        if not self.straight.depth:
            depth = lens.rectified(depth, nearest=True)
        return RgbdFrame(self.stamp, color, depth, lens.camera)


class FrameSynchroniser:
    """Gathers colour, depth and camera_info messages into frames, in order of the depth stamps.

    A stamp far older than the newest means that the clock went back, and everything begins anew.
    Where the stamps leap to where they were before that, soon after, there are two senders: then
    the older ones are left out, for as long as newer ones come.
    """

    def __init__(
        self,
        config: SynchroniserConfig,
        depth_scale: float = 0.0,
        straight: Straight = Straight(),
    ) -> None:
        """Begin.

        Args:
            config: which images belong together.
            depth_scale: see `ImageConfig`.
            straight: which images are rectified.
        """
        self._depth_scale, self._straight = depth_scale, straight
        self._tolerance = int(config.tolerance * NANOSECONDS)
        self._jump = int(config.jump * NANOSECONDS)
        self._queue = config.queue
        self.dropped = 0
        """Images that found no partner or came out of order."""
        self.jumps = 0
        """How often the clock went back."""
        self.repeated = 0
        """Depth images with the stamp of the one before."""
        self.foreign = 0
        """Messages left out as another sender's."""
        self._left = 0
        """Stamp to which they had come when the clock last went back [ns]."""
        self._since_jump, self._in_a_row = _SETTLED, 0
        self.two_senders = False
        self.reset()

    def reset(self) -> None:
        """Forget everything that waits, the camera included."""
        self._color: deque[tuple[int, Any]] = deque()
        self._depth: deque[tuple[int, Any]] = deque()
        self._info: Any = None
        self._newest = -1
        self._emitted = -1
        self._seen: set[str] = set()

    @property
    def waiting(self) -> int:
        """Images that still wait for their partner."""
        return len(self._color) + len(self._depth)

    @property
    def missing(self) -> tuple[str, ...]:
        """Inputs of which nothing has arrived since the last reset."""
        return tuple(n for n in ("colour", "depth", "camera_info") if n not in self._seen)

    def add_info(self, message: Any) -> FrameMessages | None:
        """Take a camera_info; return the frame that waited for it, if any (see `add_depth`)."""
        if self._info is not None and self.two_senders and self._is_old(stamp_of(message)):
            self.foreign += 1
            return None
        self._info = message
        self._seen.add("camera_info")
        return self._match()

    def add_color(self, message: Any) -> FrameMessages | None:
        """Take a colour image; return the frame it completes, if any (see `add_depth`)."""
        return self._add("colour", message)

    def add_depth(self, message: Any) -> FrameMessages | None:
        """Take a depth image; return the frame it completes, if any."""
        return self._add("depth", message)

    def _add(self, kind: str, message: Any) -> FrameMessages | None:
        stamp = stamp_of(message)
        if not self._is_welcome(stamp):
            return None
        self._seen.add(kind)
        self._newest = max(self._newest, stamp)
        if stamp <= self._emitted and kind == "depth":
            self.dropped += 1
            self.repeated += stamp == self._emitted
            return None
        queue = self._depth if kind == "depth" else self._color
        queue.append((stamp, message))
        if len(queue) > self._queue:
            queue.popleft()
            self.dropped += 1
        return self._match()

    def _is_old(self, stamp: int) -> bool:
        return stamp < self._newest - self._jump

    def _is_welcome(self, stamp: int) -> bool:
        """Follow the clock; False for an image of another sender, which is left out."""
        if self._is_old(stamp):
            self._in_a_row += 1
            if self.two_senders and self._in_a_row <= _SETTLED:
                self._since_jump = 0
                self.foreign += 1
                return False
            self._go_back()
            return True
        self._in_a_row = 0
        self._since_jump += 1
        leaps = self._newest >= 0 and stamp > self._newest + self._jump
        if self._since_jump > _SETTLED:
            self.two_senders = False
        elif leaps and stamp > self._left - self._jump:
            self.two_senders = True
        return True

    def _go_back(self) -> None:
        """Begin anew with an older clock."""
        info, self._left = self._info, self._newest
        self.dropped += self.waiting
        self.reset()
        self.jumps += 1
        self._since_jump, self._in_a_row, self.two_senders = 0, 0, False
        self._info = info  # a latched camera_info is not sent again
        self._seen |= {"camera_info"} if info is not None else set()

    def _match(self) -> FrameMessages | None:
        if self._info is None:
            return None
        for depth_index, (stamp, depth) in enumerate(self._depth):
            for color_index, (color_stamp, color) in enumerate(self._color):
                if abs(color_stamp - stamp) <= self._tolerance:
                    self._forget(self._depth, depth_index)
                    self._forget(self._color, color_index)
                    self._emitted = stamp
                    return FrameMessages(
                        stamp, color, depth, self._info, self._depth_scale, self._straight
                    )
        return None

    def _forget(self, queue: deque[tuple[int, Any]], index: int) -> None:
        """Remove the matched image and, counted as dropped, the older ones before it."""
        for _ in range(index + 1):
            queue.popleft()
        self.dropped += index
