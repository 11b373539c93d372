"""What became of a damaged input."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np


class Outcome(StrEnum):
    """All that may happen; those in `BAD` must not."""

    OK = "ok"
    REFUSED = "refused with one sentence"
    LEFT_OUT = "left out and counted"
    UNCLEAR = "REFUSED, BUT NOT IN ONE SENTENCE"
    ALTERED = "SILENTLY ALTERED"
    TRACEBACK = "TRACEBACK"
    HANG = "HANG"
    DEATH = "DEATH"


BAD = (Outcome.UNCLEAR, Outcome.ALTERED, Outcome.TRACEBACK, Outcome.HANG, Outcome.DEATH)


@dataclass(frozen=True)
class Answer:
    """What a reader made of an input."""

    sane: bool
    """The answer is finite and within what the thing can be; undamaged parts are unchanged."""
    left_out: bool = False
    """Something was left out, and it was said."""


@dataclass(frozen=True)
class Subject:
    """One kind of input: how a mutant of it is made in a folder, and what reads it."""

    name: str
    make: Callable[[np.random.Generator, Path], Path]
    use: Callable[[Path], Answer]
