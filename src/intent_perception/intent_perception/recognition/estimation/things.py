"""Things: what stands apart from everything else on the table, known or not."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats, Mask
from intent_perception.basics.kernels import kernel
from intent_perception.scene.scene_view import SceneView

_CELL = 0.004
"""Edge of the cells of the table in which points are counted [m]."""
_LEAST_IN_CELL = 2
"""Fewer points in a cell fly at an edge."""
_SMALLEST = 60
"""Fewer pixels are noise."""
_MOST_THINGS = 12
"""The largest of a scene, each of which takes time: crumbs and noise may be hundreds."""
_MOST = 1400
"""Points of a thing that fits look at."""
_LEAST_HEIGHT = 0.010
"""What reaches no higher is a mark or a sheet on the table [m]."""
_FLATTEST, _MUCH_FLAT = 0.006, 120
"""Unless so many points beside it have another colour than the table [m]."""
_JUMP = 0.02
"""A neighbour nearer to the camera by this hides what is behind it [m]."""
_RAISED, _TOUCH, _REACHED = 0.008, 0.03, 0.10
"""Height of an arm, its distance behind a thing that it touches [m], share of the outline."""
_BORDER, _BESIDE = 3, 5
_ENOUGH = 4000
"""More pixels do not make the table's colour better known."""
_TABLE_COLOR = 7.0
"""Colours this many times further from the table's own than those spread are another thing's."""
_REACH = 0.25
"""How far from a low thing its parts that are as flat as the table may lie [m]."""
_LOW = 0.05
"""Things that reach higher have no flat parts [m]."""
_FLAT = 0.007
"""What is flat is no higher [m]."""
_LEAST_FLAT = 40


@dataclass(frozen=True, eq=False)
class SeenThing:
    """One thing, in the frame `table`."""

    left: int
    """Column of the window's first pixel."""
    top: int
    """Row of the window's first pixel."""
    mask: Mask
    """(h, w) its pixels."""
    points: Array
    """(N, 3) of its surface [m]."""
    normals: Array
    """(N, 3) unit."""
    eye: Array
    """(3,) where the camera is [m]."""
    color: Array
    """(3,) RGB in 0..1."""
    hidden: float
    """Share of its outline at which something nearer may hide more of it, or the image ends."""
    flat: Array
    """(M, 3) points of the table that have a thing's colour and touch it [m]."""

    @property
    def window(self) -> tuple[slice, slice]:
        """Rows and columns of the image that `mask` covers."""
        height, width = self.mask.shape
        return slice(self.top, self.top + height), slice(self.left, self.left + width)

    @property
    def pixels(self) -> int:
        """Pixels on which it is seen."""
        return int(self.mask.sum())

    @property
    def height(self) -> float:
        """How high it reaches above the table [m]."""
        return float(np.quantile(self.points[:, 2], 0.99))


def things_in(scene: SceneView, T_table_camera: Array, rng: np.random.Generator) -> list[SeenThing]:
    """Return the things of a scene with a table, the largest if there are very many.

    Args:
        scene: with the pixels that may be objects.
        T_table_camera: (4, 4).
        rng: chooses the points of each.
    """
    labels, count = _apart(scene, T_table_camera)
    sizes = np.bincount(labels.ravel(), minlength=count)
    sizes[0] = 0  # no thing
    large = np.flatnonzero(sizes >= _SMALLEST)
    large = np.sort(large[np.argsort(-sizes[large], kind="stable")[:_MOST_THINGS]])
    found = []
    for number in large:
        mask = labels == number
        if not _reached_for(scene, mask):
            thing = thing_of(scene, mask, T_table_camera, rng)
            flat = thing.height >= _FLATTEST and len(thing.flat) >= _MUCH_FLAT
            if thing.height >= _LEAST_HEIGHT or flat:
                found.append(thing)
    return found


