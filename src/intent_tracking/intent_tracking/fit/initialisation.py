"""A hand pose out of nothing: many starts around a hand region, refined and compared.

Starts cover both directions of the arm (where it was not seen), all turns about it and a few
postures, for the right and the left hand. All are refined on few points with a wide outlier
scale, the best with a narrow one, and the rendered cost decides.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import rotation_between, rotation_from_vector
from intent_tracking.fit.finger_sweep import sweep_fingers
from intent_tracking.fit.objective import rendered_cost
from intent_tracking.fit.refinement import refine
from intent_tracking.hands.hand_detection import HandRegion
from intent_tracking.image.frame_evidence import FrameEvidence, Labelled, Prior, Weights
from intent_tracking.image.labelling import inner_pixels
from intent_tracking.image.tile import Tile
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_kernel import HandArrays, posed_landmarks
from intent_tracking.scene.hand_model import FITTED_LIMITS, Side
from intent_tracking.scene.object_kernel import object_arrays
from intent_tracking.scene.posture_prior import shipped_posture
from intent_tracking.scene.state_layout import HAND_SIZE, JOINTS

NO_OBJECTS = object_arrays([])
_CURLS = ((5, 10, 15, 10), (5, 35, 40, 25), (3, 60, 70, 45))
_THUMBS = ((30, -10, 10, 10), (0, -35, 5, 10))
_SPLAY = (0, -5, -8, -11)
POSTURES: Array = np.radians(
    [
        [*thumb, *(angle for splay in _SPLAY for angle in (curl[0] + splay, *curl[1:]))]
        for curl in _CURLS
        for thumb in _THUMBS
    ]
)
"""(6, 20) open, half closed, closed, each with the thumb forward and out [rad]."""
_COARSE_SCALE, _FINE_SCALE = 0.025, 0.010
"""Outlier scale of the first refinement and of the later ones [m]."""
_SWEEP_SPREAD = 0.4  # standard deviation of local trials [rad]
_SWEEP_UNUSUAL = 1.0  # weight of the posture prior in the sweep [pixels]
_FARTHEST = 0.25  # no wrist lies farther from the middle of its hand [m]


@dataclass(frozen=True, eq=False)
class InitialisationConfig(Checked):
    """How many starts, and how far each is followed."""

    turns: int = 8
    """Turns about the arm, 1..64."""
    coarse_iterations: int = 4
    """Levenberg-Marquardt steps of all starts, and again of the better half, 0..100."""
    finalists: int = 3
    """Starts per side that are refined to the end, 1..100."""
    fine_iterations: int = 8
    """Levenberg-Marquardt steps of the finalists, before and after their finger sweep, 0..100."""
    sweep_trials: int = 48
    """Trial poses per finger of every finalist, 0..1000."""
    points: int = 192
    """Points of the region that starts are fitted to, evenly spread, 16..4096."""
    tile_size: int = 96
    """Side of the tile around the region [pixels], 32..256, a multiple of 16."""


@dataclass(frozen=True, eq=False)
class HandStart:
    """One refined start."""

    side: Side
    state: BodyState
    """Of the hand alone."""
    cost: float
    """C per hand pixel."""


def region_evidence(
    tile: Tile,
    body: NDArray[np.bool_],
    skin: NDArray[np.bool_],
    region: HandRegion,
    config: InitialisationConfig,
) -> tuple[FrameEvidence, Labelled]:
    """Return the evidence of a tile around a region of which nothing else is known.

    Args:
        tile: square around the region.
        body: (S, S) pixels of things that may move, see `hand_pixels`.
        skin: (S, S) those that look like skin.
        region: where the hand is.
        config: number of points.
    """
    direction = region.direction.astype(np.float32)
    offset = tile.points - region.center[:, None, None].astype(np.float32)
    near = np.linalg.norm(offset, axis=0) < 0.2
    least = np.percentile(direction @ (region.points - region.center[:, None]), 1)
    hand = skin & near & (np.tensordot(direction, offset, 1) > least)
    missing = cv2.medianBlur((tile.depth <= 0.0).astype(np.uint8), 3) > 0
    unknown = missing | (body & ~hand & near)
    outside = cv2.distanceTransform(1 - (hand | unknown).astype(np.uint8), cv2.DIST_L2, 3)
    pixels = np.flatnonzero(hand)
    if len(pixels) > config.points:
        pixels = pixels[np.linspace(0, len(pixels) - 1, config.points).astype(np.int64)]
    evidence = FrameEvidence(
        np.ascontiguousarray(tile.points.reshape(3, -1)[:, pixels]),
        np.zeros((3, 0), np.float32),
        np.zeros(0, np.int64),
        tile.depth,
        outside.astype(np.float32),
        tile.u0,
        tile.v0,
        tile.step,
    )
    nothing = np.zeros(hand.shape, np.float32)
    valid = (~unknown & (tile.depth > 0.0)).astype(np.float32)
    seen = Labelled(
        tile.depth,
        hand.astype(np.float32),
        nothing,
        valid,
        inner_pixels(hand),
        tile.u0,
        tile.v0,
        tile.step,
    )
    return evidence, seen


def candidates(
    evidence: FrameEvidence,
    seen: Labelled,
    region: HandRegion,
    hands: dict[Side, HandArrays],
    weights: Weights,
    config: InitialisationConfig,
    rng: np.random.Generator,
) -> list[HandStart]:
    """Return refined starts of every side, best first.

    Args:
        evidence: points and silhouette of the region.
        seen: labelled tile of the region.
        region: where the hand is.
        hands: per side to try.
        weights: of the refinement; the outlier scale is replaced.
        config: how many.
        rng: jitter of the starts.
    """
    found: list[HandStart] = []
    for side, arrays in hands.items():
        values, rotations = _starts(region, arrays, config, rng)
        coarse = weights._replace(scale=np.float32(_COARSE_SCALE))
        _refine(arrays, evidence, coarse, values, rotations, config.coarse_iterations)
        order = np.argsort(
            [_cost(arrays, seen, v, r) for v, r in zip(values, rotations, strict=True)]
        )
        best = order[: config.finalists]
        values, rotations = values[best].copy(), rotations[best].copy()
        fine = weights._replace(scale=np.float32(_FINE_SCALE))
        _refine(arrays, evidence, fine, values, rotations, config.fine_iterations)
        for v, r in zip(values, rotations, strict=True):
            _sweep(arrays, seen, v, r, config, int(rng.integers(1 << 30)))
        _refine(arrays, evidence, fine, values, rotations, config.fine_iterations)
        for v, r in zip(values, rotations, strict=True):
            if np.linalg.norm(v[:3] - region.center) < _FARTHEST:
                found.append(HandStart(side, BodyState(v, r), _cost(arrays, seen, v, r)))
    return sorted(found, key=lambda candidate: candidate.cost)


def _starts(
    region: HandRegion, arrays: HandArrays, config: InitialisationConfig, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return start states (B, 26) and rotations (B, 1, 3, 3)."""
    along = rotation_between([1.0, 0.0, 0.0], region.direction)
    behind = np.array([0.0, 0.0, 0.01])  # the points lie on the side that the camera sees
    shape = (len(POSTURES), config.turns)
    turns = np.arange(config.turns) + rng.uniform(-0.3, 0.3, shape)
    about = np.zeros((*shape, 3))
    about[..., 0] = 2.0 * np.pi / config.turns * turns
    tilt = rotation_from_vector(rng.normal(0.0, 0.2, (*shape, 3)))
    rotations = tilt @ along @ rotation_from_vector(about)
    middle = posed_landmarks(arrays, POSTURES).mean(axis=1)
    wrist = region.center + behind - np.einsum("ptij,pj->pti", rotations, middle)
    postures = np.broadcast_to(POSTURES[:, None], (*shape, JOINTS))
    values = np.concatenate([wrist, np.zeros((*shape, 3)), postures], axis=2)
    return (
        values.reshape(-1, HAND_SIZE).astype(np.float32),
        rotations.reshape(-1, 1, 3, 3).astype(np.float32),
    )


