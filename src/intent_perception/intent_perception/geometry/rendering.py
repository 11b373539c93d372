"""Meshes drawn as depth, label, colour and normal images: a z-buffer on the CPU."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import exact_kernel, kernel
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.mesh import Mesh

_NEAR = 0.02
"""What is nearer to the camera is cut off [m]."""


@dataclass(frozen=True, eq=False)
class Lamp:
    """The light of a scene."""

    direction: Array = field(default_factory=lambda: np.array([-0.3, -0.8, -0.5]))
    """(3,) towards the lamp, camera frame (x right, y down, z forward)."""
    color: Array = field(default_factory=lambda: np.ones(3))
    """(3,) RGB factor of everything lit."""
    ambient: float = 0.35
    """Share of the light that comes from everywhere, 0..1."""
    gloss: float = 0.15
    """Strength of highlights, 0..1."""


@dataclass(frozen=True, eq=False)
class Rendered:
    """Images of one view."""

    depth: Floats
    """(H, W) z in the camera frame [m]; 0 = nothing."""
    label: NDArray[np.int16]
    """(H, W) index of the mesh; -1 = nothing."""
    color: NDArray[np.uint8] | None
    """(H, W, 3) shaded RGB, black where nothing is; None if no colours were given."""
    normal: Floats | None
    """(H, W, 3) outward unit normal in the camera frame, zero where nothing is; None if not
    asked for."""


def render(
    camera: Camera,
    meshes: Sequence[Mesh],
    poses_camera: ArrayLike,
    colors: ArrayLike | None = None,
    lamp: Lamp | None = None,
    normals: bool = False,
) -> Rendered:
    """Return what the camera sees of some meshes.

    A pixel shows the nearest surface at its centre. Both sides of a face are drawn, so open meshes
    may be given.

    Args:
        camera: intrinsics and size of the images.
        meshes: N meshes.
        poses_camera: (N, 4, 4) T_camera_mesh.
        colors: (N, 3) RGB in 0..1; None = no colour image.
        lamp: light of the colour image.
        normals: whether to return normals too.

    Raises:
        ValueError: if meshes, poses and colours differ in number.
    """
    poses = np.asarray(poses_camera, dtype=np.float64).reshape(-1, 4, 4)
    albedo = np.zeros((0, 3)) if colors is None else np.asarray(colors, np.float64).reshape(-1, 3)
    if len(poses) != len(meshes) or (colors is not None and len(albedo) != len(meshes)):
        raise ValueError(
            f"expected poses and colours of {len(meshes)} meshes, got {len(poses)}, {len(albedo)}"
        )
    triangles, labels = _triangles(meshes, poses)
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    inverse_depth = np.zeros((camera.height, camera.width), np.float32)
    face = np.full((camera.height, camera.width), -1, np.int32)
    rasterize_faces(triangles, intrinsics, inverse_depth, face)
    depth, label = resolve(inverse_depth, face, labels)
    color = normal = None
    if colors is not None or normals:
        facing = _facing_normals(triangles)
        if colors is not None:
            lamp = lamp or Lamp()
            shades = _shades(triangles, labels, facing, albedo, lamp)
            color = paint(face, shades)
        if normals:
            normal = look_up(face, facing)
    return Rendered(depth, label, color, normal)


def visible_pixels(rendered: Rendered, count: int) -> NDArray[np.int64]:
    """Return the number of pixels (count,) in which each of the first meshes is seen."""
    return np.bincount(rendered.label.ravel() + 1, minlength=count + 1)[1 : count + 1]


def _triangles(meshes: Sequence[Mesh], poses: Array) -> tuple[Floats, NDArray[np.int16]]:
    """Return the triangles (F, 3, 3) in the camera frame, cut at the near plane, and labels."""
    if not meshes:
        return np.zeros((0, 3, 3), np.float32), np.zeros(0, np.int16)
    pieces = []
    for mesh, pose in zip(meshes, poses, strict=True):
        moved = (mesh.vertices @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
        pieces.append(moved[mesh.faces])
    counts = [len(piece) for piece in pieces]
    labels = np.repeat(np.arange(len(meshes), dtype=np.int16), counts)
    triangles = np.concatenate(pieces)
    behind = (triangles[:, :, 2] < _NEAR).sum(axis=1)
    if not behind.any():
        return triangles, labels
    cut, cut_labels = _cut_at_near_plane(triangles, labels, behind)
    whole = behind == 0
    return np.concatenate([triangles[whole], cut]), np.concatenate([labels[whole], cut_labels])


def _cut_at_near_plane(
    triangles: Floats, labels: NDArray[np.int16], behind: NDArray[np.int64]
) -> tuple[Floats, NDArray[np.int16]]:
    """Return the visible pieces of the triangles that cross the near plane."""
    kept, kept_labels = [np.zeros((0, 3, 3), np.float32)], [np.zeros(0, np.int16)]
    for lone_in_front, count in ((True, 2), (False, 1)):
        chosen = np.flatnonzero(behind == count)
        front = triangles[chosen, :, 2] >= _NEAR
        lone = (front if lone_in_front else ~front).argmax(axis=1)
        order = (lone[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(triangles[chosen], order[..., None], 1), 1, 0)
        ab = a + (b - a) * ((_NEAR - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
        ac = a + (c - a) * ((_NEAR - a[:, 2]) / (c[:, 2] - a[:, 2]))[:, None]
        if lone_in_front:
            pieces = [np.stack([a, ab, ac], axis=1)]
        else:
            pieces = [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
        kept += [piece.astype(np.float32) for piece in pieces]
        kept_labels += [labels[chosen]] * len(pieces)
    return np.concatenate(kept), np.concatenate(kept_labels)


def _facing_normals(triangles: Floats) -> Floats:
    """Return the unit normals (F, 3) of triangles (F, 3, 3), on the side of the camera."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    away = np.einsum("ij,ij->i", normal, a) > 0.0
    normal[away] *= -1.0
    return np.ascontiguousarray(normal, dtype=np.float32)


