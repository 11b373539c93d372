"""What stands around the demonstration: table, chest, sleeves, and the room behind."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Piece:
    """One coloured surface of the scene, in the table frame."""

    mesh: Mesh
    color: Array
    """(3,) RGB in 0..1."""
    grain: float = 0.0
    """Strength of its texture, 0..1."""


def block(center: Array, size: Array, yaw: float = 0.0) -> Mesh:
    """Return a box of edges `size` (3,) around `center` (3,) [m], turned about z [rad]."""
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
    c, s = np.cos(yaw), np.sin(yaw)
    vertices = (corners * size) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + center
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [tri for a, b, c2, d in sides for tri in ([a, b, c2], [a, c2, d])]
    return Mesh.of(vertices, faces)


def tube(
    path: Array, radii: Array, flat: Array, folds: Array, segments: int = 40,
    across: Array | None = None,
) -> Mesh:  # fmt: skip
    """Return a closed tube of elliptic rings along a path: a sleeve, a chest.

    Args:
        path: (R, 3) centres of the rings [m].
        radii: (R,) half the greater width of each ring [m].
        flat: (R,) ratio of the smaller width to the greater one.
        folds: (R, segments) relative change of the radius: creases of the cloth.
        segments: corners of a ring.
        across: (3,) direction of the greater width at the first ring; None = as it comes.
    """
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    u = np.cross(along, [0.0, 0.0, 1.0] if abs(along[0, 2]) < 0.9 else [0.0, 1.0, 0.0])
    if across is not None:
        u[0] = across - along[0] * (across @ along[0])
    for ring_number in range(1, len(path)):  # carried along, so that the tube does not twist
        before = u[ring_number - 1]
        u[ring_number] = before - along[ring_number] * (before @ along[ring_number])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    angle = 2.0 * np.pi * np.arange(segments) / segments
    size = radii[:, None] * (1.0 + folds)
    ring = (size * np.cos(angle))[..., None] * u[:, None]
    ring = ring + (size * flat[:, None] * np.sin(angle))[..., None] * v[:, None]
    vertices = (path[:, None] + ring).reshape(-1, 3)
    count = len(path)
    i = np.arange(count - 1)[:, None] * segments
    j, k = np.arange(segments), (np.arange(segments) + 1) % segments
    sides = [np.stack([i + j, i + segments + j, i + k], -1),
             np.stack([i + k, i + segments + j, i + segments + k], -1)]  # fmt: skip
    ends = []
    for ring_number, order in ((0, 1), (count - 1, -1)):
        first = ring_number * segments
        fan = [[first, first + a, first + a + 1][::order] for a in range(1, segments - 1)]
        ends.append(np.array(fan))
    faces = np.concatenate([side.reshape(-1, 3) for side in sides] + ends)
    return Mesh.of(vertices, faces)


@dataclass(frozen=True, eq=False)
class Clothes:
    """The demonstrator's shirt with one sleeve; creases stay with the cloth."""

    color: Array
    bare: float
    """Length of the bare forearm behind the wrist [m]."""
    width: float
    """Radius of the cuff [m]."""
    creases: Array
    """(30, 40) relative change of the sleeve's radius."""

    def sleeve(self, wrist: Array, elbow: Array, shoulder: Array) -> Mesh:
        """Return the sleeve from cuff to shoulder around the given joints (3,) [m]."""
        length = float(np.linalg.norm(wrist - elbow))
        cuff = wrist + (elbow - wrist) * min(self.bare / length, 0.9)
        inwards = shoulder * [0.45, 1.0, 1.0] + [0.0, 0.02, 0.03]
        knots = np.stack([cuff, elbow, shoulder, inwards])
        steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
        at = np.linspace(0.0, steps[-1], 60)
        path = np.stack([np.interp(at, steps, knots[:, k]) for k in range(3)], axis=1)
        path = gaussian_filter1d(path, 3.0, axis=0, mode="nearest")[::2]
        shares = np.array([0.0, 0.03, 0.35, 0.5, 0.85, 1.0]) * steps[2]
        sizes = np.array([1.05, 1.0, 1.12, 1.18, 1.5, 1.6]) * self.width
        radii = np.interp(at[::2], shares, sizes)
        return tube(path, radii, np.full(len(path), 0.94), self.creases[: len(path)])

    def chest(self, shoulder: Array, edge: float) -> Mesh:
        """Return shirt front and belly behind the table edge, under both shoulders."""
        y = max(edge + 0.13, shoulder[1] + 0.02)
        top = shoulder[2]
        path = np.array([[0.0, y + 0.02, -0.45], [0.0, y + 0.01, -0.20], [0.0, y, 0.0],
                         [0.0, y, top - 0.12], [0.0, y, top - 0.02], [0.0, y, top + 0.04],
                         [0.0, y, top + 0.08], [0.0, y, top + 0.16]])  # fmt: skip
        radii = np.array([0.19, 0.185, 0.175, 0.195, 0.20, 0.16, 0.065, 0.055])
        flat = np.array([0.70, 0.66, 0.62, 0.58, 0.55, 0.55, 0.9, 1.0])
        fine = np.linspace(0, 7, 30)
        path = np.stack([np.interp(fine, np.arange(8), path[:, k]) for k in range(3)], axis=1)
        radii, flat = (np.interp(fine, np.arange(8), values) for values in (radii, flat))
        return tube(path, radii, flat, 0.4 * self.creases)


