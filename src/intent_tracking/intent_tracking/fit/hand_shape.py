"""Hand-shape calibration: overall size, thickness and bone lengths from the first good frames.

Every well-fitted frame gives normal equations in pose and shape. The pose is eliminated (Schur
complement), so that a frame leaves 22 equations about the shape alone; their sum over frames and a
prior around an average hand is a small bundle adjustment whose cost per frame does not grow:

    (P + sum_f A_f) s = P s_0 + sum_f (A_f s_f + b_f),   A_f = J_ss - J_sp J_pp^-1 J_ps

s_f is the shape with which frame f was fitted. P holds the deviations of grown-up hands; one point
stands for `_POINT_DEVIATION`, and neighbouring frames, which repeat each other's errors, for less.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array, Floats
from intent_perception.basics.parameters import Checked
from intent_perception.basics.safe_files import write_arrays
from intent_tracking.fit.shape_equations import ShapeDirections, shape_equations
from intent_tracking.image.frame_evidence import FrameEvidence, Weights
from intent_tracking.scene.body_state import BodyState
from intent_tracking.scene.hand_kernel import HandArrays, hand_arrays
from intent_tracking.scene.hand_model import SHAPE_SIZE, HandModel, Side
from intent_tracking.scene.state_layout import HAND_SIZE, JOINTS

_LEAST_SHARE, _GREATEST_SHARE = 0.3, 3.0
"""Of an average hand's size, thickness and bones, that a stored hand may have."""
AVERAGE: Array = np.array([1.0, 1.12, *np.ones(SHAPE_SIZE - 2)])
"""Shape (22,) of grown-up hands before anything is known of one: fingers are thicker than
GraspIt!'s. Calibrated thickness was 1.11 and 1.18 on two real recordings, 1.09-1.23 on ten films
of seeds below 1000 and 1.17-1.25 on two shipped bags."""
_SCALE_DEVIATION, _THICKNESS_DEVIATION, _BONE_DEVIATION = 0.06, 0.05, 0.03
"""Of the size of grown-up hands, of fingers' thickness and of single bones beside it, as shares."""
_POINT_DEVIATION = 0.006  # that one observed point stands for [m]
_FRAME_WEIGHT = 0.3  # share of a frame's information that its neighbours do not hold already
_SIZES = 12  # sizes of single frames that are enough
_SIZE_DEVIATION = 0.03  # of one of them, as share
_SIZE_BIAS = 1.03  # hands calibrated on many frames are this much larger, rendered and real ones
_MEMORY = 0.7
"""Share of what is known that an update keeps: early frames were fitted with a wrong hand."""


@dataclass(frozen=True, eq=False)
class HandShapeConfig(Checked):
    """When and how the hand's shape is calibrated."""

    calibrate: bool = True
    """Estimate scale, thickness and bone lengths over the first seconds of a hand."""
    file: str = ""
    """NPZ with a hand shape to start from, as `track --save-shape` writes it; empty: average."""
    save: str = ""
    """NPZ that the tracker's node keeps the calibrated shape in; empty: nowhere."""
    frames: int = 90
    """Well-fitted frames after which the shape is final, 1..10000."""
    period: int = 6
    """Well-fitted frames between two updates of the shape in use, 1..1000."""
    first: int = 8
    """Age in frames from which a track may speak for the shape, 0..1000."""


class HandShapeEstimate:
    """The shape of one demonstrator's hand, better with every frame until it is final.

    Raises:
        ValueError: if the file of the configuration holds no hand shape.
    """

    def __init__(self, config: HandShapeConfig) -> None:
        self._config = config
        self._start = load_shape(config.file) if config.file else AVERAGE
        self._sizes: list[float] = []
        self._begin(None)

    def _begin(self, side: Side | None) -> None:
        deviation = np.full(SHAPE_SIZE, _BONE_DEVIATION)
        deviation[:2] = _SCALE_DEVIATION, _THICKNESS_DEVIATION
        self.side, self.shape = side, self._start.copy()
        self._prior: Array = np.diag(deviation**-2.0)
        self._information: Array = np.zeros((SHAPE_SIZE, SHAPE_SIZE))
        self._vector: Array = np.zeros(SHAPE_SIZE)
        self.frames = 0
        """Well-fitted frames so far."""

    @property
    def known(self) -> bool:
        """Whether more is known of the hand's size than key points of single frames can add."""
        given = bool(self._config.file) or not self._config.calibrate
        return given or self.frames > 0 or len(self._sizes) >= _SIZES

    def note_size(self, size: float) -> bool:
        """Take note of a size against the average hand; return whether the shape has changed.

        The median of the first frames' sizes, drawn to that of average hands while there are few,
        is where the calibration begins.
        """
        if self.known:
            return False
        self._sizes.append(size)
        self._start = AVERAGE.copy()
        looks = np.sqrt(len(self._sizes))  # neighbouring frames repeat each other's errors
        share = looks / (looks + (_SIZE_DEVIATION / _SCALE_DEVIATION) ** 2)
        self._start[0] += share * (_SIZE_BIAS * float(np.median(self._sizes)) - 1.0)
        self._begin(self.side)
        return True

    @property
    def complete(self) -> bool:
        """Whether the shape has been calibrated to the end."""
        return self._config.calibrate and self.frames >= self._config.frames

    def learn(
        self,
        hand: HandModel,
        arrays: HandArrays,
        evidence: FrameEvidence,
        weights: Weights,
        state: BodyState,
    ) -> bool:
        """Take note of a well-fitted frame; return whether the shape in use shall change.

        Args:
            hand: with which the frame was fitted. The other side begins a new estimate.
            arrays: that hand for compiled code.
            evidence: of the frame.
            weights: of the refinement.
            state: fitted hand, and objects that do not matter here.
        """
        if hand.side != self.side:
            self._begin(hand.side)
        if self.complete or not self._config.calibrate:
            return False
        matrix = np.empty((HAND_SIZE + SHAPE_SIZE, HAND_SIZE + SHAPE_SIZE), np.float32)
        vector = np.empty(HAND_SIZE + SHAPE_SIZE, np.float32)
        shape_equations(
            arrays, shape_directions(hand.side, hand.shape), evidence, weights,
            state.values[:HAND_SIZE], state.rotations[0], matrix, vector,
        )  # fmt: skip
        information, right = _without_pose(matrix, vector, float(weights.angle))
        share = _FRAME_WEIGHT / _POINT_DEVIATION**2
        self._information += share * information
        self._vector += share * (right + information @ hand.shape)
        self.frames += 1
        if self.frames % self._config.period and not self.complete:
            return False
        right = self._vector + self._prior @ self._start
        self.shape = np.linalg.solve(self._prior + self._information, right)
        self._information *= _MEMORY
        self._vector *= _MEMORY
        return True

    @property
    def deviation(self) -> Array:
        """(22,) standard deviation of the shape."""
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(self._prior + self._information))))


