"""Bodies around an axis: sections of one shape, a superellipse, scaled along the axis.

The normals of a surface of revolution all meet its axis, which gives a first axis in closed form.
Gauss-Newton on the distances from the axis refines it; how wide the body is at each height is left
out of the parameters (the residuals are taken within narrow slices), so any outline fits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Mask
from intent_perception.basics.kernels import exact_kernel

Indices = NDArray[np.int64]

_SLICES = 32
_LEAST_SLICE = 0.003  # thinner slices hold too few points [m]
_ROUNDS = 6
_SPREAD = 0.003  # residuals beyond are of other surfaces [m]
_SIDE = 0.85  # sine of the steepest angle between a side's normal and the section
_CLOSE = 0.005  # points so near the surface belong to it [m]
_MOST_UNSEEN = 0.75
"""Largest radius of a body of which enough is seen, as a share of the seen breadth; it is 0.5 where
the whole near side is."""


@dataclass(frozen=True, eq=False)
class Revolution:
    """A body around an axis, in the frame of the points that it was fitted to."""

    point: Array
    """(3,) of the axis at height 0 [m]."""
    axes: Array
    """(3, 3) rows: x and y of the section, direction of the axis."""
    aspect: float
    """Half width along y / half width along x."""
    power: float
    """Of the superellipse: 2 = ellipse, larger = rounded rectangle."""
    heights: Array
    """(K,) along the axis, rising [m]."""
    radii: Array
    """(K,) half width along x [m]."""
    residual: float
    """Median distance of the points from the surface [m]."""
    share: float
    """Share of the points within 5 mm of it."""
    outer: Mask
    """(N,) whether a point is seen from outside, on the side of the body."""
    gaps: Array
    """(N,) how far each point is outside the surface [m]."""

    def places(self, points: Array) -> Array:
        """Return points (N, 3) in the body's own frame."""
        return (points - self.point) @ self.axes.T

    def radius_at(self, heights: Array) -> Array:
        """Return the half widths along x at some heights [m]."""
        return np.interp(heights, self.heights, self.radii)

    def is_told(self, points: Array) -> bool:
        """Return whether points (N, 3) tell how wide it is: a flat side fits any large body."""
        breadth = float(np.ptp(self.places(points)[:, :2], axis=0).max())
        return float(self.radii.max()) * max(1.0, self.aspect) <= _MOST_UNSEEN * breadth


def section_radius(places: Array, aspect: float, power: float) -> Array:
    """Return the half width along x of the superellipse through each place (N, 2+) [m]."""
    x, y = np.abs(places[:, 0]), np.abs(places[:, 1]) / aspect
    if power == 2.0:
        return np.hypot(x, y)
    return np.asarray((x**power + y**power + 1e-30) ** (1.0 / power))


def crossing(places: Array, normals: Array) -> tuple[Array, Array]:
    """Return where lines (N, 2) along normals (N, 2) of the plane nearly meet, and their weights.

    Iteratively reweighted least squares: lines that pass by at more than some millimetres are of
    something else, such as a handle.
    """
    length = np.linalg.norm(normals, axis=1)
    across = np.stack([normals[:, 1], -normals[:, 0]], axis=1)
    offset = np.einsum("ij,ij->i", across, places)
    # Lines of points far from the middle are as exact as near ones: angles err alike.
    weight = length**2
    center = places.mean(axis=0)
    scale = 0.02
    for _ in range(8):
        system = (across * weight[:, None]).T @ across + 1e-6 * np.eye(2)
        center = np.linalg.solve(system, (across * weight[:, None]).T @ offset + 1e-6 * center)
        miss = (across @ center - offset) / np.maximum(length, 0.1)
        scale = max(0.7 * scale, 0.004)
        weight = length**2 / (1.0 + (miss / scale) ** 2)
    return center, weight


def slices_of(heights: Array, low: float, high: float) -> tuple[Indices, int]:
    """Return the slice of each height, and how many slices there are."""
    count = int(np.clip((high - low) / _LEAST_SLICE, 4, _SLICES))
    step = max((high - low) / count, 1e-6)
    return np.clip(((heights - low) / step).astype(np.int64), 0, count - 1), count


@exact_kernel
def slice_medians(values: Array, index: Indices, count: int) -> Array:
    """Return the median of the values in each slice, NaN where there is none."""
    grouped, starts = _grouped(values, index, count)
    medians = np.full(count, np.nan)
    for k in range(count):
        if starts[k + 1] > starts[k]:
            medians[k] = np.median(grouped[starts[k] : starts[k + 1]])
    return medians


