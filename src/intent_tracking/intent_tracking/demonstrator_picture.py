"""Light, shadow, texture: colour images of a scene beside its exact depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.camera import Camera
from intent_perception.geometry import Array, inverse, look_at
from intent_perception.mesh import Mesh
from intent_perception.rendering import render
from intent_tracking.demonstrator_room import Piece

Image = NDArray[np.float32]

_GAMMA = (255.0 * (np.arange(4096) / 4095.0) ** (1.0 / 1.5)).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class Light:
    """One lamp with soft shadows and the light of the room."""

    position: Array
    """(3,) in the table frame [m]."""
    color: Array
    """(3,) RGB of the lamp."""
    ambient: Array
    """(3,) RGB of the light from everywhere."""


@dataclass(frozen=True, eq=False)
class Picture:
    """One noise-free view."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    depth: Image
    """(H, W) z in the camera [m], 0 = nothing."""
    label: NDArray[np.int16]
    """(H, W) number of the piece, -1 = nothing."""


def sample_light(rng: np.random.Generator) -> Light:
    """Return a lamp above the table, warm or cold, left or right."""
    position = np.array([rng.uniform(-1.4, 1.4), rng.uniform(-0.9, 0.9), rng.uniform(1.3, 2.0)])
    warm = rng.uniform(-0.10, 0.10)
    strength = rng.uniform(0.62, 0.85)
    color = strength * np.array([1.0 + warm, 1.0, 1.0 - warm])
    return Light(position, color, rng.uniform(0.30, 0.45) * np.array([1.0, 1.0, 1.03]))


def picture(
    pieces: Sequence[Piece], camera: Camera, T_table_camera: Array, light: Light
) -> Picture:
    """Return the picture of a scene.

    Args:
        pieces: N coloured meshes in the table frame.
        camera: the view.
        T_table_camera: (4, 4) camera pose.
        light: what shines.
    """
    meshes = [piece.mesh for piece in pieces]
    view = render(
        camera, meshes, np.tile(inverse(T_table_camera), (len(pieces), 1, 1)), normals=True
    )
    assert view.normal is not None
    pose = T_table_camera.astype(np.float32)
    points = np.asarray(camera.backproject(view.depth), dtype=np.float32).reshape(-1, 3)
    points = points @ pose[:3, :3].T + pose[:3, 3]
    normals = _smooth(view.normal, view.label).reshape(-1, 3) @ pose[:3, :3].T
    to_lamp = light.position.astype(np.float32) - points
    to_lamp /= np.sqrt(np.einsum("ni,ni->n", to_lamp, to_lamp))[:, None]
    lit = np.clip(np.einsum("ni,ni->n", normals, to_lamp), 0.0, 1.0).reshape(view.depth.shape)
    lit = lit * _unshadowed(meshes, points, light).reshape(lit.shape)
    sky = 0.72 + 0.28 * normals[:, 2].reshape(lit.shape)
    known = np.append(np.array([piece.color for piece in pieces]), np.full((1, 3), 0.02), axis=0)
    grain = np.append([piece.grain for piece in pieces], 0.0).astype(np.float32)[view.label]
    texture = np.float32(1.0) + grain * _grain(points).reshape(lit.shape)
    shades = lit[..., None] * light.color.astype(np.float32)
    shades += sky[..., None] * light.ambient.astype(np.float32)
    color = known.astype(np.float32)[view.label] * texture[..., None] * shades
    levels = np.rint(np.clip(color, 0.0, 1.0) * 4095.0).astype(np.int16)
    return Picture(_GAMMA[levels], view.depth, view.label)


def _smooth(normal: Image, label: NDArray[np.int16]) -> Image:
    """Return the normals averaged over a few pixels of the same piece, so facets vanish."""
    total = cv2.GaussianBlur(normal, (5, 5), 1.2)
    low = cv2.erode(label.astype(np.float32), np.ones((5, 5), np.uint8))
    high = cv2.dilate(label.astype(np.float32), np.ones((5, 5), np.uint8))
    blurred = np.where((low == high)[..., None], total, normal)
    size = np.linalg.norm(blurred, axis=2, keepdims=True)
    return np.asarray(blurred / np.maximum(size, 1e-6), dtype=np.float32)


def _unshadowed(meshes: Sequence[Mesh], points: Image, light: Light) -> Image:
    """Return (N,) the share of the lamp that reaches each point, by a blurred shadow map."""
    size = 700
    lamp = Camera(size, size, 900.0, 900.0, size / 2, size / 2)
    T_table_lamp = look_at(light.position, np.array([0.0, 0.1, 0.0]), np.array([0.0, 1.0, 0.1]))
    T_lamp_table = inverse(T_table_lamp)
    nearest = render(lamp, meshes, np.tile(T_lamp_table, (len(meshes), 1, 1))).depth
    turned = T_lamp_table.astype(np.float32)
    seen = points @ turned[:3, :3].T + turned[:3, 3]
    ahead = np.maximum(seen[:, 2], 1e-3)
    u = np.rint(900.0 * seen[:, 0] / ahead + size / 2).astype(int)
    v = np.rint(900.0 * seen[:, 1] / ahead + size / 2).astype(int)
    share = np.zeros(len(points), dtype=np.float32)
    taps = [(0, 0), (3, 1), (-1, 3), (-3, -1), (1, -3)]
    for du, dv in taps:
        x, y = np.clip(u + du, 0, size - 1), np.clip(v + dv, 0, size - 1)
        front = nearest[y, x]
        free = (front == 0.0) | (ahead < front + 0.012)
        outside = (u < 0) | (v < 0) | (u >= size) | (v >= size)
        share += free | outside
    return share / np.float32(len(taps))


def _grain(points: Image) -> Image:
    """Return (N,) a texture about -0.3..0.3 that runs along x, from positions in the table."""
    x, y, z = points.T
    rings = 14.0 * y + 1.3 * np.sin(2.1 * x + 3.0 * y) + 4.0 * z
    wave = np.sin(6.0 * rings + 2.0 * np.sin(1.7 * x))
    fine = np.sin(230.0 * y + 7.0 * np.sin(9.0 * x)) * np.sin(31.0 * x + 4.0 * z)
    return np.asarray(0.18 * wave + 0.10 * fine, dtype=np.float32)
