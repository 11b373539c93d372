"""The human hand with 20 joints: the one joint table of tracker, features and simulation.

Lengths, axes and limits are those of GraspIt!'s HumanHand20DOF; radii and palm are ours. All is
expressed in `hand_wrist`: origin at the wrist, x to the fingers along the middle metacarpal, z out
of the palm, the thumb at -y on a right hand. A left hand is the mirror image (y -> -y).
Link frames: x along the bone, z to the palmar side, flexion turns about -y.
"""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.scene.joint_table import (
    Capsules,
    JointTable,
    landmark_positions,
    mirrored,
    placed_capsules,
)
from intent_tracking.scene.state_layout import CAPSULES

Side = Literal["right", "left"]
SIDES: tuple[Side, Side] = ("right", "left")
FINGERS = ("thumb", "index", "middle", "ring", "little")
JOINT_NAMES = tuple(
    f"{finger}_{joint}" for finger in FINGERS for joint in ("abduction", "mcp", "pip", "dip")
)
LANDMARK_NAMES = (
    "wrist",
    *(f"thumb_{point}" for point in ("cmc", "mcp", "ip", "tip")),
    *(f"{finger}_{point}" for finger in FINGERS[1:] for point in ("mcp", "pip", "dip", "tip")),
)

_FINGER_LIMITS = ((20, 90), (10, 90), (20, 90), (30, 90))
LIMITS: Array = np.radians(
    [[-10, 70], [-50, 25], [0, 90], [0, 100]]
    + [
        pair
        for spread, flexion in _FINGER_LIMITS
        for pair in ([-spread, spread], *([[-10, flexion]] * 3))
    ]
)
"""(20, 2) lower and upper angle of each joint [rad]."""

FITTED_LIMITS: Array = LIMITS + np.radians([[-15, 15]] * 2 + [[0, 0]] * 18)
"""(20, 2) angles that the tracker may use: the axes of people's thumbs differ by so much [rad]."""

