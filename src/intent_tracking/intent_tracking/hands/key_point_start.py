"""A hand pose from the key points and the depth of one frame: inverse kinematics of our hand.

The networks place their key points by what people see on skin, our joints are axes; the offsets
between the two are constants. Four sources decide: where the key points are in the image, how deep
the skin lies there, what posture is usual (it carries what is hidden), and, weakly, the shape that
the networks guess, which is off by 15-40 mm along the line of sight.

Single frames, no tracking, a hand of unknown size: real recordings 18, 10 and 14 mm (19 joints;
under 30 mm in .84, 1 and 1 of the frames: in the rest that camera measures no depth on the palm but
on the cloth behind it, and nothing in one frame tells), the shipped bags 16, 13 and 12 mm (21
joints, a missed hand as 100 mm), three films that no constant was fitted to 12, 14 and 13 mm. The
side is right in all real frames and in .89-1 of those of the films. 1.9 ms of CPU per start, 2.5
in the worst twentieth.
"""

import math
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_tracking.hands.key_point_kernel import KeyPointTarget, KeyPointWeights, fit_key_points
from intent_tracking.hands.seen_hand import PALM, SeenHand, certainty
from intent_tracking.hands.skin_depth import (
    BONES,
    measured_depth,
    palm_depths,
    skin_depth,
    with_bones,
)
from intent_tracking.image.frame_evidence import KeyEvidence
from intent_tracking.scene.body_state import BodyState, orthonormal
from intent_tracking.scene.hand_kernel import HandArrays, posed_landmarks
from intent_tracking.scene.hand_model import FITTED_LIMITS, HandModel, Side
from intent_tracking.scene.posture_prior import shipped_posture
from intent_tracking.scene.state_layout import JOINTS

KEY_POINT_OFFSETS: Array = 1e-3 * np.array(
    [
        [2, 6, -5],
        *([9, -16, -15], [0, 0, 0], [0, 0, 0], [0, 0, 0]),
        *([-2, 0, -8], [0, 0, -1], [-2, 0, -2], [-2, 1, -3]),
        *([-6, 1, -10], [1, 2, -3], [-1, 2, -3], [-2, 1, -5]),
        *([-8, 0, -8], [0, 2, -1], [-3, 1, 0], [-3, -1, -2]),
        *([-10, 0, -9], [-4, 2, -1], [-3, 0, 0], [-4, 0, -6]),
    ]
)
"""(21, 3) key point minus joint on a right hand, in `hand_wrist` [m].

Knuckles are read on the skin and nearer to the wrist, the thumb's base at the side of the wrist.
Robust means over 750 rendered frames: the shipped bags and six films of seed 77 (two shipped sets
alone differ by 2-4 mm). The outer thumb is read too variably on rendered hands to have a mean.
"""

_KNUCKLE_DEPTH, _METACARPAL_DEPTH, _FINGER_DEPTH = 0.012, 0.014, 0.008
_PATCH = 0.012
"""Half the side of a patch whose depth is sampled [sides of the hand's square]."""


