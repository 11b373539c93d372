"""Depth image -> points with normals at every pixel, the scene as the recogniser sees it.

A plane n.p = d seen by a pinhole camera is linear in the image, 1/z = a u + b v + c. Fitting that
line by least squares in a window gives the normal and a smoothed depth in closed form, without an
eigenvalue problem per pixel.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from intent_perception.basics.arrays import Floats, Mask
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.camera import Camera, RgbdFrame


@dataclass(frozen=True, eq=False)
class OrientedImage:
    """Points and normals of one depth image, in camera coordinates [m]."""

    camera: Camera
    """Intrinsics of the images below, which may be a reduced copy of the sensor's."""
    depth: Floats
    """(H, W) as measured; 0 = no measurement."""
    smooth: Floats
    """(H, W) depth of the plane fitted around each pixel; 0 where none could be fitted."""
    normals: Floats
    """(H, W, 3) unit normals towards the camera; zero where none could be fitted."""
    color: Floats
    """(H, W, 3) RGB in 0..1."""
    stride: int
    """Sensor pixels per pixel of these images."""

    @property
    def valid(self) -> Mask:
        """(H, W) whether the pixel has a point and a normal."""
        return self.smooth > 0.0

    def points(self) -> Floats:
        """Return the smoothed points (H, W, 3) in camera coordinates [m]."""
        return self.camera.backproject(self.smooth).astype(np.float32)


def orient(frame: RgbdFrame, focal_length: float, radius: float, max_depth: float) -> OrientedImage:
    """Return points and normals of a frame, reduced to about the given focal length.

    Args:
        frame: the RGB-D frame.
        focal_length: [pixel]; a sensor with at least 1.5 times this is reduced by a whole factor.
        radius: half the edge of the window in which a plane is fitted [m].
        max_depth: what is measured beyond is no surface to look at, but shows that nothing is in
            front of it [m].
    """
    stride = max(1, round(frame.camera.fx / focal_length))
    depth = np.ascontiguousarray(frame.depth[stride // 2 :: stride, stride // 2 :: stride])
    color = frame.color
    if stride > 1:
        color = cv2.blur(color, (stride, stride))[stride // 2 :: stride, stride // 2 :: stride]
    camera = _strided(frame.camera, stride, depth.shape)
    near = np.where(depth < max_depth, depth, np.float32(0.0))
    smooth, normals = fit_planes(
        near, camera.fx, camera.fy, camera.cx, camera.cy, np.float32(radius)
    )
    return OrientedImage(camera, depth, smooth, normals, color.astype(np.float32) / 255.0, stride)


def _strided(camera: Camera, stride: int, shape: tuple[int, ...]) -> Camera:
    first = stride // 2
    return Camera(
        shape[1],
        shape[0],
        camera.fx / stride,
        camera.fy / stride,
        (camera.cx - first) / stride,
        (camera.cy - first) / stride,
    )


@kernel
def fit_planes(  # noqa: PLR0915 (one kernel)
    depth: Floats, fx: float, fy: float, cx: float, cy: float, radius: float
) -> tuple[Floats, Floats]:
    """Return smoothed depth (H, W) and normals (H, W, 3) from planes fitted around each pixel.

    Pixels whose depth differs by more than twice the window's radius belong to another surface and
    are left out; fewer than 8 pixels, or pixels on one line, give no plane.
    """
    height, width = depth.shape
    smooth = np.zeros((height, width), np.float32)
    normals = np.zeros((height, width, 3), np.float32)
    for row in range(height):
        for column in range(width):
            z = depth[row, column]
            if z <= 0.0:
                continue
            reach = min(9, max(2, int(fx * radius / z + 0.5)))
            step = 1 if reach < 5 else 2
            tolerance = 2.0 * radius
            center = 1.0 / z
            n = 0.0
            su = sv = sw = suu = suv = svv = suw = svw = 0.0
            for dv in range(-reach, reach + 1, step):
                j = row + dv
                if j < 0 or j >= height:
                    continue
                for du in range(-reach, reach + 1, step):
                    i = column + du
                    if i < 0 or i >= width:
                        continue
                    q = depth[j, i]
                    if q <= 0.0 or abs(q - z) > tolerance:
                        continue
                    w = 1.0 / q - center
                    n += 1.0
                    su += du
                    sv += dv
                    sw += w
                    suu += du * du
                    suv += du * dv
                    svv += dv * dv
                    suw += du * w
                    svw += dv * w
            if n < 8.0:
                continue
            uu = suu - su * su / n
            uv = suv - su * sv / n
            vv = svv - sv * sv / n
            uw = suw - su * sw / n
            vw = svw - sv * sw / n
            det = uu * vv - uv * uv
            if det < 0.05 * (uu + vv) * (uu + vv) / 4.0:
                continue
            a = (vv * uw - uv * vw) / det
            b = (uu * vw - uv * uw) / det
            c = center + (sw - a * su - b * sv) / n
            if c <= 0.0:
                continue
            nx = a * fx
            ny = b * fy
            nz = c + a * (cx - column) + b * (cy - row)
            norm = np.sqrt(nx * nx + ny * ny + nz * nz)
            smooth[row, column] = 1.0 / c
            normals[row, column, 0] = -nx / norm
            normals[row, column, 1] = -ny / norm
            normals[row, column, 2] = -nz / norm
    return smooth, normals
