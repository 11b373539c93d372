"""Standing bodies of an oval or angular section: fitted to the surface and to how wide it looks.

Of a flat front the surface alone tells no width; the outline left and right does.
"""

import numpy as np
from scipy.optimize import minimize

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import kernel
from intent_perception.recognition.estimation.revolution import (
    Revolution,
    body_of,
    slices_of,
)
from intent_perception.recognition.estimation.things import SeenThing

_EVALUATIONS = 110
_POINTS = 350
_SPREAD = 0.003  # residuals beyond are of other surfaces [m]
_SIDE = 0.85
_OUTLINE = 0.6  # weight of the outline against the surface
_USUAL_ASPECT, _USUAL_POWER = 0.75, 2.6  # are taken where nothing is seen of them
_HABIT = 0.03


def fit_squeezed(thing: SeenThing, center: Array) -> Revolution | None:
    """Return the body of a superelliptic section that fits best, None where no side is seen.

    Args:
        thing: what stands.
        center: (3,) a point near its axis [m].
    """
    side = np.flatnonzero(np.abs(thing.normals[:, 2]) < _SIDE)
    if len(side) < 40:
        return None
    chosen = side[:: max(1, len(side) // _POINTS)]
    view = _Sight(thing.points[chosen], thing.eye, center)
    best, least = None, np.inf
    for yaw in (view.facing, view.facing + 0.7):
        width = view.width
        start = np.array([0.0, 0.35 * width, yaw, 0.75, 3.0])
        steps = np.array([0.01, 0.02, 0.3, 0.15, 1.0])
        simplex = np.vstack([start, start + np.diag(steps)])
        found = minimize(
            view.cost,
            start,
            method="Nelder-Mead",
            options={
                "maxfev": _EVALUATIONS,
                "initial_simplex": simplex,
                "xatol": 1e-4,
                "fatol": 1e-5,
            },
        )
        if found.fun < least:
            best, least = found.x, found.fun
    assert best is not None
    state = view.state(best)
    return body_of(thing.points, thing.normals, np.eye(3), center, state)


class _Sight:
    """Points of a side and how wide they look from the camera."""

    def __init__(self, points: Array, eye: Array, center: Array) -> None:
        ahead = points[:, :2].mean(axis=0) - eye[:2]
        ahead /= max(float(np.linalg.norm(ahead)), 1e-6)
        self._ahead, self._right = ahead, np.array([ahead[1], -ahead[0]])
        flat = points[:, :2]
        across = flat @ self._right
        low, high = np.quantile(across, [0.01, 0.99])
        self.width = float(high - low)
        """How wide it looks [m]."""
        self._low, self._high = float(low), float(high)
        front = float(np.quantile(flat @ ahead, 0.02))
        self._origin = 0.5 * (low + high) * self._right + front * ahead
        self._sight = np.stack([self._origin, self._right, ahead])
        self._center = center
        index, count = slices_of(points[:, 2], points[:, 2].min(), points[:, 2].max())
        order = np.argsort(index, kind="stable")
        self._flat = np.ascontiguousarray(flat[order])
        self._bounds = np.searchsorted(index[order], np.arange(count + 1))
        self.facing = float(np.arctan2(self._right[1], self._right[0]))
        """Direction in which x of the section is seen at its full length [rad]."""

    def state(self, free: Array) -> Array:
        """Return the state of `revolution` for shift right, shift ahead, yaw, aspect, power."""
        origin = self._origin + free[0] * self._right + free[1] * self._ahead
        shift = origin - self._center[:2]
        aspect, power = np.clip(free[3], 0.4, 1.6), np.clip(free[4], 2.0, 8.0)
        return np.array([*shift, 0.0, 0.0, aspect, power, free[2]])

    def cost(self, free: Array) -> float:
        """Return how badly a section fits surface and outline."""
        return float(_cost(free, self._flat, self._bounds, self._sight, self._low, self._high))


@kernel
def _cost(free: Array, flat: Array, bounds: Array, sight: Array, low: float, high: float) -> float:
    """Return how badly a section fits surface and outline, see `_Sight`.

    Args:
        free: (5,) shift right and ahead [m], yaw [rad], aspect, power.
        flat: (N, 2) points, slice after slice [m].
        bounds: (K + 1,) where each slice begins.
        sight: (3, 2) rows: where the shifts begin [m], right, ahead.
        low: where the outline ends on the left, along right [m].
        high: where it ends on the right [m].
    """
    aspect, power = free[3], free[4]
    if not (0.4 <= aspect <= 1.6 and 2.0 <= power <= 8.0 and abs(free[1]) < 0.3):
        return 10.0
    origin = sight[0] + free[0] * sight[1] + free[1] * sight[2]
    cosine, sine = np.cos(free[2]), np.sin(free[2])
    rotation = np.array([[cosine, sine], [-sine, cosine]])
    surface, widest = _surface_misfit(flat, bounds, origin, rotation, aspect, power)
    dual = power / (power - 1.0)
    right = sight[1]
    first = abs(cosine * right[0] + sine * right[1])
    second = abs(cosine * right[1] - sine * right[0]) * aspect
    half = widest * (first**dual + second**dual) ** (1.0 / dual)
    middle = origin[0] * right[0] + origin[1] * right[1]
    miss = abs(middle + half - high) + abs(middle - half - low)
    habit = (aspect - _USUAL_ASPECT) ** 2 + 0.05 * (power - _USUAL_POWER) ** 2
    return float(surface + _OUTLINE * min(miss / 0.01, 3.0) + _HABIT * habit)


@kernel
def _surface_misfit(
    flat: Array, bounds: Array, origin: Array, rotation: Array, aspect: float, power: float
) -> tuple[float, float]:
    """Return how far points are from their slice's median section, 0..1, and the widest [m].

    Args:
        flat: (N, 2) points, slice after slice [m].
        bounds: (K + 1,) where each slice begins.
        origin: (2,) of the section [m].
        rotation: (2, 2) into its frame.
        aspect: of the section.
        power: of the section.
    """
    count = len(flat)
    radius = np.empty(count)
    scale = np.empty(count)
    for i in range(count):
        dx, dy = flat[i, 0] - origin[0], flat[i, 1] - origin[1]
        x = abs(rotation[0, 0] * dx + rotation[0, 1] * dy)
        y = abs(rotation[1, 0] * dx + rotation[1, 1] * dy)
        radius[i] = (x**power + (y / aspect) ** power + 1e-30) ** (1.0 / power)
        scale[i] = np.sqrt(x * x + y * y) / max(radius[i], 1e-6)
    total, widest = 0.0, 0.0
    for k in range(len(bounds) - 1):
        a, b = bounds[k], bounds[k + 1]
        if b == a:
            continue
        middle = np.median(radius[a:b])
        if b - a > 4:
            widest = max(widest, middle)
        for i in range(a, b):
            gap = (radius[i] - middle) * scale[i] / _SPREAD
            total += gap * gap / (1.0 + gap * gap)
    return total / count, widest
