"""What covers the table: wood, red, a black cloth in folds, something of the colour of skin."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh
from intent_tracking.workshop.person.filming.room import Piece, block

COVERS = ("plain", "wood", "red", "black cloth", "skin-coloured")
_GRAIN = {"wood": 0.7, "red": 0.15, "black cloth": 0.25, "skin-coloured": 0.2}
_COLUMNS, _ROWS = 60, 50


def covered(room: tuple[Piece, ...], kind: str, skin: Array, rng: np.random.Generator
            ) -> tuple[Piece, ...]:  # fmt: skip
    """Return a room whose table, its first piece, is covered; "plain" leaves it as it is.

    Args:
        room: see `sample_room`.
        kind: one of `COVERS`.
        skin: (3,) reflectance of the hand that the last kind comes near to.
        rng: source of the rest.

    Raises:
        ValueError: if there is no such kind.
    """
    if kind not in COVERS:
        raise ValueError(f"expected one of {', '.join(COVERS)}, got {kind!r}")
    if kind == "plain":
        return room
    colors = {
        "wood": np.array([0.42, 0.26, 0.13]) * rng.uniform(0.7, 1.4),
        "red": np.array([0.50, 0.05, 0.05]) * rng.uniform(0.7, 1.3),
        "black cloth": np.full(3, rng.uniform(0.010, 0.030)),
        "skin-coloured": skin * rng.uniform(0.85, 1.1) * rng.uniform(0.95, 1.05, 3),
    }
    color = np.clip(colors[kind], 0.0, 1.0)
    if kind != "black cloth":
        return Piece(room[0].mesh, color, _GRAIN[kind]), *room[1:]
    cloth = Piece(_cloth(room[0].mesh, rng), color, _GRAIN[kind])
    hung = Piece(room[2].mesh, 1.3 * color, _GRAIN[kind])
    return cloth, room[1], hung, *room[3:]


def walled(room: tuple[Piece, ...], rng: np.random.Generator) -> tuple[Piece, ...]:
    """Return a room with walls on the other three sides too: some cameras look there."""
    sides = ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0))
    walls = []
    for x, y in sides:
        away = rng.uniform(2.0, 2.8)
        size = np.array([0.05 if x else 9.0, 9.0 if x else 0.05, 3.5])
        color = rng.uniform(0.35, 0.75) + rng.uniform(-0.05, 0.05, 3)
        walls.append(Piece(block(np.array([x * away, y * away, 0.5]), size), color, 0.1))
    return *room, *walls


def _cloth(table: Mesh, rng: np.random.Generator, depth: float = 0.007) -> Mesh:
    """Return a cloth on the table whose folds reach up to its plane and `depth` [m] below it."""
    low, high = table.vertices.min(axis=0), table.vertices.max(axis=0)
    x, y = np.meshgrid(
        np.linspace(low[0], high[0], _COLUMNS), np.linspace(low[1], high[1], _ROWS), indexing="ij"
    )
    height = np.zeros_like(x)
    for _ in range(7):
        turn, length = rng.uniform(0.0, np.pi), rng.uniform(0.08, 0.5)
        along = np.cos(turn) * x + np.sin(turn) * y + 0.03 * np.sin(9.0 * (x - y) + turn)
        height += rng.uniform(0.3, 1.0) * np.sin(2.0 * np.pi * along / length + 6.3 * rng.random())
    height = depth * (height - height.max()) / np.ptp(height)
    vertices = np.stack([x, y, height], axis=-1).reshape(-1, 3)
    corner = (np.arange(_COLUMNS - 1)[:, None] * _ROWS + np.arange(_ROWS - 1)).ravel()
    a, b, c, d = corner, corner + _ROWS, corner + _ROWS + 1, corner + 1
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return Mesh.of(vertices, faces)