T_WRIST_GRASPIT: Array = np.array(
    [
        [-1.0, 0.0, 0.0, -0.04200],
        [0.0, 0.0, -1.0, 0.00840],
        [0.0, -1.0, 0.0, 0.01120],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""GraspIt!'s palm frame (fingers -x, palmar -y, thumb +z) in `hand_wrist` [m].

The wrist is put 42 mm before GraspIt!'s origin, so that the middle MCP joint lies on +x at 104 mm.
"""

_BASES = np.array(  # CMC of the thumb, MCP of the fingers, in GraspIt!'s palm frame [m]
    [
        [-0.05062, -0.01151, 0.01893],
        [-0.14006, 0.01120, 0.03642],
        [-0.14566, 0.01120, 0.00840],
        [-0.14566, 0.00560, -0.01961],
        [-0.13446, -0.00840, -0.04202],
    ]
)
_BONES = np.array(  # thumb metacarpal and phalanges; proximal, middle, distal of the others [m]
    [
        [0.05212, 0.04076, 0.03080],
        [0.04319, 0.02956, 0.02535],
        [0.04620, 0.03099, 0.02920],
        [0.03912, 0.02831, 0.02448],
        [0.02991, 0.02110, 0.02316],
    ]
)
_RADII = np.array(
    [
        [0.0125, 0.0100, 0.0088],
        [0.0095, 0.0083, 0.0073],
        [0.0097, 0.0085, 0.0075],
        [0.0092, 0.0080, 0.0071],
        [0.0082, 0.0072, 0.0064],
    ]
)
_THUMB_ROTATION = np.array(  # rows as in GraspIt!'s file, which multiplies row vectors
    [[-0.1486, -0.9003, 0.4089], [0.2665, 0.3618, 0.8933], [-0.9522, 0.2418, 0.1862]]
).T
_CARPALS = np.array(  # proximal ends of the four metacarpals [m]
    [[0.018, -0.021, 0.005], [0.015, -0.007, 0.004], [0.015, 0.008, 0.005], [0.018, 0.022, 0.008]]
)
_WRIST = np.array(  # the wrist's cross-section, about 63 x 43 mm, and the carpal bones [m]
    [
        [[-0.010, -0.010, 0.003], [-0.010, 0.010, 0.003]],
        [[0.020, -0.014, 0.006], [0.020, 0.014, 0.008]],
    ]
)
_HEEL = np.array([[0.004, 0.000, 0.006], [0.0, -0.002, 0.004]])  # muscle below the little finger
_WEB = np.array([0.0, 0.004, 0.008])  # between thumb and index metacarpal
_PALM_RADII = np.array([0.0135, 0.0135, 0.0130, 0.0125, 0.0215, 0.0190, 0.0120, 0.0145, 0.0140])

SHAPE_SIZE = 22
"""Length of a hand-shape vector: scale, thickness, then 5 x 4 bone scales."""


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand of given side and size."""

    side: Side = "right"
    scale: float = 1.0
    """Size of the whole hand, lengths and radii, relative to GraspIt!'s."""
    bone_scales: Array = field(default_factory=lambda: np.ones((5, 4)))
    """(5, 4) per finger: wrist to base, then the three bones."""
    thickness: float = 1.0
    """Factor on all radii, on top of `scale`."""

    def __post_init__(self) -> None:
        if self.side not in ("right", "left"):
            raise ValueError(f"expected side 'right' or 'left', got {self.side!r}")
        if np.shape(self.bone_scales) != (5, 4):
            raise ValueError(f"expected bone_scales (5, 4), got {np.shape(self.bone_scales)}")
        if not (0.3 < self.scale < 3.0 and 0.3 < self.thickness < 3.0):
            raise ValueError(f"expected scale and thickness near 1, got {self.scale}")

    @classmethod
    def from_shape(cls, side: Side, shape: Array) -> "HandModel":
        """Return the hand of a shape vector (22,) as in `SceneState.hand_shape`.

        The same shape gives the same object, so that its joint table is built once.
        """
        if np.shape(shape) != (SHAPE_SIZE,):
            raise ValueError(f"expected a hand shape of ({SHAPE_SIZE},), got {np.shape(shape)}")
        return _hand_of_shape(side, tuple(np.asarray(shape, dtype=np.float64).tolist()))

    @property
    def shape(self) -> Array:
        """(22,) scale, thickness, bone scales."""
        return np.concatenate([[self.scale, self.thickness], np.ravel(self.bone_scales)])

    @cached_property
    def table(self) -> JointTable:
        """The joint table of this hand."""
        return human_hand(self)

    def joint_positions(self, joints: Array) -> Array:
        """Return the 21 landmarks of `LANDMARK_NAMES` in `hand_wrist` [m].

        Args:
            joints: (20,) or (B, 20) angles in the order of `JOINT_NAMES` [rad].

        Returns:
            (21, 3) or (B, 21, 3).
        """
        points = landmark_positions(self.table, joints)
        return points if np.ndim(joints) == 2 else points[0]

    def capsules(self, joints: Array) -> tuple[Array, Array]:
        """Return the capsule ends (C, 2, 3) in `hand_wrist` and radii (C,) [m] of (20,) angles."""
        return placed_capsules(self.table, joints)[0], self.table.capsules.radii


@lru_cache(maxsize=16)
def _hand_of_shape(side: Side, shape: tuple[float, ...]) -> HandModel:
    return HandModel(side, shape[0], np.reshape(shape[2:], (5, 4)), shape[1])


def human_hand(model: HandModel) -> JointTable:
    """Return the joint table of the human hand: palm, then per finger a knuckle and three bones."""
    names, parents, origins, axes, drivers = ["palm"], [-1], [np.eye(4)], [[0.0, 0.0, 0.0]], [-1]
    lengths = _BONES * model.scale * np.asarray(model.bone_scales)[:, 1:]
    bases = _base_positions(model)
    for finger, name in enumerate(FINGERS):
        for level, joint in enumerate(("knuckle", "proximal", "middle", "distal")):
            names.append(f"{name}_{joint}")
            parents.append(len(names) - 2 if level else 0)
            origins.append(_origin(finger, level, bases[finger], lengths[finger]))
            axes.append(_axis(finger, level))
            drivers.append(4 * finger + level)
    links, offsets = _landmarks(lengths)
    table = JointTable(
        f"human_{model.side}",
        tuple(names),
        np.array(parents),
        np.array(origins),
        np.array(axes),
        np.array(drivers),
        np.ones(len(names)),
        JOINT_NAMES,
        LIMITS,
        _capsules(model, bases, lengths),
        links,
        offsets,
    )
    return table if model.side == "right" else mirrored(table)


def _base_positions(model: HandModel) -> Array:
    """Return the bases (5, 3) of the fingers in `hand_wrist` [m]."""
    placed = _BASES @ T_WRIST_GRASPIT[:3, :3].T + T_WRIST_GRASPIT[:3, 3]
    return np.asarray(placed * model.scale * np.asarray(model.bone_scales)[:, :1])


def _axis(finger: int, level: int) -> list[float]:
    """Return the joint axis in its link frame; positive is radial abduction and flexion."""
    if level > 0:
        return [0.0, -1.0, 0.0]
    return [0.0, 0.0, 1.0] if finger == 0 else [0.0, 0.0, -1.0]


def _origin(finger: int, level: int, base: Array, lengths: Array) -> Array:
    """Return the (4, 4) link frame in its parent at angle zero.

    The thumb's frames are GraspIt!'s Denavit-Hartenberg chain, turned so that x follows the bone.
    """
    origin = np.eye(4)
    if level == 0:
        origin[:3, 3] = base
        if finger == 0:
            origin[:3, :3] = T_WRIST_GRASPIT[:3, :3] @ _orthonormal(_THUMB_ROTATION)
        return origin
    if level > 1:
        origin[0, 3] = lengths[level - 2]
    if finger == 0:
        flexion, twist = ((49.5, 0.0), (5.0, 44.0), (-5.0, 0.0))[level - 1]
        origin[:3, :3] = _turn_x(twist) @ _turn_minus_y(flexion)
    return origin


def _capsules(model: HandModel, bases: Array, lengths: Array) -> Capsules:
    """Return 15 finger capsules (thumb to little, proximal to distal), then 9 of the palm."""
    radii = _RADII * model.scale * model.thickness
    ends = np.zeros((CAPSULES, 2, 3))
    ends[:15, 1, 0] = lengths.ravel()
    ends[2:15:3, 1, 0] -= radii[:, 2]  # the tip landmark lies on the skin
    carpals = _CARPALS * model.scale * np.asarray(model.bone_scales)[1:, :1]
    inner = np.array([-0.004, 0.0, 0.003]) * model.scale  # knuckle surface against joint axis
    knuckles = bases[1:] + inner
    ends[15:19] = np.stack([carpals, knuckles], axis=1)
    ends[19:21] = _WRIST * model.scale
    ends[21] = knuckles[[0, 3]]
    heel, web = _HEEL * model.scale, _WEB * model.scale
    ends[22] = [carpals[3] + heel[0], 0.8 * knuckles[3] + heel[1]]
    ends[23] = [0.6 * bases[0] + 0.4 * carpals[0], 0.75 * knuckles[0] + web]
    links = [4 * finger + level for finger in range(5) for level in (2, 3, 4)] + [0] * 9
    palm_radii = _PALM_RADII * model.scale * model.thickness
    return Capsules(np.array(links), ends, np.concatenate([radii.ravel(), palm_radii]))


def _landmarks(lengths: Array) -> tuple[np.ndarray, Array]:
    """Return the links (21,) and offsets (21, 3) of `LANDMARK_NAMES`."""
    links = [0] + [4 * finger + level for finger in range(5) for level in (2, 3, 4, 4)]
    offsets = np.zeros((21, 3))
    offsets[4::4, 0] = lengths[:, 2]
    return np.array(links), offsets


def _turn_x(degrees: float) -> Array:
    """Return the rotation (3, 3) about x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _turn_minus_y(degrees: float) -> Array:
    """Return the rotation (3, 3) about -y, the direction of flexion."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def _orthonormal(matrix: Array) -> Array:
    """Return the rotation nearest to a matrix that was printed with four digits."""
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)