@exact_kernel
def slice_quantiles(values: Array, index: Indices, count: int, shares: Array, least: int) -> Array:
    """Return quantiles (count, Q) of the values in each slice, NaN where fewer than `least` are.

    Args:
        values: (N,).
        index: (N,) slice of each.
        count: of slices.
        shares: (Q,) 0..1; between two values it is interpolated.
        least: values that a slice must have.
    """
    grouped, starts = _grouped(values, index, count)
    found = np.full((count, len(shares)), np.nan)
    for k in range(count):
        size = starts[k + 1] - starts[k]
        if size < max(least, 1):
            continue
        ordered = np.sort(grouped[starts[k] : starts[k + 1]])
        for q in range(len(shares)):
            place = shares[q] * (size - 1)
            low = int(place)
            high = min(low + 1, size - 1)
            found[k, q] = ordered[low] + (place - low) * (ordered[high] - ordered[low])
    return found


@exact_kernel
def _grouped(values: Array, index: Indices, count: int) -> tuple[Array, Indices]:
    """Return the values slice after slice (N,), and where each slice begins (count + 1,)."""
    starts = np.zeros(count + 1, np.int64)
    for k in index:
        starts[k + 1] += 1
    starts = np.cumsum(starts)
    free, grouped = starts.copy(), np.empty_like(values)
    for value, k in zip(values, index):  # noqa: B905 - kernels know no `strict`
        grouped[free[k]] = value
        free[k] += 1
    return grouped, starts


@exact_kernel
def _within(values: Array, weight: Array, index: Indices, count: int) -> Array:
    """Return values (N, D) less their weighted mean in each slice."""
    total = np.full(count, 1e-9)
    sums = np.zeros((count, values.shape[1]))
    for i in range(len(values)):
        total[index[i]] += weight[i]
        for k in range(values.shape[1]):
            sums[index[i], k] += weight[i] * values[i, k]
    rest = np.empty_like(values)
    for i in range(len(values)):
        for k in range(values.shape[1]):
            rest[i, k] = values[i, k] - sums[index[i], k] / total[index[i]]
    return rest


def fit_revolution(
    points: Array, normals: Array, axes: Array, center: Array, tilts: bool
) -> Revolution | None:
    """Return the body that fits best, None where too little of its side is seen.

    Args:
        points: (N, 3) [m].
        normals: (N, 3) unit.
        axes: (3, 3) rows: first x and y of the section, and direction of the axis.
        center: (3,) a point near the axis [m].
        tilts: whether the axis may turn.
    """
    start = _round_start(points, normals, axes, center)
    if start is None:
        return None
    state = np.array([*start, 0.0, 0.0, 1.0, 2.0, 0.0])
    free = [0, 1, 2, 3] if tilts else [0, 1]
    state = _refined(points, normals, axes, center, state, free)
    return body_of(points, normals, axes, center, state)


def _round_start(points: Array, normals: Array, axes: Array, center: Array) -> Array | None:
    places, turned = (points - center) @ axes.T, normals @ axes.T
    side = np.abs(turned[:, 2]) < _SIDE
    if side.sum() < 30:
        return None
    found, _ = crossing(places[side, :2], turned[side, :2])
    reach = np.abs(places[:, :2]).max()
    return None if np.abs(found).max() > 1.5 * reach else found


