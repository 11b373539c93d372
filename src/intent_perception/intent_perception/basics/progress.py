"""How far a long command has come: a bar on a terminal, now and then a line elsewhere."""

import sys
import time
from collections.abc import Iterable, Iterator, Sized
from typing import Self, TextIO

_WIDTH = 24
_EVERY = 10.0
"""Where no terminal is, a line is written after so many seconds, and at the end [s]."""
_REFRESH = 0.1
"""A bar is drawn anew at most so often [s]."""


class ProgressBar:
    """Says on standard error how much of something is done; use it in a `with` statement."""

    def __init__(self, what: str, total: int, stream: TextIO | None = None) -> None:
        """Begin.

        Args:
            what: is done, e.g. "frame" in "frame 31 of 84".
            total: how many there are.
            stream: where it is said; default: standard error.
        """
        self._what, self._total = what, total
        self._stream = sys.stderr if stream is None else stream
        self._bar = self._stream.isatty()
        self._start = time.monotonic()
        self._said, self._note, self._done = self._start - (_REFRESH if self._bar else 0.0), "", 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if self._bar:
            self._stream.write("\r" + self._line() + "\n")
        elif kind is None:
            self._stream.write(self._line() + "\n")
        self._stream.flush()

    def advance(self, note: str = "") -> None:
        """One more is done."""
        self.at(self._done + 1, note)

    def at(self, done: int, note: str = "") -> None:
        """So many are done.

        Args:
            done: of the total.
            note: what is going on, e.g. "tracking".
        """
        self._done, self._note = done, note or self._note
        now = time.monotonic()
        if now - self._said < (_REFRESH if self._bar else _EVERY):
            return
        self._said = now
        self._stream.write("\r" + self._line() if self._bar else self._line() + "\n")
        self._stream.flush()

    def _line(self) -> str:
        share = min(self._done / self._total, 1.0) if self._total else 1.0
        bar = "[" + "#" * round(share * _WIDTH) + "." * (_WIDTH - round(share * _WIDTH)) + "] "
        text = f"{self._what} {self._done} of {self._total}"
        text += f", {self._note}" if self._note else ""
        text += f", {time.monotonic() - self._start:.0f} s"
        return (bar if self._bar else "") + (text.ljust(48) if self._bar else text)


def counted[T](what: str, items: Iterable[T], total: int | None = None) -> Iterator[T]:
    """Yield the items, and say how many have been dealt with.

    Args:
        what: an item is.
        items: with a length, unless the total is given.
        total: how many there are.
    """
    if total is None:
        if not isinstance(items, Sized):
            raise TypeError("expected items with a length, or their number")
        total = len(items)
    with ProgressBar(what, total) as progress:
        for item in items:
            yield item
            progress.advance()