def _refine(
    arrays: HandArrays,
    evidence: FrameEvidence,
    weights: Weights,
    values: Floats,
    rotations: Floats,
    iterations: int,
) -> Floats:
    prior_state = np.zeros(HAND_SIZE, np.float32)
    prior_state[6:] = POSTURES[1]
    none = np.zeros(0, np.float32)
    limits = np.ascontiguousarray(FITTED_LIMITS, dtype=np.float32)
    prior = Prior(
        prior_state, np.eye(3, dtype=np.float32)[None], limits, shipped_posture(), none, none, none
    )
    costs = np.zeros(len(values), np.float32)
    normals = np.zeros((len(values), HAND_SIZE, HAND_SIZE), np.float32)
    refine(
        arrays, NO_OBJECTS, evidence, weights, prior, values, rotations, iterations, costs, normals
    )
    return costs


def _cost(arrays: HandArrays, seen: Labelled, values: Floats, rotations: Floats) -> float:
    return float(rendered_cost(arrays, NO_OBJECTS, seen, values, rotations)[1])


def _sweep(
    arrays: HandArrays,
    seen: Labelled,
    values: Floats,
    rotations: Floats,
    config: InitialisationConfig,
    seed: int,
) -> None:
    """Search every finger of one start in place."""
    sweep_fingers(
        arrays, NO_OBJECTS, seen, values, rotations, values.copy(), shipped_posture(),
        FITTED_LIMITS.astype(np.float32), config.sweep_trials, np.float32(0.0),
        np.float32(_SWEEP_UNUSUAL), np.float32(_SWEEP_SPREAD), seed,
    )  # fmt: skip