@dataclass(frozen=True, eq=False)
class KeyPointConfig(Checked):
    """How much is believed of what."""

    iterations: int = 16
    """Linearisations of one fit, 1..100."""
    across: float = 0.006
    """Spread of the key points across the line of sight [m], 0.0005..0.1."""
    shape: float = 0.05
    """Spread of the networks' shape [m], 0.001..1."""
    depth: float = 0.010
    """Spread of the skin's depth [m], 0.001..0.2."""
    hidden: float = 2.3
    """Spreads by which the skin may be nearer before something else must be seen there, 0.1..10."""
    limit: float = 0.05
    """Spread beyond the joints' limits [rad], 0.001..1."""
    posture: float = 2.8
    """Weight of the posture prior; above 1, for the errors of a hand's key points are not
    independent, 0..100."""
    usual_size: float = 0.95
    """Of a hand against its model, GraspIt!'s being large; 1 for a calibrated model, 0.5..1.5."""
    size: float = 0.04
    """Spread of the log of the size; less for a calibrated model, 0.001..1."""
    wrist_trust: float = 3.0
    """Weight of the wrist against a finger's key point, 0..100."""
    thumb_trust: float = 0.6
    """Weight of a thumb that is seen, 0..10."""
    hidden_thumb_trust: float = 0.05
    """Weight of one that is read across the fingers or the palm, 0..10."""
    clear_thumb: float = 0.6
    """A thumb is seen if it is read this far from the fingers' bones [mean bones], 0..5."""
    doubt: float = 0.2
    """Probability from which a side is tried, 0..0.49."""
    side: float = 30.0
    """Cost of a side, times -log of its probability, 0..1000."""

    def weights(self, depth: float) -> KeyPointWeights:
        """Return the weights for compiled code of a hand at a depth [m]."""
        return KeyPointWeights(
            self.across / depth,
            self.shape,
            self.depth,
            self.hidden,
            self.limit,
            self.posture,
            math.log(self.usual_size),
            self.size,
        )


@dataclass(frozen=True, eq=False)
class KeyPointStart:
    """A hand pose that explains the key points."""

    side: Side
    state: BodyState
    """Of the hand alone."""
    size: float
    """Of the hand against its model; the state is that of a hand of this size."""
    cost: float
    """What is left unexplained; comparable between the starts of one frame."""
    depth: Array
    """(41,) of the skin at the key points, then at the bones' middles, 0 = unknown [m]."""


def starts_from_key_points(
    seen: SeenHand,
    frame: RgbdFrame,
    hands: dict[Side, tuple[HandModel, HandArrays]],
    config: KeyPointConfig | None = None,
) -> list[KeyPointStart]:
    """Return a start for every side that the hand may have, best first.

    Args:
        seen: the hand in the frame's colour image.
        frame: its depth is used where there is some.
        hands: model and arrays per side to try; empty result if the hand has none of them.
        config: how much is believed of what.
    """
    config = config or KeyPointConfig()
    likely: dict[Side, float] = {"right": seen.right, "left": 1.0 - seen.right}
    found = [
        _start(seen, frame, side, *hand, -config.side * math.log(likely[side]), config)
        for side, hand in hands.items()
        if likely[side] > config.doubt
    ]
    return sorted(found, key=lambda start: start.cost)


def key_point_offsets(side: Side) -> Array:
    """Return key point minus joint (21, 3) in `hand_wrist` [m] of a side."""
    return KEY_POINT_OFFSETS * [1.0, 1.0 if side == "right" else -1.0, 1.0]


def key_point_trust(pixels: Array, config: KeyPointConfig) -> Array:
    """Return the weight (21,) of each key point (21, 2).

    A thumb behind the hand is guessed by the networks, somewhere on the palm or the index finger.
    """
    start, bone = pixels[BONES[4:, 0]], pixels[BONES[4:, 1]] - pixels[BONES[4:, 0]]
    from_start = pixels[2:5, None] - start
    along = np.sum(from_start * bone, axis=2) / np.maximum(np.sum(bone * bone, axis=1), 1e-6)
    foot = np.clip(along, 0.0, 1.0)[..., None] * bone
    apart = np.linalg.norm(from_start - foot, axis=2).min(axis=1).mean()
    clear = apart > config.clear_thumb * np.linalg.norm(bone, axis=1).mean()
    trust = np.ones(21)
    trust[0] = config.wrist_trust
    trust[1:5] = config.thumb_trust if clear else config.hidden_thumb_trust
    return trust


def key_evidence(seen: SeenHand, camera: Camera, side: Side, config: KeyPointConfig) -> KeyEvidence:
    """Return what a seen hand says about a hand of a side.

    A key point's weight is its own trust, less where the network is in doubt about the hand or
    where no hand explains what it says: it reads those well of which it is sure, others anyhow.
    """
    rays = lines_of_sight(camera, seen.pixels)[:, :2]
    sure = certainty(seen.presence) * seen.explained
    weights = sure * key_point_trust(seen.pixels, config)
    return KeyEvidence(
        rays.astype(np.float32),
        weights.astype(np.float32),
        key_point_offsets(side).astype(np.float32),
    )