def _shades(
    triangles: Floats, labels: NDArray[np.int16], normals: Floats, albedo: Array, lamp: Lamp
) -> NDArray[np.uint8]:
    """Return the colour (F, 3) of each face: Lambert's law and a highlight."""
    towards = np.asarray(lamp.direction, dtype=np.float64) / np.linalg.norm(lamp.direction)
    lit = np.clip(normals @ towards, 0.0, None)
    view = -triangles.mean(axis=1)
    view /= np.maximum(np.linalg.norm(view, axis=1, keepdims=True), 1e-9)
    half = view + towards
    half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
    shine = lamp.gloss * np.clip(np.einsum("ij,ij->i", normals, half), 0.0, None) ** 24
    light = (lamp.ambient + (1.0 - lamp.ambient) * lit)[:, None]
    shade = (albedo[labels] * light + shine[:, None]) * lamp.color
    return np.ascontiguousarray(np.clip(shade * 255.0 + 0.5, 0, 255).astype(np.uint8))


@kernel
def rasterize_faces(  # noqa: C901, PLR0915  one loop nest, split it would be slower to read
    triangles: Floats, intrinsics: Floats, inverse_depth: Floats, face: NDArray[np.int32]
) -> None:
    """Draw triangles in front of the camera into a z-buffer, keeping the nearest.

    Args:
        triangles: (F, 3, 3) corners in the camera frame, z above 0 [m].
        intrinsics: (4,) fx, fy, cx, cy.
        inverse_depth: (H, W) in and out, 1/z [1/m]; 0 = nothing.
        face: (H, W) in and out, index of the triangle.
    """
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    height, width = inverse_depth.shape
    one, far = np.float32(1.0), np.float32(1e9)
    for f in range(len(triangles)):
        wa, wb, wc = one / triangles[f, 0, 2], one / triangles[f, 1, 2], one / triangles[f, 2, 2]
        ua, va = fx * triangles[f, 0, 0] * wa + cx, fy * triangles[f, 0, 1] * wa + cy
        ub, vb = fx * triangles[f, 1, 0] * wb + cx, fy * triangles[f, 1, 1] * wb + cy
        uc, vc = fx * triangles[f, 2, 0] * wc + cx, fy * triangles[f, 2, 1] * wc + cy
        top = max(0, int(np.ceil(max(min(va, vb, vc), np.float32(-1.0)))))
        bottom = min(height - 1, int(np.floor(min(max(va, vb, vc), np.float32(height)))))
        if top > bottom or max(ua, ub, uc) < 0.0 or min(ua, ub, uc) > width - 1:
            continue
        area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va)
        if area == 0.0:
            continue
        # 1/z is linear in the image: no division per pixel.
        scale = one / area
        du = ((vc - va) * (wb - wa) - (vb - va) * (wc - wa)) * scale
        dv = ((ub - ua) * (wc - wa) - (uc - ua) * (wb - wa)) * scale
        for v in range(top, bottom + 1):
            low, high = far, -far
            for edge in range(3):
                if edge == 0:
                    u0, v0, u1, v1 = ua, va, ub, vb
                elif edge == 1:
                    u0, v0, u1, v1 = ub, vb, uc, vc
                else:
                    u0, v0, u1, v1 = uc, vc, ua, va
                if (v0 > v and v1 > v) or (v0 < v and v1 < v):
                    continue
                if v0 == v1:
                    low, high = min(low, u0, u1), max(high, u0, u1)
                else:
                    u = u0 + (v - v0) * (u1 - u0) / (v1 - v0)
                    low, high = min(low, u), max(high, u)
            if low > width - 1 or high < 0.0:
                continue
            left = int(np.ceil(max(low, np.float32(0.0))))
            right = int(np.floor(min(high, np.float32(width - 1))))
            start = wa + du * (left - ua) + dv * (v - va)
            for u in range(left, right + 1):
                w = start + du * (u - left)
                if w > inverse_depth[v, u]:
                    inverse_depth[v, u] = w
                    face[v, u] = f


@kernel
def resolve(
    inverse_depth: Floats, face: NDArray[np.int32], labels: NDArray[np.int16]
) -> tuple[Floats, NDArray[np.int16]]:
    """Return depth (H, W) [m] and label (H, W) of a z-buffer of faces with labels (F,)."""
    height, width = face.shape
    depth = np.zeros((height, width), np.float32)
    label = np.full((height, width), -1, np.int16)
    for v in range(height):
        for u in range(width):
            if face[v, u] >= 0:
                depth[v, u] = np.float32(1.0) / inverse_depth[v, u]
                label[v, u] = labels[face[v, u]]
    return depth, label


@exact_kernel
def paint(face: NDArray[np.int32], shades: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image (H, W, 3) in which each pixel has the colour (F, 3) of its face."""
    height, width = face.shape
    color = np.zeros((height, width, 3), np.uint8)
    for v in range(height):
        for u in range(width):
            if face[v, u] >= 0:
                for k in range(3):
                    color[v, u, k] = shades[face[v, u], k]
    return color


@exact_kernel
def look_up(face: NDArray[np.int32], values: Floats) -> Floats:
    """Return the image (H, W, 3) in which each pixel has the value (F, 3) of its face."""
    height, width = face.shape
    image = np.zeros((height, width, 3), np.float32)
    for v in range(height):
        for u in range(width):
            if face[v, u] >= 0:
                for k in range(3):
                    image[v, u, k] = values[face[v, u], k]
    return image
