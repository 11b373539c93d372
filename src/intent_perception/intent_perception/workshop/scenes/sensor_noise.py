"""Noise of a Kinect-like RGB-D camera on rendered images."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.geometry.camera import ColorImage, DepthImage


@dataclass(frozen=True)
class KinectNoise:
    """Strengths of the noise; the axial part is Nguyen et al., 3DIMPVT 2012."""

    axial_floor: float = 0.0012
    """Standard deviation of depth at 0.4 m [m]."""
    axial_growth: float = 0.0019
    """Growth of that standard deviation with (z - 0.4 m)² [1/m]."""
    axial_correlation: float = 0.8
    """Standard deviation of the blur that makes axial noise alike in neighbours [pixel]."""
    lateral: float = 0.8
    """Standard deviation of the sideways shift of edges [pixel]."""
    grazing: float = 75.0
    """Angle of incidence at which half of the measurements are lost [deg]."""
    grazing_width: float = 5.0
    """Angle over which the loss grows [deg]."""
    edge_dropout: float = 0.25
    """Share of measurements lost within a pixel of a depth edge."""
    edge_step: float = 0.02
    """Step of depth that is an edge [m]."""
    dropout: float = 0.002
    """Share of measurements lost anywhere."""
    resolution: float = 0.001
    """Step of the stored depth [m]."""
    nearest: float = 0.4
    """Nothing nearer is measured [m]."""
    farthest: float = 4.5
    """Nothing farther is measured [m]."""
    image: float = 4.0
    """Standard deviation of each colour channel, of 255."""
    image_blur: float = 0.6
    """Standard deviation of the lens's blur [pixel]."""
    shot: float = 0.15
    """Noise that grows with the root of the brightness, of 255."""

    def __post_init__(self) -> None:
        """Refuse impossible strengths."""
        for name, value in vars(self).items():
            if not np.isfinite(value) or value < 0.0:
                raise ValueError(f"expected {name} at least 0, got {value}")

    def axial(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the standard deviation of depth (H, W) [m] at each pixel."""
        deviation = np.float32(self.axial_floor) + np.float32(self.axial_growth) * (
            depth - np.float32(0.4)
        ) ** np.float32(2.0)
        return deviation.astype(np.float32)


def observe(
    depth: DepthImage,
    color: ColorImage,
    rng: np.random.Generator,
    noise: KinectNoise | None = None,
    fx: float = 525.0,
) -> tuple[DepthImage, ColorImage]:
    """Return depth and colour as the sensor would have measured them.

    Args:
        depth: (H, W) true depth [m]; 0 = nothing there.
        color: (H, W, 3) true RGB.
        rng: source of all noise.
        noise: strengths.
        fx: focal length [pixel], for angles of incidence.

    Returns:
        depth (H, W) [m], whole multiples of the resolution (float32(mm) / float32(1000), so that
        16-bit and float storage agree), 0 = lost; and colour (H, W, 3).
    """
    noise = noise or KinectNoise()
    return _noisy_depth(depth, rng, noise, fx), _noisy_color(color, rng, noise)


def _noisy_depth(
    depth: DepthImage, rng: np.random.Generator, noise: KinectNoise, fx: float
) -> DepthImage:
    shifted = _shifted(depth, rng, noise.lateral)
    lost = _lost(depth, shifted, rng, noise, fx)
    error = rng.standard_normal(depth.shape, dtype=np.float32)
    if noise.axial_correlation > 0.0:
        error = cv2.GaussianBlur(error, (0, 0), noise.axial_correlation)
        error /= max(float(error.std()), 1e-6)
    measured = shifted + noise.axial(shifted) * error
    lost |= (measured < noise.nearest) | (measured > noise.farthest) | (shifted <= 0.0)
    measured[lost] = 0.0
    steps = np.rint(measured * np.float32(1000.0) / np.float32(noise.resolution * 1000.0))
    millimetres = steps * np.float32(noise.resolution * 1000.0)
    stored: DepthImage = millimetres.astype(np.float32) / np.float32(1000.0)
    return stored


def _shifted(depth: DepthImage, rng: np.random.Generator, deviation: float) -> DepthImage:
    """Return depth in which each pixel looks a little beside itself: edges become ragged."""
    height, width = depth.shape
    shift = np.rint(rng.standard_normal((2, height, width), dtype=np.float32) * deviation)
    rows, columns = np.indices(depth.shape, dtype=np.int32)
    rows = np.clip(rows + shift[0].astype(np.int32), 0, height - 1)
    columns = np.clip(columns + shift[1].astype(np.int32), 0, width - 1)
    jittered = depth[rows, columns]
    # On smooth surfaces the shift would only add depth noise on slopes, which is axial noise.
    far, near = _extremes(depth)
    result: DepthImage = np.where(far - near > 0.01, jittered, depth)
    return result


def _extremes(depth: DepthImage) -> tuple[DepthImage, DepthImage]:
    window = np.ones((5, 5), np.uint8)
    return np.asarray(cv2.dilate(depth, window)), np.asarray(cv2.erode(depth, window))


def _lost(
    depth: DepthImage,
    shifted: DepthImage,
    rng: np.random.Generator,
    noise: KinectNoise,
    fx: float,
) -> NDArray[np.bool_]:
    """Return the pixels (H, W) without a measurement."""
    slope_u, slope_v = _slope(depth, 1), _slope(depth, 0)
    # Tangent of the angle between the line of sight and the normal: depth per sideways metre.
    tangent = np.hypot(slope_u, slope_v) * np.float32(fx) / np.maximum(depth, np.float32(0.1))
    angle = np.degrees(np.arctan(tangent))
    chance = 1.0 / (1.0 + np.exp(-(angle - noise.grazing) / max(noise.grazing_width / 4.0, 1e-3)))
    step = cv2.morphologyEx(depth, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    edge = step > noise.edge_step
    chance = np.where(edge, noise.edge_dropout, chance) + noise.dropout
    return np.asarray((rng.random(depth.shape, dtype=np.float32) < chance) | (shifted <= 0.0))


def _slope(depth: DepthImage, axis: int) -> DepthImage:
    """Return the change of depth per pixel (H, W), on the smoother side of each pixel."""
    step = np.abs(np.diff(depth, axis=axis))
    before = np.concatenate([np.take(step, [0], axis=axis), step], axis=axis)
    after = np.concatenate([step, np.take(step, [-1], axis=axis)], axis=axis)
    # Across an outline there is a step of depth but no slope of the surface.
    smoother: DepthImage = np.minimum(before, after)
    return smoother


def _noisy_color(color: ColorImage, rng: np.random.Generator, noise: KinectNoise) -> ColorImage:
    image = color.astype(np.float32)
    if noise.image_blur > 0.0:
        image = cv2.GaussianBlur(image, (0, 0), noise.image_blur)
    deviation = np.sqrt(noise.image**2 + noise.shot**2 * image)
    image += deviation * rng.standard_normal(image.shape, dtype=np.float32)
    noisy: ColorImage = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return noisy