def _start(
    seen: SeenHand,
    frame: RgbdFrame,
    side: Side,
    model: HandModel,
    arrays: HandArrays,
    surprise: float,
    config: KeyPointConfig,
) -> KeyPointStart:
    """Return the best fit of one hand over the depths that its palm may have."""
    offsets = key_point_offsets(side)
    rest = config.usual_size * (posed_landmarks(arrays, np.zeros((1, JOINTS)))[0] + offsets)
    shape = seen.shape - seen.shape[PALM].mean(axis=0)
    shape *= _length(rest) / max(_length(shape), 1e-6)
    relative = with_bones(shape)[:, 2]
    rays = lines_of_sight(frame.camera, seen.pixels)
    by_size = _spread(shape[:, :2]) / max(_spread(rays[:, :2]), 1e-6)
    patch = max(1, round(_PATCH * seen.square.side))
    measured = measured_depth(frame.depth, with_bones(seen.pixels), patch)
    target = KeyPointTarget(
        np.ascontiguousarray(rays[:, :2]),
        key_point_trust(seen.pixels, config),
        shape,
        measured,
        _skin_thickness() * model.scale * model.thickness,
        offsets,
        FITTED_LIMITS,
        shipped_posture(),
    )
    turned = _turned(rest[PALM], shape[PALM])
    found = []
    for palm in palm_depths(measured, relative, by_size):
        depth = skin_depth(measured, relative, palm)
        elsewhere = measured[(measured > 0.0) & (depth == 0.0)]
        middle = rays[PALM].mean(axis=0) * (palm + _KNUCKLE_DEPTH)
        state, rotation = np.zeros(27, np.float32), np.array(turned, np.float32, order="C")
        state[:3] = middle - turned @ rest[PALM].mean(axis=0)
        state[6:26] = shipped_posture().mean
        state[26] = math.log(config.usual_size)
        weights = config.weights(palm)
        near = target._replace(depth=depth)
        cost = fit_key_points(arrays, near, weights, state, rotation, config.iterations)
        # what is not compared counts as an outlier, else the hand that meets least would win
        cost += surprise + float(np.where(elsewhere < palm, config.hidden**2, 9.0).sum())
        rotations = orthonormal(rotation.astype(np.float64)).astype(np.float32)[None]
        body = BodyState(state[:26].copy(), rotations)
        found.append(KeyPointStart(side, body, math.exp(state[26]), float(cost), depth))
    return min(found, key=lambda start: start.cost)


def lines_of_sight(camera: Camera, pixels: Array) -> Array:
    """Return the points (n, 3) at 1 m on the lines of sight of pixels (n, 2)."""
    flat = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    return np.column_stack([flat, np.ones(len(pixels))])


def _skin_thickness() -> Array:
    """Return how far (41,) joints and bones lie below the skin of a hand of normal size [m]."""
    thickness = np.full(41, _FINGER_DEPTH)
    thickness[PALM] = _KNUCKLE_DEPTH
    thickness[21::4] = _METACARPAL_DEPTH
    return thickness


def _length(points: Array) -> float:
    """Return the length of all bones but the thumb's of key points (21, 3)."""
    bones = points[BONES[4:, 1]] - points[BONES[4:, 0]]
    return float(np.linalg.norm(bones, axis=1).sum())


def _spread(points: Array) -> float:
    return float(np.linalg.norm(points - points.mean(axis=0)))


def _turned(source: Array, target: Array) -> Array:
    """Return the rotation (3, 3) that takes points (n, 3) nearest to others (Kabsch)."""
    product = (source - source.mean(axis=0)).T @ (target - target.mean(axis=0))
    left, _, right = np.linalg.svd(product)
    sign = np.sign(np.linalg.det(left @ right))
    return np.asarray((left * [1.0, 1.0, sign] @ right).T)
