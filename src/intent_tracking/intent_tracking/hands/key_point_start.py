"""A hand pose from the key points of one frame: our hand's inverse kinematics.

The networks' key points are not our joints: offsets are learned once, see `KEY_POINT_OFFSETS`.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.transforms import Array, rotation_between
from intent_tracking.hands.key_point_kernel import KeyPointTarget, KeyPointWeights, fit_key_points
from intent_tracking.hands.seen_hand import SeenHand
from intent_tracking.hands.skin_depth import skin_depth, with_bones
from intent_tracking.scene.body_state import BodyState, orthonormal
from intent_tracking.scene.hand_kernel import HandArrays
from intent_tracking.scene.hand_model import FITTED_LIMITS, HandModel, Side
from intent_tracking.scene.posture_prior import shipped_posture

KEY_POINT_OFFSETS: Array = np.zeros((21, 3))
_PALM = [0, 5, 9, 13, 17]


@dataclass(frozen=True, eq=False)
class KeyPointConfig:
    """How much is believed of what."""

    iterations: int = 16
    pixel: float = 0.03
    shape: float = 0.012
    depth: float = 0.010
    limit: float = 0.05
    posture: float = 0.15
    size: float = 0.06
    thumb: float = 0.5
    wrist: float = 0.5
    ray: bool = True
    doubt: float = 0.2


@dataclass(frozen=True, eq=False)
class KeyPointStart:
    side: Side
    state: BodyState
    cost: float
    size: float


def starts_from_key_points(seen, frame, hands, config, offsets=None):
    offsets = KEY_POINT_OFFSETS if offsets is None else offsets
    sides = [s for s in hands if (seen.right > config.doubt if s == "right" else seen.right < 1 - config.doubt)]
    found = [_start(seen, frame, side, *hands[side], config, offsets) for side in sides]
    return sorted(found, key=lambda start: start.cost)


def _start(seen, frame, side, model, arrays, config, offsets):
    camera = frame.camera
    mirror = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
    offsets = offsets * mirror
    rest = model.joint_positions(np.zeros(20)) + offsets
    palm = rest[_PALM]
    ahead = np.array([camera.cx, camera.cy])
    rays = np.column_stack([(seen.pixels - ahead) / [camera.fx, camera.fy], np.ones(21)])
    middle = rays[_PALM].mean(axis=0)
    about = seen.shape - seen.shape[_PALM].mean(axis=0)
    about = about * (_spread(palm) / _spread(about[_PALM]))
    if config.ray:
        about = about @ rotation_between([0.0, 0.0, 1.0], middle).T
    by_size = _spread_all(about[:, :2]) / _spread_all(rays[:, :2])
    half = max(1, round(0.012 * seen.square.side))
    samples, z = skin_depth(frame.depth, with_bones(seen.pixels), with_bones(about)[:, 2], by_size, half)
    start_rotation = _turned(palm, about[_PALM])
    state = np.zeros(27, np.float32)
    state[6:26] = shipped_posture().mean
    state[:3] = middle * (z + 0.01) - start_rotation @ palm.mean(axis=0)
    rotation = np.ascontiguousarray(start_rotation, dtype=np.float32)
    trust = np.ones(21)
    trust[0] = config.wrist
    trust[1:5] = config.thumb
    radii = np.full(41, 0.008)
    radii[[0, 5, 9, 13, 17]] = 0.012
    radii[21::4] = 0.014
    target = KeyPointTarget(np.ascontiguousarray(rays[:, :2]), trust, about, samples, radii, offsets, FITTED_LIMITS, shipped_posture())
    weights = KeyPointWeights(config.pixel / z *0.15, config.shape, config.depth, config.limit, config.posture, config.size)
    cost = fit_key_points(arrays, target, weights, state, rotation, config.iterations)
    body = BodyState(state[:26].copy(), orthonormal(rotation).astype(np.float32)[None])
    return KeyPointStart(side, body, float(cost), float(np.exp(state[26])))


def _spread(points):
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum()))


_spread_all = _spread


def _turned(source, target):
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    sign = np.sign(np.linalg.det(left @ right))
    return (left * [1.0, 1.0, sign] @ right).T
