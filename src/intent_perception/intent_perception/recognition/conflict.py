"""Which of many hypotheses stand together: each must explain pixels that no better one explains.

Hypotheses are taken one by one, always the one that newly explains most, weighted with its quality;
then each is put up again for choice with the others fixed, until nothing changes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats, Mask
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

    @cached_property
    def contrary(self) -> Floats:
        """(N,) the evidence against each."""
        return np.asarray(against(self.values, self.windows))

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
    usable = (quality >= least_quality) & (match >= least_pixels)
    weight = np.where(usable, quality**_QUALITY_POWER * evidence.factors, 0.0)
    hopeful = np.flatnonzero(weight > 0.0)
    weight, match, windows = weight[hopeful], match[hopeful], evidence.windows[hopeful]
    contrary = evidence.contrary[hopeful]
    chosen: list[int] = []
    new, stale = np.zeros(len(hopeful), np.float32), np.ones(len(hopeful), bool)

    def best() -> int | None:
        if len(chosen) >= _MOST:
            return None
        explained = explained_by(evidence.values, windows, np.array(chosen, np.int64), shape)
        new[stale] = gains(evidence.values, windows[stale], explained)
        stale[:] = False
        worth = (new - contrary) * weight
        worth[(new < least_pixels) | (new < least_new * match)] = 0.0
        winner = int(np.argmax(worth)) if len(worth) else 0
        return winner if len(worth) and worth[winner] > 0.0 else None

    def take_best() -> None:
        while (winner := best()) is not None:
            chosen.append(winner)
            stale[:] |= _meeting(windows, windows[winner])

    take_best()
    for _ in range(_ROUNDS if len(chosen) <= _FEW else 1):
        before = sorted(chosen)
        for old in before:
            chosen.remove(old)
            stale[:] |= _meeting(windows, windows[old])
            take_best()
        if sorted(chosen) == before:
            break
    return hopeful[np.array(chosen, np.int64)]


def _meeting(windows: NDArray[np.int64], one: NDArray[np.int64]) -> Mask:
    """Return which windows (N, 5) have pixels in common with one of them (5,)."""
    low, high = windows[:, :2], windows[:, :2] + windows[:, 2:4]
    return np.asarray(np.all((low < one[:2] + one[2:4]) & (one[:2] < high), axis=1))


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
def gains(values: Floats, windows: NDArray[np.int64], explained: Floats) -> Floats:
    """Return the evidence (N,) that each hypothesis adds to what is explained (H, W)."""
    nothing = np.float32(0.0)
    new = np.zeros(len(windows), np.float32)
    for k in range(len(windows)):
        left, top, width, height, start = windows[k]
        total = nothing
        for j in range(height):
            row = values[start + j * width : start + (j + 1) * width]
            before = explained[top + j, left : left + width]
            for i in range(width):
                total += max(row[i] - before[i], nothing)
        new[k] = total
    return new


@kernel
def against(values: Floats, windows: NDArray[np.int64]) -> Floats:
    """Return the evidence (N,) against each hypothesis."""
    nothing = np.float32(0.0)
    sums = np.zeros(len(windows), np.float32)
    for k in range(len(windows)):
        start = windows[k, 4]
        total = nothing
        for value in values[start : start + windows[k, 2] * windows[k, 3]]:
            total += max(-value, nothing)
        sums[k] = total
    return sums
