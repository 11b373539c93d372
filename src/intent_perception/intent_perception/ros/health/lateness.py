"""How late a node takes what was sent to it: frames wait where it is busy."""

import math

_NANOSECONDS = 1e9
_FORGET = 1e-4
"""How much the shortest wait grows with every message [s]: clocks are set anew."""


class Lateness:
    """Measures waits against the shortest one: clocks of two machines differ, but by a constant."""

    def __init__(self) -> None:
        self._least = math.inf
        self.seconds = 0.0
        """How much longer the newest message waited than the one that waited least [s]."""

    def note(self, sent: int, taken: int) -> None:
        """Take note of a message.

        Args:
            sent: when, by the sender's clock [ns]; 0 = the middleware does not say.
            taken: when, by the receiver's [ns].
        """
        if sent:
            wait = (taken - sent) / _NANOSECONDS
            self._least = min(self._least + _FORGET, wait)
            self.seconds = wait - self._least
