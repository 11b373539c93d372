"""Meshes drawn over camera images and into pictures of their own, with light and shadow."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.coded_images import write_picture
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, transform_points

Image = NDArray[np.uint8]
FONT = cv2.FONT_HERSHEY_SIMPLEX
LIGHT_TABLE = np.array([0.35, -0.45, 1.0]) / np.linalg.norm([0.35, -0.45, 1.0])
"""Direction towards the lamp in the table frame."""
TASK_COLORS = {
    "hand-over": "#0072B2",
    "pouring": "#009E73",
    "tool-use": "#D55E00",
    "dish-washing": "#8A5FBF",
}
SPARE_COLORS = ("#B8860B", "#56748C", "#A0466B", "#4E7D3A")
"""For tasks that a user has added."""
INK, SOFT, GRID = "#1f2933", "#66727f", "#e3e8ed"


def task_color(task: str, tasks: Sequence[str]) -> str:
    """Return the colour of a task, the same in every picture."""
    spare = [name for name in tasks if name not in TASK_COLORS]
    if task in TASK_COLORS or task not in spare:
        return TASK_COLORS.get(task, SOFT)
    return SPARE_COLORS[spare.index(task) % len(SPARE_COLORS)]


def rgb(code: str) -> tuple[int, int, int]:
    """Return the bytes of a colour such as #0072B2."""
    red, green, blue = (int(code[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """A mesh to be drawn."""

    mesh: Mesh
    T_table_body: Array
    color: tuple[float, float, float]
    """RGB in 0..1."""


@dataclass(frozen=True)
class Tag:
    """Words beside a point of an image."""

    text: str
    color: tuple[float, float, float]
    """RGB in 0..1."""
    at: tuple[float, float]
    """Column and row of the point that the words belong to, in pixels."""


@dataclass(frozen=True)
class Window:
    """A rectangle of an image in pixels."""

    left: int
    top: int
    width: int
    height: int

    def cut(self, image: Image, width: int) -> Image:
        """Return this part of the image, resized to a width."""
        part = image[self.top : self.top + self.height, self.left : self.left + self.width]
        size = (width, round(width * self.height / self.width))
        smaller = self.width > width
        way = cv2.INTER_AREA if smaller else cv2.INTER_CUBIC
        resized: Image = cv2.resize(part, size, interpolation=way)
        return resized


def overlay(
    image: Image,
    camera: Camera,
    T_table_camera: Array,
    bodies: Sequence[DrawnBody],
    opacity: Sequence[float],
    scale: int = 2,
) -> Image:
    """Return the image, enlarged, with shaded bodies and their outlines drawn over it.

    Args:
        image: (H, W, 3) RGB.
        camera: of the image.
        T_table_camera: its pose.
        bodies: hide one another as in reality.
        opacity: of each body's surface in 0..1; outlines are always drawn.
        scale: enlargement; the bodies are rendered at the larger size.

    Returns:
        (scale * H, scale * W, 3) RGB.
    """
    size = (camera.width * scale, camera.height * scale)
    canvas: Image = cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
    if not bodies:
        return canvas
    large = camera.scaled(float(scale))
    color, label = shaded(large, T_table_camera, bodies)
    weight = np.append(np.asarray(opacity, dtype=np.float64), 0.0)[label][..., None]
    canvas = np.rint(canvas * (1.0 - weight) + color * 255.0 * weight).astype(np.uint8)
    for index, body in enumerate(bodies):
        mask = (label == index).astype(np.uint8)
        lines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(canvas, lines, -1, (255, 255, 255), scale + 2, cv2.LINE_AA)
        cv2.drawContours(canvas, lines, -1, _bytes(body.color), scale, cv2.LINE_AA)
    return canvas


def shaded(
    camera: Camera, T_table_camera: Array, bodies: Sequence[DrawnBody], smooth: bool = False
) -> tuple[Array, NDArray[np.int16]]:
    """Return colour (H, W, 3) in 0..1 and label (H, W), -1 where there is no body.

    Smooth shading hides the facets of round things and keeps edges.
    """
    T_camera_table = inverse(T_table_camera)
    poses = np.array([T_camera_table @ body.T_table_body for body in bodies])
    colors = np.array([body.color for body in bodies])
    rendered = render(camera, [body.mesh for body in bodies], poses, normals=True)
    canvas = np.zeros((camera.height, camera.width, 3))
    rows, columns = (np.flatnonzero((rendered.label >= 0).any(axis=axis)) for axis in (1, 0))
    if rows.size and rendered.normal is not None:
        part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        light = T_camera_table[:3, :3] @ LIGHT_TABLE
        base = np.concatenate([colors, np.zeros((1, 3))])[rendered.label[part]]
        canvas[part] = _lit(rendered.normal[part], base, light, smooth)
    return canvas, rendered.label


def _lit(normal: NDArray[np.float32], base: Array, light: Array, smooth: bool) -> Array:
    """Return the colours (H, W, 3) of surfaces with unit normals and base colours under a lamp."""
    if smooth:
        normal = cv2.bilateralFilter(normal, 9, 0.45, 4.0)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.float32(1e-6))
    diffuse = 0.5 + 0.5 * (normal @ light)
    half = light + np.array([0.0, 0.0, -1.0])
    gloss = np.clip(normal @ (half / np.linalg.norm(half)), 0.0, 1.0) ** 40
    color = base * (0.35 + 0.75 * diffuse[..., None]) + 0.18 * gloss[..., None]
    return np.asarray(np.clip(color, 0.0, 1.0))


def studio(
    camera: Camera, T_table_camera: Array, bodies: Sequence[DrawnBody], table: float | None = 0.0
) -> Image:
    """Return a picture of bodies alone, with a soft shadow on the table.

    Args:
        camera: of the wanted picture; rendering is done at twice its size.
        T_table_camera: its pose.
        bodies: what is to be seen.
        table: height of the table that catches the shadow [m]; None: floating in white.

    Returns:
        (H, W, 3) RGB.
    """
    large = camera.scaled(2.0)
    color, label = shaded(large, T_table_camera, bodies, smooth=True)
    canvas = _backdrop(large, T_table_camera)
    if table is not None:
        dark = _shadow(large, T_table_camera, bodies, table)
        canvas = canvas * (1.0 - 0.30 * dark[..., None])
    canvas = np.where(label[..., None] >= 0, color, canvas)
    small = cv2.resize(canvas, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(np.clip(small, 0.0, 1.0) * 255.0), dtype=np.uint8)


def _backdrop(camera: Camera, T_table_camera: Array) -> Array:
    """Return a pale wall above a pale table (H, W, 3), parted at the horizon."""
    rows = np.arange(camera.height)
    rays = np.stack(
        [np.zeros(camera.height), (rows - camera.cy) / camera.fy, np.ones(camera.height)], axis=-1
    )
    rise = (rays @ T_table_camera[:3, :3].T)[:, 2] / np.linalg.norm(rays, axis=-1)
    blend = 1.0 / (1.0 + np.exp(-(rise + 0.22) * 14.0))[:, None]
    column = (1.0 - blend) * np.array([0.90, 0.91, 0.925]) + blend * np.array([0.985, 0.988, 0.99])
    return np.repeat(column[:, None], camera.width, axis=1)


def _shadow(
    camera: Camera, T_table_camera: Array, bodies: Sequence[DrawnBody], table: float
) -> Array:
    """Return how dark the table is (H, W) in 0..1: bodies flattened along the light, blurred."""
    flat = []
    for body in bodies:
        points = transform_points(body.T_table_body, body.mesh.vertices)
        points = points - (points[:, 2:] - table) * LIGHT_TABLE / LIGHT_TABLE[2]
        flat.append(Mesh(points, body.mesh.faces))
    poses = np.repeat(inverse(T_table_camera)[None], len(flat), axis=0)
    label = render(camera, flat, poses, np.ones((len(flat), 3))).label
    spread = max(3, round(0.012 * camera.width)) | 1
    mask = (label >= 0).astype(np.float64)
    return np.asarray(cv2.GaussianBlur(mask, (0, 0), spread * 0.6))


def window_around(pixels: Array, size: tuple[int, int], margin: float = 0.3) -> Window:
    """Return the part of an image of a size (width, height) that holds the pixels (N, 2).

    It keeps the image's proportions and leaves a margin (share of the extent) on all sides.
    """
    inside = pixels[np.all(np.isfinite(pixels), axis=1)]
    if len(inside) == 0:
        return Window(0, 0, *size)
    low, high = np.clip(inside.min(axis=0), 0, size), np.clip(inside.max(axis=0), 0, size)
    extent = (high - low) * (1.0 + margin)
    share = float(np.clip(max(extent / np.asarray(size)), 0.35, 1.0))
    width, height = round(size[0] * share), round(size[1] * share)
    corner = (low + high) / 2 - np.array([width, height]) / 2
    left = int(np.clip(corner[0], 0, size[0] - width))
    top = int(np.clip(corner[1], 0, size[1] - height))
    return Window(left, top, width, height)


def annotate(image: Image, tags: Sequence[Tag], size: float = 0.75) -> Image:
    """Return the image with each tag in a dark plate near its point; plates do not overlap."""
    canvas = image.copy()
    taken: list[tuple[int, int, int, int]] = []
    for tag in sorted(tags, key=lambda t: t.at[1]):
        (width, height), base = cv2.getTextSize(tag.text, FONT, size, 2)
        pad = round(10 * size)
        box_width, box_height = width + 2 * pad, height + base + pad
        left = int(np.clip(tag.at[0] - box_width / 2, 4, canvas.shape[1] - box_width - 4))
        top = int(np.clip(tag.at[1] - box_height - 8, 4, canvas.shape[0] - box_height - 4))
        while any(_overlap((left, top, box_width, box_height), other) for other in taken):
            top += 6
        taken.append((left, top, box_width, box_height))
        _plate(canvas, (left, top, box_width, box_height), tag.color)
        place = (left + pad, top + height + pad // 2 + 1)
        cv2.putText(canvas, tag.text, place, FONT, size, (255, 255, 255), 2, cv2.LINE_AA)
    return canvas


def write_image(path: Path, image: Image) -> None:
    """Write RGB to a PNG file."""
    write_picture(path, image)


def _plate(canvas: Image, box: tuple[int, int, int, int], color: tuple[float, ...]) -> None:
    """Darken a rectangle of the canvas and mark its left edge with the colour."""
    left, top, width, height = box
    area = canvas[top : top + height, left : left + width]
    area[:] = np.rint(area * 0.22 + np.array([18, 24, 31]) * 0.78).astype(np.uint8)
    canvas[top : top + height, left : left + 6] = _bytes(color)


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    """Return whether two boxes (left, top, width, height) share a pixel."""
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]


def _bytes(color: Sequence[float]) -> tuple[int, int, int]:
    """Return RGB in 0..1 as bytes."""
    red, green, blue = (round(255 * float(c)) for c in color[:3])
    return red, green, blue
