"""Triangles -> depth, as a kernel that other kernels call for one model in a small window."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel

Corner = tuple[np.float32, np.float32, np.float32]

NOTHING = np.float32(1e6)
"""Depth of a pixel on which nothing is drawn (fast arithmetic knows no infinity)."""
_NEAREST = np.float32(0.05)  # depth before which nothing is drawn [m]
_ON_EDGE = np.float32(1e-3)  # so near to an edge a pixel belongs to both its triangles [pixel]


@kernel
def rasterize(
    vertices: Floats,
    faces: NDArray[np.int32],
    intrinsics: Floats,
    depth: Floats,
) -> None:
    """Draw triangles into a depth image, keeping the nearest.

    1/z is linear in the image: it is what is drawn and compared, row by row between the edges.

    Args:
        vertices: (V, 3) in camera coordinates [m].
        faces: (F, 3) indices of vertices.
        intrinsics: (4,) fx, fy, cx, cy of the window.
        depth: (h, w) out [m], NOTHING where no triangle is.
    """
    image = np.empty((len(vertices), 3), np.float32)
    _project(vertices, intrinsics, image)
    depth[:] = 0.0
    for f in range(len(faces)):
        a, b, c = _of(image, faces[f, 0]), _of(image, faces[f, 1]), _of(image, faces[f, 2])
        if a[2] > 0.0 and b[2] > 0.0 and c[2] > 0.0:
            _draw(a, b, c, depth)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            w = depth[row, column]
            depth[row, column] = np.float32(1.0) / w if w > 0.0 else NOTHING


@borrowing_kernel
def _project(vertices: Floats, intrinsics: Floats, image: Floats) -> None:
    """Write column, row and 1/z of vertices (V, 3) into image (V, 3); 1/z = 0: too near."""
    fx, fy, cx, cy = intrinsics
    for i in range(len(vertices)):
        w = np.float32(1.0) / vertices[i, 2] if vertices[i, 2] >= _NEAREST else np.float32(0.0)
        image[i, 0] = fx * vertices[i, 0] * w + cx
        image[i, 1] = fy * vertices[i, 1] * w + cy
        image[i, 2] = w


@borrowing_kernel
def _of(image: Floats, vertex: int) -> Corner:
    return image[vertex, 0], image[vertex, 1], image[vertex, 2]


@borrowing_kernel
def _draw(a: Corner, b: Corner, c: Corner, inverse: Floats) -> None:
    """Draw a triangle of corners column, row, 1/z into an image (h, w) of 1/z."""
    height, width = inverse.shape
    top = max(0, int(np.ceil(min(a[1], b[1], c[1]))))
    bottom = min(height - 1, int(np.floor(max(a[1], b[1], c[1]))))
    left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
    if top > bottom or np.ceil(left) > np.floor(right) or right < 0.0 or left > width - 1:
        return
    area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    if area == 0.0:
        return
    scale = np.float32(1.0) / area
    du = ((c[1] - a[1]) * (b[2] - a[2]) - (b[1] - a[1]) * (c[2] - a[2])) * scale
    dv = ((b[0] - a[0]) * (c[2] - a[2]) - (c[0] - a[0]) * (b[2] - a[2])) * scale
    ab, bc, ca = _slope(a, b), _slope(b, c), _slope(c, a)
    # the inside lies to the left of edges that go down, and to the right of those that go up
    turn = np.float32(1.0) if area > 0.0 else np.float32(-1.0)
    for row in range(top, bottom + 1):
        low, high = _cut(a, ab, turn * (b[1] - a[1]), row, left, right)
        low, high = _cut(b, bc, turn * (c[1] - b[1]), row, low, high)
        low, high = _cut(c, ca, turn * (a[1] - c[1]), row, low, high)
        first = max(0, int(np.ceil(low - _ON_EDGE)))
        last = min(width - 1, int(np.floor(high + _ON_EDGE)))
        start = a[2] + dv * (row - a[1]) - du * a[0]
        for column in range(first, last + 1):
            inverse[row, column] = max(inverse[row, column], start + du * column)


@borrowing_kernel
def _slope(a: Corner, b: Corner) -> np.float32:
    """Return how far the edge from a to b goes to the right in a row; 0 of a level one."""
    down = b[1] - a[1]
    return (b[0] - a[0]) / down if down != 0.0 else np.float32(0.0)


@borrowing_kernel
def _cut(
    corner: Corner, slope: np.float32, down: np.float32, row: int, low: np.float32, high: np.float32
) -> tuple[np.float32, np.float32]:
    """Return what is left of columns low..high of a row beside the edge through a corner."""
    crossed = corner[0] + (row - corner[1]) * slope
    if down > 0.0:
        return low, min(high, crossed)
    if down < 0.0:
        return max(low, crossed), high
    return low, high