def sample_clothes(rng: np.random.Generator) -> Clothes:
    """Return a shirt of a random colour that is not a skin tone."""
    hue = float(rng.choice([0.33, 0.5, 0.58, 0.62, 0.68, 0.78, -1.0]))
    color = _color(hue, rng.uniform(0.15, 0.6), rng.uniform(0.15, 0.75))
    angle = 2.0 * np.pi * np.arange(40) / 40
    creases = np.zeros((30, 40))
    for _ in range(9):
        phase = rng.uniform(0.0, 2.0 * np.pi)
        rows = np.sin(np.arange(30) * rng.uniform(0.4, 1.6) + phase)[:, None]
        creases += rows * np.cos(rng.integers(1, 4) * angle + rng.uniform(0.0, 6.3))
    return Clothes(color, rng.uniform(0.035, 0.070), rng.uniform(0.043, 0.048), 0.012 * creases)


def sample_room(rng: np.random.Generator, edge: float) -> list[Piece]:
    """Return table, floor, wall and clutter behind the demonstrator, table frame.

    Args:
        rng: source of the room.
        edge: y of the table edge at the demonstrator's side [m].
    """
    wood = rng.random() < 0.6
    hue = rng.uniform(0.06, 0.11) if wood else rng.uniform(0.0, 1.0)
    value = rng.uniform(0.45, 0.8)
    top = _color(hue, rng.uniform(0.25, 0.5) if wood else 0.06, value)
    left, right = rng.uniform(0.55, 0.8, 2)
    size = np.array([left + right, edge + 0.75, 0.035])
    center = np.array([0.5 * (right - left), 0.5 * (edge - 0.75), -0.0175])
    pieces = [
        Piece(block(center, size), top, 0.5 if wood else 0.1),
        Piece(block(np.array([0, 2.0, -0.78]), np.array([9.0, 9.0, 0.04])), _grey(rng), 0.2),
        Piece(block(np.array([0, edge + rng.uniform(1.6, 2.4), 0.5]), np.array([9.0, 0.05, 3.5])),
              _grey(rng), 0.1),
    ]  # fmt: skip
    for _ in range(int(rng.integers(3, 7))):
        height = rng.uniform(0.2, 1.0)
        size = np.array([rng.uniform(0.15, 0.6), rng.uniform(0.15, 0.4), height])
        where = np.array(
            [rng.uniform(-1.4, 1.4), edge + rng.uniform(0.75, 1.5), -0.76 + height / 2]
        )
        paint = _color(rng.random(), rng.uniform(0.1, 0.7), rng.uniform(0.2, 0.8))
        pieces.append(Piece(block(where, size, rng.uniform(-0.6, 0.6)), paint, 0.15))
    return pieces


def _grey(rng: np.random.Generator) -> Array:
    return np.asarray(rng.uniform(0.45, 0.8) + rng.uniform(-0.04, 0.04, 3))


def _color(hue: float, saturation: float, value: float) -> Array:
    """Return RGB (3,) of hue, saturation and value in 0..1; a negative hue is grey."""
    if hue < 0.0:
        return np.full(3, value)
    shade = np.abs((hue + np.array([0.0, 2.0 / 3.0, 1.0 / 3.0])) % 1.0 * 6.0 - 3.0) - 1.0
    return np.asarray(value * (1.0 - saturation * (1.0 - np.clip(shade, 0.0, 1.0))))