def _turned_axes(axes: Array, state: Array) -> Array:
    """Return the axes tilted about x and y and spun about the axis by the state's angles."""
    tilt = axes[2] + state[2] * axes[0] + state[3] * axes[1]
    z = tilt / np.sqrt(tilt @ tilt)
    x = np.cos(state[6]) * axes[0] + np.sin(state[6]) * axes[1]
    x = x - (x @ z) * z
    x /= np.sqrt(x @ x)
    y = np.array([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
    return np.stack([x, y, z])


def _frame(axes: Array, center: Array, state: Array) -> tuple[Array, Array]:
    """Return the axes (3, 3) and the origin (3,) [m] of the body of a state."""
    return _turned_axes(axes, state), center + state[0] * axes[0] + state[1] * axes[1]


@exact_kernel
def _distances(
    points: Array, axes: Array, origin: Array, aspect: float, power: float
) -> tuple[Array, Array, Array]:
    """Return height, half width along x and its factor to a distance, for each point."""
    count = len(points)
    height, radius, scale = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        a, b, c = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        x = abs(axes[0, 0] * a + axes[0, 1] * b + axes[0, 2] * c)
        y = abs(axes[1, 0] * a + axes[1, 1] * b + axes[1, 2] * c)
        height[i] = axes[2, 0] * a + axes[2, 1] * b + axes[2, 2] * c
        thin = y / aspect
        if power == 2.0:
            radius[i] = np.sqrt(x * x + thin * thin)
        else:
            radius[i] = (x**power + thin**power + 1e-30) ** (1.0 / power)
        scale[i] = np.sqrt(x * x + y * y) / max(radius[i], 1e-6)
    return height, radius, scale


@exact_kernel
def _outside(points: Array, normals: Array, axes: Array, origin: Array) -> tuple[Mask, Array]:
    """Return which points are seen from outside on the side, and their normals' part across."""
    count, least = len(points), np.sqrt(1.0 - _SIDE**2)
    outer, across = np.empty(count, np.bool_), np.empty(count)
    for i in range(count):
        a, b, c = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        x = axes[0, 0] * a + axes[0, 1] * b + axes[0, 2] * c
        y = axes[1, 0] * a + axes[1, 1] * b + axes[1, 2] * c
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        nx = axes[0, 0] * a + axes[0, 1] * b + axes[0, 2] * c
        ny = axes[1, 0] * a + axes[1, 1] * b + axes[1, 2] * c
        across[i] = np.sqrt(nx * nx + ny * ny)
        outer[i] = x * nx + y * ny > 0.0 and across[i] > least
    return outer, across


_STEPS = np.array([1e-4, 1e-4, 2e-3, 2e-3])
_PRIOR = np.array([1.0, 1.0, 0.3, 0.3])  # how far each may go from its start
_FARTHEST = np.array([1.0, 1.0, 0.5, 0.5])


def _refined(
    points: Array, normals: Array, axes: Array, center: Array, state: Array, free: list[int]
) -> Array:
    """Return the state after bounded Gauss-Newton steps on residuals within slices."""
    start = state.copy()
    for _ in range(_ROUNDS):
        frame, section = _frame(axes, center, state), (state[4], state[5])
        outer, steep = _outside(points, normals, *frame)
        if outer.sum() < 30:
            return state
        kept, steep = points[outer], steep[outer]
        height, radius, scale = _distances(kept, *frame, *section)
        index, count = slices_of(height, height.min(), height.max())
        medians = slice_medians(radius, index, count)
        gap = (radius - medians[index]) * scale * steep
        weight = steep / (1.0 + (gap / _SPREAD) ** 2)
        columns = []
        for k in free:
            moved = state.copy()
            moved[k] += _STEPS[k]
            _, other, _ = _distances(kept, *_frame(axes, center, moved), *section)
            columns.append((other - radius) / _STEPS[k] * scale * steep)
        jacobian = _within(np.stack(columns, axis=1), weight, index, count)
        error = _within(gap[:, None], weight, index, count)[:, 0]
        prior = (0.002 / _PRIOR[free]) ** 2 * weight.sum() * 0.02
        system = (jacobian * weight[:, None]).T @ jacobian + np.diag(prior + 1e-9)
        pull = prior * (state[free] - start[free])
        step = np.linalg.solve(system, (jacobian * weight[:, None]).T @ error + pull)
        state = state.copy()
        state[free] -= np.clip(step, -0.3 * _PRIOR[free], 0.3 * _PRIOR[free])
        state[:4] = np.clip(state[:4], -_FARTHEST, _FARTHEST)
    return state


def body_of(
    points: Array, normals: Array, axes: Array, center: Array, state: Array
) -> Revolution | None:
    """Return the body of given parameters, None where too little of its side is seen.

    Args:
        points: (N, 3) [m].
        normals: (N, 3) unit.
        axes: (3, 3) rows: x and y of the section, direction of the axis, before they are turned.
        center: (3,) a point near the axis [m].
        state: (7,) shifts along x and y [m], tilts about them [rad], aspect and power of the
            section, its spin about the axis [rad].
    """
    turned, origin = _frame(axes, center, state)
    outer, steep = _outside(points, normals, turned, origin)
    if outer.sum() < 30:
        return None
    height, radius, scale = _distances(points, turned, origin, state[4], state[5])
    index, count = slices_of(height[outer], height[outer].min(), height[outer].max())
    medians = slice_medians(radius[outer], index, count)
    low, high = float(height[outer].min()), float(height[outer].max())
    middles = low + (np.arange(count) + 0.5) * (high - low) / count
    known = np.isfinite(medians)
    radii = np.interp(middles, middles[known], medians[known])
    gaps = (radius - np.interp(height, middles, radii)) * scale
    miss = np.abs(gaps[outer] * steep[outer])
    return Revolution(
        origin,
        turned,
        float(state[4]),
        float(state[5]),
        middles,
        radii,
        float(np.median(miss)),
        float((miss < _CLOSE).mean()),
        outer,
        gaps,
    )
