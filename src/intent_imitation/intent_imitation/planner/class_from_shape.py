"""What an object of unknown class looks like: soft evidence for `obcl` from its shape alone.

A robot that has practised with mugs sees that a new thing is shaped like one. p(class | shape) is a
soft assignment as in Sec. II-B: a kernel around every practised object in a space of shape
descriptors, and a constant for "none of these". Both widths come from the practised objects.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectModel

_BANDS = 8
"""Horizontal slices of an object."""
_SIZES = 4
"""The first numbers of a descriptor: three sizes and the convexity."""
_WILD = 1e3
"""Descriptors are logarithms and shares."""
_FLOOR = 0.02
"""Added to each descriptor's spread: smaller differences mean nothing."""
_REACH = 0.9
"""Share of the practised objects that must be nearer to one of their class than "none"."""


@dataclass(frozen=True, eq=False)
class Kinds:
    """Shapes and classes of N objects that the robot has practised with."""

    names: tuple[str, ...]
    """(N,) model names."""
    classes: tuple[str, ...]
    """(N,) their classes."""
    shapes: Array
    """(N, D) descriptors, see `shape_of`."""

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.classes) == len(self.shapes):
            raise ValueError("expected one name, class and shape for each object")
        if self.shapes.ndim != 2 or not np.all(np.abs(self.shapes) < _WILD):
            raise ValueError("expected shapes of ordinary numbers, got NaN, infinity or others")

    def only(self, names: Sequence[str]) -> "Kinds":
        """Return what a robot knows that has practised with the named objects only."""
        rows = [row for row, name in enumerate(self.names) if name in names]
        return Kinds(
            tuple(self.names[row] for row in rows),
            tuple(self.classes[row] for row in rows),
            self.shapes[rows],
        )

    def chances(self, shape: Array) -> dict[str, float]:
        """Return p(class | shape); what is missing to 1 is the chance that it is none of them.

        Args:
            shape: (D,) descriptor of an object.
        """
        if len(self.names) < 2:
            return {}
        near = self._kernel(np.linalg.norm((self.shapes - shape) / self._scale, axis=1))
        known = np.array(self.classes)
        likelihood = {name: float(near[known == name].max()) for name in sorted(set(known))}
        total = sum(likelihood.values()) + float(self._kernel(self._widths[1]))
        return {name: value / total for name, value in likelihood.items()}

    def _kernel(self, distance: Array | float) -> Array:
        return np.asarray(np.exp(-0.5 * (np.asarray(distance) / self._widths[0]) ** 2))

    @cached_property
    def _scale(self) -> Array:
        """(D,) spread of the descriptors; the slices together weigh as much as 8 numbers."""
        scale = self.shapes.std(axis=0) + _FLOOR
        scale[_SIZES:] *= np.sqrt(3.0)
        return np.asarray(scale)

    @cached_property
    def _widths(self) -> tuple[float, float]:
        """Width of a kernel and the distance from which on an object is rather none of these."""
        gaps = []
        for row, name in enumerate(self.classes):
            others = [k for k, other in enumerate(self.classes) if other == name and k != row]
            if others:
                away = (self.shapes[others] - self.shapes[row]) / self._scale
                gaps.append(np.linalg.norm(away, axis=1).min())
        if not gaps:
            return 1.0, 2.0
        return max(float(np.median(gaps)), 1e-6), max(float(np.quantile(gaps, _REACH)), 1e-6)


def shape_of(model: ObjectModel, distance: SignedDistance) -> Array:
    """Return the descriptor (D,) of a shape: size, convexity and a profile along its z axis.

    Of each slice: its two horizontal extents as shares of the object's longest edge, and the share
    of that rectangle that is solid. The larger extent comes first, so that a quarter turn about z
    changes nothing.

    Args:
        model: the object; z is up in natural use.
        distance: signed distance of its mesh.
    """
    wide, deep = sorted(model.size[:2], reverse=True)
    convexity = model.convexity if model.mesh.is_watertight else 1.0
    solid = distance.values < 0.0
    levels = np.flatnonzero(solid.any(axis=(0, 1)))
    profile = np.zeros((_BANDS, 3))
    if len(levels) > 0:
        edges = np.linspace(levels[0], levels[-1] + 1, _BANDS + 1)
        for band, (low, high) in enumerate(itertools.pairwise(edges)):
            first = int(low)
            part = solid[:, :, first : max(int(np.ceil(high)), first + 1)]
            profile[band] = _slice(part, distance.spacing)
    profile[:, :2] /= model.size.max()
    sizes = np.log([wide, deep, model.size[2]])
    return np.concatenate([sizes, [convexity], profile.ravel()])


def _slice(solid: NDArray[np.bool_], spacing: float) -> Array:
    """Return the larger and the smaller extent [m] of a slice and how solid it is."""
    columns = np.flatnonzero(solid.any(axis=(1, 2)))
    rows = np.flatnonzero(solid.any(axis=(0, 2)))
    if len(columns) == 0:
        return np.zeros(3)
    extents = spacing * (1.0 + np.array([np.ptp(columns), np.ptp(rows)], dtype=np.float64))
    share = float(solid.sum()) * spacing**2 / (solid.shape[2] * extents.prod())
    return np.array([extents.max(), extents.min(), share])
