"""Which messages are news: not what a latched topic repeats, nor what the same message says twice.

A latched topic hands its last messages to every late joiner. Of results that describe how things
are (objects, cameras) that is what a restarted node needs; of results that say that something has
happened (a grasp, a conclusion) it would be answered a second time.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

_NANO = 1e-9
_TICKS = os.sysconf("SC_CLK_TCK")
_KEPT = 100


def process_age() -> float:
    """Return how long ago this process was started [s]."""
    fields = Path("/proc/self/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return time.clock_gettime(time.CLOCK_BOOTTIME) - int(fields[19]) / _TICKS


class LiveMessages:
    """Tells news on a topic from history, by when each message was sent.

    A message is news if it was sent after this process was started, and if it has not been here
    before: a publisher that was out of sight for a while is found again together with its history.
    Times of sending are of the sender's clock; a sender without one always brings news.
    """

    def __init__(
        self, age: Callable[[], float] = process_age, now: Callable[[], int] = time.time_ns
    ) -> None:
        """Begin.

        Args:
            age: how long ago the listener was started [s].
            now: the wall clock [ns].
        """
        self._age, self._now = age, now
        self._sent: deque[int] = deque(maxlen=_KEPT)

    def is_news(self, info: Mapping[str, Any]) -> bool:
        """Return whether a message is news; `info` is what rclpy knows of its way here."""
        sent = int(info.get("source_timestamp", 0))
        if sent <= 0:
            return True
        if sent in self._sent or (self._now() - sent) * _NANO > self._age():
            return False
        self._sent.append(sent)
        return True
