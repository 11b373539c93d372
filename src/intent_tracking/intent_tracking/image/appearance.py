"""Colour models of hand, objects and background: learned offline, adapted online (Sec. III-B).

Chromaticity (r, g) and brightness are binned; every class keeps one smoothed histogram that
forgets slowly. The hand starts from a broad skin prior, an object from its database colour.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_tracking.image.pixel_kernels import bin_colors

CHROMA_BINS = 24
BRIGHTNESS_BINS = 4
BINS = CHROMA_BINS * CHROMA_BINS * BRIGHTNESS_BINS
HAND, BACKGROUND, FIRST_OBJECT = 0, 1, 2
_LOW, _HIGH = 0.15, 0.6  # chromaticity range that the bins cover
_SKIN_MEAN, _SKIN_SPREAD = (0.43, 0.315), (0.045, 0.018)
_MEMORY = 0.9  # share of the old histogram that survives one update
_PRIOR_PIXELS = 200.0  # pixels that the offline prior of a class is worth
_FLOOR = 2e-4  # probability that every bin keeps: an unknown colour speaks for nothing


class AppearanceModel:
    """Log-probability of colours for hand, background and each object."""

    def __init__(self, colors: list[Array]) -> None:
        self.blind = False
        """Whether the images are grey, so that colours say nothing."""
        priors = [skin_prior(), np.full(BINS, 1.0 / BINS), *(color_prior(c) for c in colors)]
        self._priors = np.stack(priors) * _PRIOR_PIXELS
        self._counts = np.zeros_like(self._priors)
        self._log = np.zeros(self._priors.shape, np.float32)
        for row in range(len(priors)):
            self._refresh(row)

    def joined(self, colors: list[Array], kept: list[int | None]) -> "AppearanceModel":
        """Return a model of other objects that keeps what is known of hand and background.

        Args:
            colors: (3,) of each of its objects.
            kept: which of these objects each of them is, None = a new one.
        """
        new = AppearanceModel(colors)
        new.blind = self.blind
        rows = [HAND, BACKGROUND, *(None if k is None else FIRST_OBJECT + k for k in kept)]
        for row, before in enumerate(rows):
            if before is not None:
                new._counts[row] = self._counts[before]
                new._refresh(row)
        return new

    def log_probability(self, bins: NDArray[np.int32]) -> Floats:
        """Return (classes, ...) log p(colour | class) of bin numbers (...).

        All are equal where the camera sees no colours.
        """
        return self.log_table[:, bins]

    @property
    def log_table(self) -> Floats:
        """(classes, BINS) log p(colour | class)."""
        return np.zeros_like(self._log) if self.blind else self._log

    def learn(self, row: int, bins: NDArray[np.int32]) -> None:
        """Adapt the histogram of class `row` to the bins (n,) of its pixels."""
        if len(bins) < 20:
            return
        fresh = np.bincount(bins, minlength=BINS).astype(np.float64)
        self._counts[row] = _MEMORY * self._counts[row] + fresh
        self._refresh(row)

    def _refresh(self, row: int) -> None:
        counts = self._priors[row] + _smoothed(self._counts[row])
        probability = (1.0 - _FLOOR * 50.0) * counts / counts.sum() + _FLOOR
        self._log[row] = np.log(probability)


def color_bins(color: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return the bin numbers (...) of RGB values (..., 3)."""
    bins = np.empty(color.shape[:-1], np.int32)
    scale = np.float32(CHROMA_BINS / (_HIGH - _LOW))
    flat = np.ascontiguousarray(color).reshape(-1, 3)
    bin_colors(flat, np.float32(_LOW), scale, CHROMA_BINS, BRIGHTNESS_BINS, bins.ravel())
    return bins


def skin_prior() -> Array:
    """Return the probability (BINS,) of skin colours under usual lamps."""
    centers = _LOW + (np.arange(CHROMA_BINS) + 0.5) * (_HIGH - _LOW) / CHROMA_BINS
    red = np.exp(-0.5 * ((centers - _SKIN_MEAN[0]) / _SKIN_SPREAD[0]) ** 2)
    green = np.exp(-0.5 * ((centers - _SKIN_MEAN[1]) / _SKIN_SPREAD[1]) ** 2)
    light = np.array([0.3, 1.0, 1.0, 0.6])
    joint = red[:, None, None] * green[:, None] * light
    return np.ravel(joint / joint.sum())


def color_prior(color: Array) -> Array:
    """Return the probability (BINS,) of one RGB colour (3,) in 0..1 under varied brightness."""
    shades = np.clip(np.outer(np.linspace(0.35, 1.1, 16), color) * 255.0, 0, 255)
    counts = np.bincount(color_bins(shades.astype(np.uint8)), minlength=BINS)
    smooth = _smoothed(counts.astype(np.float64))
    return np.asarray(smooth / smooth.sum())


def _smoothed(counts: Array) -> Array:
    cube = counts.reshape(CHROMA_BINS, CHROMA_BINS, BRIGHTNESS_BINS)
    return np.ravel(cv2.GaussianBlur(cube, (0, 0), 0.8, borderType=cv2.BORDER_CONSTANT))
