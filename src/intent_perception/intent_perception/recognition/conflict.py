"""Which of many hypotheses stand together: each must explain pixels that no better one explains.

Hypotheses are taken one by one, always the one that newly explains most, weighted with its quality;
then each is put up again for choice with the others fixed, until nothing changes.
"""

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import kernel
from intent_perception.recognition.verification.explanation import DISAGREE, FRONT, MATCH

_MOST = 16
"""Most objects in a scene: what bounds the work where a person or a room is taken for objects."""
_QUALITY_POWER = 3.0
_ROUNDS, _FEW = 3, 8
"""How often every choice is reconsidered, where there are not more than so many."""


@dataclass(frozen=True, eq=False)
class PixelEvidence:
    """What each of N hypotheses says about each pixel of its window."""

    values: Floats
    """All windows one after the other, row by row; see `explain`."""
    windows: NDArray[np.int64]
    """(N, 5) left, top, width, height, first index in values."""
    counts: Floats
    """(N, COUNTS) of `explain`."""
    factors: Floats
    """(N,) by which else the hypotheses are weighted: contour, table."""

    def joined(self, other: "PixelEvidence") -> "PixelEvidence":
        """Return the evidence of these hypotheses and of others, in this order."""
        windows = other.windows.copy()
        windows[:, 4] += len(self.values)
        return PixelEvidence(
            np.concatenate([self.values, other.values]),
            np.concatenate([self.windows, windows]),
            np.concatenate([self.counts, other.counts]),
            np.concatenate([self.factors, other.factors]),
        )


def quality_of(counts: Floats) -> Floats:
    """Return which share of what can be judged speaks for each hypothesis, 0..1.

    Args:
        counts: (N, COUNTS) of `explain`.
    """
    judged = counts[:, MATCH] + counts[:, DISAGREE] + counts[:, FRONT]
    quality: Floats = counts[:, MATCH] / np.maximum(judged, 1.0)
    return quality


def select(
    evidence: PixelEvidence,
    shape: tuple[int, int],
    least_pixels: float,
    least_quality: float,
    least_new: float,
) -> NDArray[np.int64]:
    """Return the indices (K,) of the hypotheses that remain when conflicts are removed.

    Args:
        evidence: of all hypotheses.
        shape: (H, W) of the image.
        least_pixels: new pixels a hypothesis must explain.
        least_quality: see `quality_of`.
        least_new: share of its matching pixels that must be new.
    """
    quality = quality_of(evidence.counts)
    match = evidence.counts[:, MATCH]
    usable = np.flatnonzero((quality >= least_quality) & (match >= least_pixels))
    weight = quality[usable] ** _QUALITY_POWER * evidence.factors[usable]
    least = np.maximum(least_pixels, least_new * match[usable])
    race = _Race(evidence.values, evidence.windows[usable], weight, least, shape)
    chosen: list[int] = []
    race.fill(chosen)
    for _ in range(_ROUNDS if len(chosen) <= _FEW else 1):
        before = sorted(chosen)
        for old in before:
            chosen.remove(old)
            race.reopen(old)
            race.fill(chosen)
        if sorted(chosen) == before:
            break
    return usable[np.array(chosen, np.int64)]


class _Race:
    """Hypotheses that are added one by one, always the one that is worth most.

    What a hypothesis is worth only falls while others are added, so its last known worth bounds it:
    only those are judged anew whose bound is the highest.
    """

    def __init__(
        self,
        values: Floats,
        windows: NDArray[np.int64],
        weight: Floats,
        least: Floats,
        shape: tuple[int, int],
    ) -> None:
        self._values, self._windows, self._shape = values, windows, shape
        self._weight, self._least = weight, least
        nothing = np.zeros(shape, np.float32)
        self._alone = np.array([self._worth(k, nothing) for k in range(len(windows))])
        self._bounds = self._alone.copy()

    def _worth(self, k: int, explained: Floats) -> float:
        new, against = gains(self._values, self._windows[k : k + 1], explained)
        return float((new[0] - against[0]) * self._weight[k]) if new[0] >= self._least[k] else 0.0

    def fill(self, chosen: list[int]) -> None:
        """Add to those chosen whatever is worth it."""
        while len(chosen) < _MOST:
            some = np.array(chosen, np.int64)
            explained = explained_by(self._values, self._windows, some, self._shape)
            queue = [(-bound, k) for k, bound in enumerate(self._bounds) if bound > 0.0]
            heapq.heapify(queue)
            judged: set[int] = set()
            while queue and queue[0][1] not in judged:
                k = queue[0][1]
                self._bounds[k] = self._worth(k, explained)
                judged.add(k)
                heapq.heapreplace(queue, (-float(self._bounds[k]), k))
            if not queue or queue[0][0] >= 0.0:
                return
            chosen.append(queue[0][1])

    def reopen(self, k: int) -> None:
        """Let those be worth more again that were held down by a hypothesis that is taken out."""
        left, top, width, height, _ = self._windows.T
        across = (left < left[k] + width[k]) & (left[k] < left + width)
        along = (top < top[k] + height[k]) & (top[k] < top + height)
        self._bounds = np.where(across & along, self._alone, self._bounds)


@kernel
def explained_by(
    values: Floats, windows: NDArray[np.int64], chosen: NDArray[np.int64], shape: tuple[int, int]
) -> Floats:
    """Return the best evidence (H, W) that the chosen hypotheses give for each pixel, 0 = none."""
    explained = np.zeros(shape, np.float32)
    for k in chosen:
        left, top, width, height, start = windows[k]
        for j in range(height):
            for i in range(width):
                value = values[start + j * width + i]
                if value > explained[top + j, left + i]:
                    explained[top + j, left + i] = value
    return explained


@kernel
def gains(values: Floats, windows: NDArray[np.int64], explained: Floats) -> tuple[Floats, Floats]:
    """Return for each hypothesis the evidence it adds to what is explained, and that against it."""
    count = len(windows)
    new = np.zeros(count, np.float32)
    against = np.zeros(count, np.float32)
    for k in range(count):
        left, top, width, height, start = windows[k]
        for j in range(height):
            for i in range(width):
                value = values[start + j * width + i]
                if value < 0.0:
                    against[k] -= value
                elif value > explained[top + j, left + i]:
                    new[k] += value - explained[top + j, left + i]
    return new, against