def _apart(scene: SceneView, T_table_camera: Array) -> tuple[NDArray[np.int32], int]:
    """Return labels (H, W) of what stands apart, seen from above; 0 = nothing."""
    rows, columns = np.nonzero(scene.parts.mask == 1)
    points = scene.points[rows, columns].astype(np.float64)
    flat = points @ T_table_camera[:2, :3].T + T_table_camera[:2, 3]
    labels = np.zeros(scene.shape, np.int32)
    if len(flat) == 0:
        return labels, 1
    cells = np.floor((flat - flat.min(axis=0)) / _CELL).astype(np.int64)
    size = cells.max(axis=0) + 1
    if np.prod(size) > 4_000_000:
        return labels, 1
    counts = np.zeros(tuple(size), np.int32)
    np.add.at(counts, (cells[:, 0], cells[:, 1]), 1)
    filled = (counts >= _LEAST_IN_CELL).astype(np.uint8)
    closed = cv2.morphologyEx(filled, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, above = cv2.connectedComponents(closed, connectivity=8)
    labels[rows, columns] = above[cells[:, 0], cells[:, 1]]
    return labels, int(count)


def _reached_for(scene: SceneView, mask: Mask) -> bool:
    """Return whether something that is no thing, such as an arm, touches or covers one.

    What is left of it beside a hand tells nothing of its shape.
    """
    near = _window(mask)
    mask, smooth = mask[near], scene.image.smooth[near]
    raised = (scene.parts.height[near] > _RAISED) & (scene.parts.mask[near] == 0)
    ring = (cv2.dilate(mask.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0) & ~mask
    own = cv2.dilate(np.where(mask, smooth, np.float32(0.0)), np.ones((5, 5)))
    touching = ring & raised & (smooth < own + _TOUCH)
    return bool(touching.sum() > _REACHED * ring.sum())


def _window(mask: Mask) -> tuple[slice, slice]:
    """Return rows and columns of the pixels (H, W), and of those that are looked at beside them."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    low = max(0, int(rows[0]) - _BESIDE), max(0, int(columns[0]) - _BESIDE)
    high = int(rows[-1]) + 1 + _BESIDE, int(columns[-1]) + 1 + _BESIDE
    return slice(low[0], high[0]), slice(low[1], high[1])


def thing_of(
    scene: SceneView, mask: Mask, T_table_camera: Array, rng: np.random.Generator
) -> SeenThing:
    """Return the thing of some pixels (H, W); the other arguments are those of `things_in`."""
    rows, columns = np.nonzero(mask)
    top, left = int(rows.min()), int(columns.min())
    bottom, right = int(rows.max()) + 1, int(columns.max()) + 1
    seen = np.arange(len(rows))
    if len(rows) > _MOST:
        seen = np.sort(rng.choice(len(rows), _MOST, replace=False))
    rotation, eye = T_table_camera[:3, :3], T_table_camera[:3, 3]
    points = scene.points[rows[seen], columns[seen]].astype(np.float64) @ rotation.T + eye
    normals = scene.image.normals[rows[seen], columns[seen]].astype(np.float64) @ rotation.T
    color = np.median(scene.image.color[rows, columns], axis=0).astype(np.float64)
    return SeenThing(
        left,
        top,
        np.ascontiguousarray(mask[top:bottom, left:right]),
        points,
        normals,
        eye.copy(),
        color,
        _hidden(scene, mask),
        _flat_parts(scene, mask, T_table_camera, float(points[:, 2].max())),
    )


def _hidden(scene: SceneView, mask: Mask) -> float:
    """Return the share of a thing's outline behind which it may go on."""
    inside = mask[_BORDER:-_BORDER, _BORDER:-_BORDER]
    ends = int(mask.sum()) - int(inside.sum())
    near = _window(mask)
    mask, depth = mask[near], scene.image.depth[near]
    grown = cv2.dilate(mask.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    own = np.where(mask, scene.image.smooth[near], np.float32(0.0))
    nearest = cv2.dilate(own, np.ones((9, 9), np.uint8))
    around = grown & ~mask
    hides = around & (depth > 0.0) & (depth < nearest - _JUMP) & (scene.parts.mask[near] == 1)
    return float((hides.sum() / 3.0 + ends) / max(around.sum() / 3.0 + ends, 1.0))


def _flat_parts(scene: SceneView, mask: Mask, T_table_camera: Array, height: float) -> Array:
    """Return the points (M, 3) of what lies as flat as the table beside a low thing [m].

    A blade of two millimetres is no higher than the sensor's noise, but it has not the table's
    colour. Shadows have: darker, of one hue with it.
    """
    nothing = np.zeros((0, 3))
    if height > _LOW:
        return nothing
    rows, columns = np.nonzero(mask)
    reach = int(
        _REACH * scene.intrinsics[0] / max(float(scene.points[rows, columns, 2].min()), 0.2)
    )
    top, left = max(0, rows.min() - reach), max(0, columns.min() - reach)
    bottom, right = rows.max() + reach, columns.max() + reach
    window = (slice(top, bottom), slice(left, right))
    heights = scene.parts.height[window]
    bare = (scene.parts.mask[window] == 0) & (heights != 0.0) & (np.abs(heights) < _FLAT)
    other = _unlike_table(scene.image.color[window], bare)
    own = mask[window]
    joined = ((other & bare) | own).astype(np.uint8)
    joined = cv2.morphologyEx(joined, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)) | own
    _, labels = cv2.connectedComponents(joined, connectivity=8)
    touching = np.isin(labels, np.unique(labels[own])) & (labels > 0) & bare & other
    points = scene.points[window][touching].astype(np.float64)
    if len(points) < _LEAST_FLAT:
        return nothing
    placed: Array = points @ T_table_camera[:3, :3].T + T_table_camera[:3, 3]
    return placed[:: max(1, len(placed) // _MOST)]


def _unlike_table(color: Floats, bare: Mask) -> Mask:
    """Return the pixels (H, W) of a colour that is neither the table's nor its shadow's."""
    seen = color[bare]
    if len(seen) < 200:
        return np.zeros_like(bare)
    seen = seen[:: len(seen) // _ENOUGH + 1]
    table = np.median(seen, axis=0)
    spread = 1.5 * np.median(np.abs(seen - table), axis=0) + np.float32(0.008)
    return np.asarray(_unlike(color, table, spread))


@kernel
def _unlike(color: Floats, table: Floats, spread: Floats) -> Mask:
    """Return the pixels (H, W) that no shade of the table's colour (3,) comes near, in spreads."""
    height, width = color.shape[:2]
    unlike = np.empty((height, width), np.bool_)
    scaled = table / spread
    length = (scaled * scaled).sum()
    for j in range(height):
        for i in range(width):
            along = np.float32(0.0)
            for k in range(3):
                along += color[j, i, k] / spread[k] * scaled[k]
            # The shade that is nearest to the pixel's.
            shade = min(max(along / length, np.float32(0.35)), np.float32(1.1))
            off, whole = np.float32(0.0), np.float32(0.0)
            for k in range(3):
                off += ((color[j, i, k] - shade * table[k]) / spread[k]) ** 2
                whole += ((color[j, i, k] - table[k]) / spread[k]) ** 2
            unlike[j, i] = off > _TABLE_COLOR**2 and whole > _TABLE_COLOR**2
    return unlike
