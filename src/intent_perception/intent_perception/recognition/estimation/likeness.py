"""How like what is seen an estimated shape is: drawn at its pose and held against the depth image.

Analysis by synthesis, as in `verification`, but whole outlines count here: pixels of the thing that
the shape leaves bare speak against it as much as those where the camera saw through it.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rasterizer import NOTHING
from intent_perception.geometry.transforms import inverse
from intent_perception.recognition.estimation.things import SeenThing
from intent_perception.recognition.verification.explanation import draw
from intent_perception.scene.scene_view import SceneView

_SPREAD = 0.005
"""Distance of the surfaces at which a pixel counts half [m]."""
_BEHIND = 0.012
"""What is measured this much behind the drawn surface was seen through it [m]."""


@dataclass(frozen=True, eq=False)
class Likeness:
    """What a drawn shape has in common with a thing."""

    share: float
    """0..1; 1 = each pixel of either is one of the other, at its depth."""
    residual: float
    """Median distance in depth where both are [m]; NaN where they share nothing."""
    visible: float
    """Share of the drawn pixels on which the thing is seen."""


def likeness_of(
    mesh: Mesh, T_table_mesh: Array, thing: SeenThing, scene: SceneView, T_table_camera: Array
) -> Likeness:
    """Return how like a thing a mesh at a pose is."""
    T_camera_mesh = inverse(T_table_camera) @ T_table_mesh
    pose = np.concatenate([T_camera_mesh[:3, :3].ravel(), T_camera_mesh[:3, 3]]).astype(np.float32)
    left, top, depth = draw(
        pose, mesh.vertices.astype(np.float32), mesh.faces, scene.intrinsics, *scene.shape
    )
    mask = np.zeros(depth.shape, np.uint8)
    h, w = thing.mask.shape
    t, s = max(top, thing.top), max(left, thing.left)
    b = min(top + depth.shape[0], thing.top + h)
    r = min(left + depth.shape[1], thing.left + w)
    if b > t and r > s:
        own = thing.mask[t - thing.top : b - thing.top, s - thing.left : r - thing.left]
        mask[t - top : b - top, s - left : r - left] = own
    matched, both, excess, drawn, gaps = _compared(
        left, top, depth, mask, scene.image.depth, scene.image.smooth
    )
    total = thing.pixels + excess
    residual = float(np.median(gaps)) if len(gaps) else float("nan")
    return Likeness(float(matched / max(total, 1.0)), residual, float(both / max(drawn, 1.0)))


@kernel
def _compared(
    left: int, top: int, drawn: Floats, mask: Array, raw: Floats, smooth: Floats
) -> tuple[float, int, int, int, Floats]:
    """Return matching pixels, those on both, those seen through, all drawn, and the gaps [m]."""
    h, w = drawn.shape
    gaps = np.empty(h * w, np.float32)
    matched, both, excess, count = 0.0, 0, 0, 0
    for j in range(h):
        for i in range(w):
            z = drawn[j, i]
            if z >= NOTHING:
                continue
            count += 1
            v, u = top + j, left + i
            measured = smooth[v, u] if smooth[v, u] > 0.0 else raw[v, u]
            if mask[j, i] == 1:
                gap = abs(measured - z)
                gaps[both] = gap
                both += 1
                matched += 1.0 / (1.0 + (gap / _SPREAD) * (gap / _SPREAD))
            elif measured > z + _BEHIND:
                excess += 1
    return matched, both, excess, count, gaps[:both]
