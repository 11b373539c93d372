"""Light, shadow, texture: colour images of a scene beside its exact depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at
from intent_tracking.workshop.person.filming.room import Piece
from intent_tracking.workshop.person.filming.shading import shaded

Image = NDArray[np.float32]

_LAMP = Camera(700, 700, 900.0, 900.0, 350.0, 350.0)
"""The shadow map's view from the lamp."""
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
class LitPicture:
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
) -> LitPicture:
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
    T_lamp_table = inverse(
        look_at(light.position, np.array([0.0, 0.1, 0.0]), np.array([0.0, 1.0, 0.1]))
    )
    shadow = render(_LAMP, meshes, np.tile(T_lamp_table, (len(meshes), 1, 1))).depth
    albedo = np.append(np.array([piece.color for piece in pieces]), np.full((1, 3), 0.02), axis=0)
    floats = [
        np.asarray(values, np.float32)
        for values in (
            T_table_camera, [camera.fx, camera.fy, camera.cx, camera.cy], light.position,
            T_lamp_table, albedo, [*(piece.grain for piece in pieces), 0.0], light.color,
            light.ambient,
        )
    ]  # fmt: skip
    pose, intrinsics, position, T_lamp, albedo, grain, shine, ambient = floats
    color = shaded(
        view.depth, view.label, _smooth(view.normal, view.label), pose, intrinsics, position,
        T_lamp, _LAMP.fx, shadow, albedo, grain, shine, ambient, _GAMMA,
    )  # fmt: skip
    return LitPicture(color, view.depth, view.label)


def _smooth(normal: Image, label: NDArray[np.int16]) -> Image:
    """Return the normals averaged over a few pixels of the same piece, so facets vanish."""
    total = cv2.GaussianBlur(normal, (5, 5), 1.2)
    low = cv2.erode(label.astype(np.float32), np.ones((5, 5), np.uint8))
    high = cv2.dilate(label.astype(np.float32), np.ones((5, 5), np.uint8))
    blurred = np.where((low == high)[..., None], total, normal)
    size = np.linalg.norm(blurred, axis=2, keepdims=True)
    return np.asarray(blurred / np.maximum(size, 1e-6), dtype=np.float32)
