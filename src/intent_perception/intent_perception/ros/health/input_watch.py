"""Who feeds a node: what is missing, has gone or stands still is said once."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.node import Node

_PATIENCE = 5.0
"""Time after which diagnostics name a topic that nobody publishes [s]."""
_STARTING = 30.0
"""Time after which a warning does: until then the other nodes may still be loading [s]."""


@dataclass
class _Feed:
    """One topic."""

    publishers: int = 0
    since: float = 0.0
    """When the number of publishers became zero [s]."""
    seen: bool = False
    """Whether somebody has ever published it."""
    told: bool = False


class InputWatch:
    """Looks once a second whether every topic that a node needs has a publisher."""

    def __init__(self, node: Node, now: Callable[[], float] = time.monotonic) -> None:
        """Begin with no topic.

        Args:
            node: whose inputs are watched.
            now: a clock that goes on whatever /clock says [s].
        """
        self._node, self._now = node, now
        self._feeds: dict[str, _Feed] = {}
        self._start, self._clock_told = now(), False

    def add(self, topic: str) -> None:
        """Watch a topic, by its full name."""
        self._feeds[topic] = _Feed(since=self._now())

    def waiting(self) -> str:
        """Return what is missing, "" if nothing; log what has changed."""
        missing = [text for topic, feed in self._feeds.items() if (text := self._look(topic, feed))]
        clock = self._clock()
        return "; ".join([clock, *missing] if clock else missing)

    def _look(self, topic: str, feed: _Feed) -> str:
        logger, now = self._node.get_logger(), self._now()
        before, feed.publishers = feed.publishers, self._node.count_publishers(topic)
        if feed.publishers:
            if feed.told:
                logger.info(f"{topic} is published")
            feed.seen, feed.told = True, False
            return ""
        if before:
            feed.since, feed.told = now, True
            logger.warning(f"the publisher of {topic} has gone")
        if not feed.told and now - feed.since > _STARTING:
            feed.told = True
            logger.warning(
                f"nobody publishes {topic}: is its node running, in this namespace and domain?"
            )
        if feed.seen:
            return f"the publisher of {topic} has gone"
        return f"nobody publishes {topic}" if now - feed.since > _PATIENCE else ""

    def _clock(self) -> str:
        """Return that simulated time stands still, if it does."""
        simulated = self._node.get_parameter("use_sim_time").value
        if not simulated or self._node.get_clock().now().nanoseconds > 0:
            return ""
        if self._now() - self._start < _PATIENCE:
            return ""
        text = "use_sim_time is set and nothing comes on /clock: play the bag with --clock"
        if not self._clock_told:
            self._clock_told = True
            self._node.get_logger().warning(text)
        return text
