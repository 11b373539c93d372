"""Which of many hypotheses stand together: each must explain pixels that no better one explains.

Hypotheses are taken one by one, always the one that newly explains most, weighted with its quality;
then each is put up again for choice with the others fixed, until nothing changes.
"""

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
    usable = (quality >= least_quality) & (match >= least_pixels)
    weight = np.where(usable, quality**_QUALITY_POWER * evidence.factors, 0.0)
    chosen: list[int] = []
    # What a hypothesis adds to nothing bounds what it adds to anything: the best need few looks.
    alone, against = gains(evidence.values, evidence.windows, np.zeros(shape, np.float32))
    bound = (alone - against) * weight
    order = np.argsort(-bound, kind="stable")
    order = order[bound[order] > 0.0]

    def best() -> int | None:
        if len(chosen) >= _MOST:
            return None
        explained = explained_by(
            evidence.values, evidence.windows, np.array(chosen, np.int64), shape
        )
        enough = np.maximum(np.float32(least_pixels), np.float32(least_new) * match)
        winner = int(
            strongest(
                evidence.values, evidence.windows, explained, order, bound, against, weight, enough
            )
        )
        return winner if winner >= 0 else None

    while (winner := best()) is not None:
        chosen.append(winner)
    for _ in range(_ROUNDS if len(chosen) <= _FEW else 1):
        before = sorted(chosen)
        for old in before:
            chosen.remove(old)
            while (winner := best()) is not None:
                chosen.append(winner)
        if sorted(chosen) == before:
            break
    return np.array(chosen, np.int64)


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


@kernel
def strongest(
    values: Floats,
    windows: NDArray[np.int64],
    explained: Floats,
    order: NDArray[np.int64],
    bound: Floats,
    against: Floats,
    weight: Floats,
    enough: Floats,
) -> int:
    """Return the hypothesis that adds most to what is explained, weighted; -1 where none does.

    Args:
        values: see `PixelEvidence`.
        windows: the same.
        explained: (H, W) best evidence so far.
        order: (K,) hypotheses by what they add to nothing, most first.
        bound: (N,) that, weighted.
        against: (N,) evidence against each.
        weight: (N,) of each.
        enough: (N,) evidence that each must add at least.
    """
    winner = -1
    most = np.float32(0.0)
    for k in order:
        if bound[k] * np.float32(1.001) < most:
            break
        left, top, width, height, start = windows[k]
        new = np.float32(0.0)
        for j in range(height):
            for i in range(width):
                value = values[start + j * width + i]
                if value > 0.0 and value > explained[top + j, left + i]:
                    new += value - explained[top + j, left + i]
        if new < enough[k]:
            continue
        worth = (new - against[k]) * weight[k]
        if worth > most or (worth == most and winner >= 0 and k < winner):
            most = worth
            winner = k
    return winner
