"""The spheres that cover a hand, as the kernels of closing and collision read them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_tracking.scene.joint_table import JointTable

Integers = NDArray[np.int32]
_SPHERE_SPACING = 0.007
"""Distance of the spheres along a capsule and on a box [m]."""
_BOX_SPHERE, _THINNEST = 0.008, 0.003
"""Radius of the spheres that cover a box, and of those that cover a thin one at least [m]."""


class SphereArrays(NamedTuple):
    """A hand as the kernels read it; chain -1 is the palm, else a finger."""

    parents: Integers
    origins: Floats
    """(L, 3, 4) link frames in their parents."""
    axes: Floats
    drivers: Integers
    ratios: Floats
    slides: NDArray[np.bool_]
    """(L,) whether a link slides along its axis."""
    chain_starts: Integers
    """(F + 1,) first link of each finger, then L."""
    sphere_links: Integers
    sphere_centers: Floats
    sphere_radii: Floats
    sphere_starts: Integers
    """(L + 1,) first sphere of each link."""
    joint_chains: Integers
    """(J,) finger that a joint moves, -1 if none or several."""
    lower: Floats
    upper: Floats
    follows: Integers
    """(J,) joint that bounds this one, -1 if none."""
    follow_ratio: float
    follow_slack: float
    collide: NDArray[np.bool_]
    """(F, F) which fingers must not penetrate one another."""


def spheres_of(table: JointTable) -> tuple[Integers, Floats, Floats]:
    """Return spheres on capsules and boxes: links (S,), centres (S, 3), radii (S,)."""
    links: list[int] = []
    centers: list[Array] = []
    radii: list[float] = []
    shapes = table.capsules
    for link, ends, radius in zip(shapes.links, shapes.ends, shapes.radii, strict=True):
        length = float(np.linalg.norm(ends[1] - ends[0]))
        count = max(2, int(np.ceil(length / _SPHERE_SPACING)) + 1)
        for share in np.linspace(0.0, 1.0, count):
            links.append(int(link))
            centers.append(ends[0] + share * (ends[1] - ends[0]))
            radii.append(float(radius))
    for link, pose, half in zip(
        table.boxes.links, table.boxes.poses, table.boxes.half_sizes, strict=True
    ):
        radius = float(np.clip(half.min(), _THINNEST, _BOX_SPHERE))
        for point in _box_grid(np.maximum(half - radius, 0.0), radius):
            links.append(int(link))
            centers.append(pose[:3, :3] @ point + pose[:3, 3])
            radii.append(radius)
    order = np.argsort(links, kind="stable")
    return (
        np.array(links, dtype=np.int32)[order],
        np.array(centers, dtype=np.float32)[order],
        np.array(radii, dtype=np.float32)[order],
    )


def _box_grid(half: Array, radius: float) -> Array:
    """Return points (N, 3) on the surface of a box of half edges `half`, about 2 radii apart."""
    counts = np.where(half > 0.0, np.maximum(2, np.ceil(half / radius).astype(int) + 1), 1)
    axes = [np.linspace(-h, h, n) for h, n in zip(half, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(grid[np.any(np.abs(np.abs(grid) - half) < 1e-9, axis=1)])
