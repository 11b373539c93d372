"""A point cloud of one viewpoint (a laser scan) -> the depth image seen from there."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_bytes
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.transforms import inverse, look_at, transform_points

_UNITS = {"m": 1.0, "mm": 0.001}
_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_FACING_ORIGIN = 0.9  # share of normals towards the origin of a scan in sensor coordinates
_POINTS_PER_PIXEL = 1.4


@dataclass(frozen=True, eq=False)
class CloudView:
    """A cloud seen as a depth image."""

    frame: RgbdFrame
    """Depth and a grey colour image."""
    T_cloud_camera: Array
    """(4, 4) camera of the frame -> frame of the cloud."""


def read_cloud(path: Path, unit: str) -> tuple[Array, Array]:
    """Return points (N, 3) [m] and unit normals (N, 3) of a PLY file.

    Raises:
        ValueError: if it is no PLY file, has no normals, or its size does not fit its unit.
    """
    if unit not in _UNITS:
        raise ValueError(f"expected unit m or mm, got {unit!r}")
    columns = _ply_vertices(path)
    missing = [name for name in ("x", "y", "z", "nx", "ny", "nz") if name not in columns]
    if missing:
        raise ValueError(f"expected points with normals, {path} lacks {', '.join(missing)}")
    points = np.stack([columns[name] for name in ("x", "y", "z")], axis=1) * _UNITS[unit]
    normals = np.stack([columns[name] for name in ("nx", "ny", "nz")], axis=1)
    length = np.linalg.norm(normals, axis=1)
    good = np.isfinite(points).all(axis=1) & np.isfinite(length) & (length > 0.0)
    if good.sum() < 100:
        raise ValueError(f"expected a cloud, {path} has {int(good.sum())} points with normals")
    points, normals = points[good], normals[good] / length[good, None]
    extent = float(np.ptp(points, axis=0).max())
    if not 0.02 < extent < 20.0:
        raise ValueError(
            f"{path} would be {extent:.3g} m wide in {unit}: is its unit "
            f"{'mm' if unit == 'm' else 'm'}?"
        )
    return points, normals


def view_cloud(points: Array, normals: Array) -> CloudView:
    """Return a cloud as its scanner saw it.

    The scanner is at the origin if nearly all normals point there, else far away in the direction
    of the mean normal.

    Args:
        points: (N, 3) [m].
        normals: (N, 3) towards the scanner.
    """
    center = np.median(points, axis=0)
    extent = float(np.ptp(points, axis=0).max())
    towards = np.einsum("ij,ij->i", normals, -points) > 0.0
    distance = float(np.linalg.norm(center))
    if towards.mean() > _FACING_ORIGIN and distance > 0.3 * extent:
        eye = np.zeros(3)
    else:
        mean = normals.mean(axis=0)
        eye = center + 3.0 * extent * mean / np.linalg.norm(mean)
    forward = center - eye
    up = np.eye(3)[1] if abs(forward[1]) < 0.8 * np.linalg.norm(forward) else np.eye(3)[2]
    T_cloud_camera = look_at(eye, center, up)
    seen = transform_points(inverse(T_cloud_camera), points)
    seen = seen[seen[:, 2] > 0.05]
    flat = seen[:, :2] / seen[:, 2:]
    low, high = np.quantile(flat, [0.001, 0.999], axis=0)
    focal = float(np.sqrt(len(seen) / _POINTS_PER_PIXEL / np.prod(high - low)))
    width, height = (int(n) for n in np.ceil((high - low) * focal) + 8)
    camera = Camera(width, height, focal, focal, 4.0 - low[0] * focal, 4.0 - low[1] * focal)
    depth = _splatted(seen, camera)
    grey = np.full((*depth.shape, 3), 128, np.uint8)
    return CloudView(RgbdFrame(0, grey, depth, camera), T_cloud_camera)


def _splatted(points: Array, camera: Camera) -> NDArray[np.float32]:
    pixel = np.rint(camera.project(points)).astype(np.int64)
    inside = ((pixel >= 0) & (pixel < [camera.width, camera.height])).all(axis=1)
    pixel, z = pixel[inside], points[inside, 2].astype(np.float32)
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    np.minimum.at(depth, (pixel[:, 1], pixel[:, 0]), z)
    depth[np.isinf(depth)] = 0.0
    # pixels between two scan lines
    filled = median_filter(depth, 3)
    return np.where(depth > 0.0, depth, filled)


def _ply_vertices(path: Path) -> dict[str, Array]:
    """Return the scalar properties of the vertices of a PLY file."""
    try:
        return _columns(path)
    except (IndexError, KeyError, TypeError, OverflowError) as error:
        raise ValueError(f"{path} is damaged or no PLY file of points: {error!r}") from error


def _columns(path: Path) -> dict[str, Array]:
    content = read_bytes(path)
    end = content.find(b"end_header")
    if not content.startswith(b"ply") or end < 0:
        raise ValueError(f"expected a PLY file, {path} is none")
    words = [line.split() for line in content[:end].decode("ascii", "replace").splitlines()]
    encoding = next((w[1] for w in words if w and w[0] == "format"), "")
    elements = [k for k, w in enumerate(words) if w and w[0] == "element"]
    if not elements or words[elements[0]][1] != "vertex":
        raise ValueError(f"expected vertices first in {path}")
    count = int(words[elements[0]][2])
    stop = elements[1] if len(elements) > 1 else len(words)
    fields = [(w[2], w[1]) for w in words[elements[0] + 1 : stop] if w and w[0] == "property"]
    body = content[content.index(b"\n", end) + 1 :]
    if encoding == "ascii":
        rows = [line.split() for line in body.split(b"\n", count)[:count]]
        values = np.array(rows, dtype=np.float64)
    else:
        order = "<" if encoding == "binary_little_endian" else ">"
        kind = np.dtype([(name, order + _PLY_TYPES[kind]) for name, kind in fields])
        if len(body) < kind.itemsize * count:
            raise ValueError(f"{path} is cut off: {len(body)} bytes for {count} points")
        table = np.frombuffer(body, kind, count)
        values = np.stack([table[name].astype(np.float64) for name, _ in fields], axis=1)
    return {name: values[:, k] for k, (name, _) in enumerate(fields)}