def _without_pose(matrix: Floats, vector: Floats, ridge: float) -> tuple[Array, Array]:
    """Return the information (22, 22) and right side (22,) of the shape alone."""
    lower = np.tril(matrix.astype(np.float64))
    full = lower + np.tril(lower, -1).T
    pose = full[:HAND_SIZE, :HAND_SIZE] + np.diag([1e-3] * 6 + [ridge] * JOINTS)
    cross, right = full[HAND_SIZE:, :HAND_SIZE], vector.astype(np.float64)
    solved = np.linalg.solve(pose, np.column_stack([cross.T, right[:HAND_SIZE]]))
    information = full[HAND_SIZE:, HAND_SIZE:] - cross @ solved[:, :-1]
    return information, right[HAND_SIZE:] - cross @ solved[:, -1]


@cache
def _unit_directions(side: Side) -> tuple[Floats, ...]:
    """Return (22, ...) the average hand, what thickness adds and what each bone factor adds.

    In the order of `ShapeDirections`.
    """
    average = hand_arrays(HandModel(side))
    hands = []
    for number in range(1, SHAPE_SIZE):
        shape = np.ones(SHAPE_SIZE)
        shape[number] += 1.0
        hands.append(hand_arrays(HandModel.from_shape(side, shape)))
    return tuple(
        np.stack(
            [getattr(average, name), *(getattr(h, name) - getattr(average, name) for h in hands)]
        )
        for name in ShapeDirections._fields
    )


def shape_directions(side: Side, shape: Array) -> ShapeDirections:
    """Return what each number of a hand shape (22,) adds to the hand, per unit.

    Lengths are affine in bone factors and thickness, and proportional to the scale.
    """
    offset = _offset(shape)
    parts = []
    for unit in _unit_directions(side):
        part = unit * np.float32(shape[0])
        part[0] = np.tensordot(offset, unit, 1)
        parts.append(np.ascontiguousarray(part))
    return ShapeDirections(*parts)


def _offset(shape: Array) -> Floats:
    """Return how much of each unit direction a shape (22,) has."""
    return np.concatenate([[1.0], np.asarray(shape)[1:] - 1.0]).astype(np.float32)


def shaped_hand(side: Side, shape: Array) -> HandArrays:
    """Return the hand of a shape (22,) for compiled code, much faster than by its joint table."""
    offset, scale = _offset(shape), np.float32(shape[0])
    parts = [np.tensordot(offset, unit, 1) * scale for unit in _unit_directions(side)]
    return HandArrays(_rotations(side), *parts)


@cache
def _rotations(side: Side) -> Floats:
    return hand_arrays(HandModel(side)).rotations


def save_shape(path: str | Path, side: Side, shape: Array) -> None:
    """Keep a hand's side and shape (22,) in an NPZ file; ValueError where that is impossible."""
    arrays = {"hand_side": np.array(side), "hand_shape": np.asarray(shape)}
    write_arrays(path, arrays, compressed=False)


def load_shape(path: str | Path) -> Array:
    """Return the shape (22,) of a file of `save_shape`, or of the result of `track`.

    Raises:
        ValueError: if the file is absent, damaged or holds no hand shape.
    """
    try:
        shape = np.asarray(read_arrays(path, "hand shape")["hand_shape"], dtype=np.float64)
        if not np.all((shape > _LEAST_SHARE) & (shape < _GREATEST_SHARE)):
            raise ValueError(f"expected shares in {_LEAST_SHARE:g}..{_GREATEST_SHARE:g}")
        HandModel.from_shape("right", shape)
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(
            f"{path}: expected a hand shape as `track --save-shape` writes it: {error}"
        ) from error
    return shape
