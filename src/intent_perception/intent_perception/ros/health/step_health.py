"""How a node's steps go: what diagnostics say of them."""

import time
from collections import deque

OK, WARN, ERROR = 0, 1, 2
"""Levels of diagnostic_msgs/DiagnosticStatus."""
_BROKEN = 3
"""So many inputs left out one after the other are an error, fewer a warning."""
_SECONDS, _FRAMES_PER_SECOND = 10, 30.0
"""CPU time is judged over so many seconds, at this rate of the camera."""


class StepHealth:
    """Counts and times steps, and remembers which of them failed."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=300)
        self._cpu: deque[tuple[float, float]] = deque(maxlen=_SECONDS + 1)
        self._count = self._reported = 0
        self._bad = self._bad_reported = self._bad_in_a_row = 0
        self._last = ""
        self._told = ""

    def note_step(self, seconds: float, failed: bool) -> None:
        """Take note of a step that took so long [s]."""
        self._seconds.append(seconds)
        self._count += 1
        if not failed:
            self._bad_in_a_row = 0

    def note_failure(self, reason: str) -> bool:
        """Take note of an input that was left out; return whether the reason is a new one."""
        self._bad += 1
        self._bad_in_a_row += 1
        self._last = reason
        new, self._told = reason != self._told, reason
        return new

    def forget(self) -> None:
        """Say the next reason again, as after a reset."""
        self._told, self._bad_in_a_row = "", 0

    def report(self) -> tuple[int, str, dict[str, object]]:
        """Return level, message and values of the time since the last report."""
        rate, self._reported = self._count - self._reported, self._count
        failed, self._bad_reported = self._bad - self._bad_reported, self._bad
        ordered = sorted(self._seconds) or [0.0]
        values: dict[str, object] = {
            "rate [Hz]": rate,
            "step median [ms]": round(1e3 * ordered[len(ordered) // 2], 2),
            "step p95 [ms]": round(1e3 * ordered[int(0.95 * (len(ordered) - 1))], 2),
            "steps": self._count,
            "inputs left out": self._bad,
            "last warning": self._last,
        }
        if self._bad_in_a_row >= _BROKEN:
            text = f"the last {self._bad_in_a_row} inputs were left out: {self._last}"
            return ERROR, text, values
        if failed or self._bad_in_a_row:
            return WARN, f"{max(failed, self._bad_in_a_row)} inputs left out: {self._last}", values
        return OK, "ok", values

    def cpu_per_frame(self) -> float:
        """Return the CPU time of the last ten seconds for each frame of 30 Hz [ms]."""
        self._cpu.append((time.monotonic(), time.process_time()))
        (start, before), (end, after) = self._cpu[0], self._cpu[-1]
        return 1e3 * (after - before) / ((end - start) * _FRAMES_PER_SECOND) if end > start else 0.0
