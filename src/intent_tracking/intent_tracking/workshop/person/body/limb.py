"""The naked arm behind the hand's own skin."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh

_KNOTS = 60
_SEGMENTS = 40


def bare_arm(T_hand: Array, elbow: Array, shoulder: Array, thickness: float = 1.0) -> Mesh:
    """Return forearm and upper arm, from inside the skin at the wrist to the shoulder.

    Args:
        T_hand: (4, 4) pose of the hand.
        elbow: (3,) in the same frame [m].
        shoulder: (3,) [m].
        thickness: factor on all radii.
    """
    wrist = T_hand[:3, 3]
    forearm = float(np.linalg.norm(wrist - elbow))
    start = wrist + (elbow - wrist) * min(0.075 / forearm, 0.5)
    knots = np.stack([start, elbow, shoulder])
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    at = np.linspace(0.0, steps[-1], _KNOTS)
    path = np.stack([np.interp(at, steps, knots[:, k]) for k in range(3)], axis=1)
    path = gaussian_filter1d(path, 2.0, axis=0, mode="nearest")
    shares = np.array([0.0, 0.05, 0.17, 0.25, 0.32, 0.60]) * steps[1] / 0.25
    sizes = np.array([0.0315, 0.0350, 0.0425, 0.0415, 0.0430, 0.0500]) * thickness
    flats = np.array([0.62, 0.66, 0.85, 0.92, 0.95, 0.98])
    radii, flat = np.interp(at, shares, sizes), np.interp(at, shares, flats)
    return _rings(path, radii, flat, T_hand[:3, 1])


def _rings(path: Array, radii: Array, flat: Array, across: Array) -> Mesh:
    """Return a closed tube whose greater width lies along `across` (3,)."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    u = across - along * (along @ across)[:, None]
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    angle = 2.0 * np.pi * np.arange(_SEGMENTS) / _SEGMENTS
    ring = (radii[:, None] * np.cos(angle))[..., None] * u[:, None]
    ring = ring + ((radii * flat)[:, None] * np.sin(angle))[..., None] * v[:, None]
    vertices = (path[:, None] + ring).reshape(-1, 3)
    i = np.arange(len(path) - 1)[:, None] * _SEGMENTS
    j, k = np.arange(_SEGMENTS), (np.arange(_SEGMENTS) + 1) % _SEGMENTS
    sides = [np.stack([i + j, i + k, i + _SEGMENTS + j], -1),
             np.stack([i + k, i + _SEGMENTS + k, i + _SEGMENTS + j], -1)]  # fmt: skip
    return Mesh.of(vertices, np.concatenate([side.reshape(-1, 3) for side in sides]))
