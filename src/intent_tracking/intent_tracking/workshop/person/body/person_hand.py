"""The demonstrator's hand: bones and joint axes of one person, drawn at random.

It plays the human in the rendered test bags. The tracker must not import it: its bone lengths,
joint axes and joint centres differ on purpose from the hand that the tracker fits (and the person
is another one in every bag), so that a bag measures tracking and not a model meeting itself.
"""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import rotation_from_vector

FINGERS = ("thumb", "index", "middle", "ring", "little")

PALM, FOREARM = 0, 16
"""Links: the palm, three phalanges per finger (1 + 3 * finger + k), and the forearm."""

PARENT = (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14, 0)
"""(17,) parent of each link."""

LOWER = np.radians([-10, -45, 0, -5] + [-18, -8, 0, 0] * 4)
UPPER = np.radians([68, 30, 70, 85] + [18, 88, 98, 78] * 4)
"""(20,) joint limits in the order of the contract's joint angles [rad]."""

_BASE = np.array(
    [[0.012, -0.012, 0.021], [0.0945, -0.0275, 0.000], [0.100, -0.001, -0.001],
     [0.0975, 0.0250, 0.004], [0.0885, 0.0470, 0.0145]]
)  # fmt: skip
_BONES = np.array(
    [[0.0505, 0.0395, 0.0305], [0.0425, 0.0290, 0.0250], [0.0460, 0.0310, 0.0280],
     [0.0405, 0.0285, 0.0250], [0.0310, 0.0205, 0.0230]]
)  # fmt: skip
_ROLL = np.radians([0.0, -4.0, 0.0, 4.0, 9.0])
_SPLAY = np.radians([0.0, -2.0, 0.0, 1.0, 3.0])


@dataclass(frozen=True, eq=False)
class DemonstratorHand:
    """A person's hand, in `hand_wrist` (x to the fingers, z out of the palm)."""

    side: str
    """"right" or "left"; a left hand is the mirror image (y -> -y) of the right one inside."""
    bases: Array
    """(5, 3) first joint of each finger on the right hand [m]."""
    bones: Array
    """(5, 3) lengths of the three bones of each finger, the last one to the finger tip [m]."""
    axes: Array
    """(5, 4, 3, 3) fixed rotation in front of each joint of each finger."""
    thickness: float
    """Factor on all radii of the skin."""

    @property
    def mirror(self) -> Array:
        """(3,) factor that takes the right hand's coordinates to this side's."""
        return np.array([1.0, -1.0 if self.side == "left" else 1.0, 1.0])

    def link_poses(self, angles: Array, wrist: Array | None = None) -> Array:
        """Return the pose of every link of the right hand in the wrist frame.

        Args:
            angles: (20,) joint angles, order of the contract [rad].
            wrist: (3,) rotation vector of the forearm against the hand, None: straight [rad].

        Returns:
            (17, 4, 4); the x axis of a phalanx runs along its bone.
        """
        poses = np.tile(np.eye(4), (17, 1, 1))
        for finger in range(5):
            rotation = np.eye(3)
            position = self.bases[finger]
            q = angles[4 * finger : 4 * finger + 4]
            spread = q[0] if finger == 0 else -q[0]  # positive: opposition, and towards the thumb
            rotation = rotation @ self.axes[finger, 0] @ _about_z(spread)
            for k in range(3):
                rotation = rotation @ self.axes[finger, k + 1] @ _about_minus_y(q[k + 1])
                link = poses[1 + 3 * finger + k]
                link[:3, :3], link[:3, 3] = rotation, position
                position = position + rotation[:, 0] * self.bones[finger, k]
        if wrist is not None:
            poses[FOREARM, :3, :3] = rotation_from_vector(wrist)
        return poses

    def joint_positions(self, angles: Array) -> Array:
        """Return the 21 joints in the contract's order, (21, 3) in the wrist frame [m]."""
        poses = self.link_poses(angles)
        joints = np.zeros((21, 3))
        for finger in range(5):
            links = poses[1 + 3 * finger : 4 + 3 * finger]
            joints[1 + 4 * finger : 4 + 4 * finger] = links[:, :3, 3]
            tip = links[2, :3, 3] + links[2, :3, 0] * self.bones[finger, 2]
            joints[4 + 4 * finger] = tip
        return joints * self.mirror


def sample_hand(rng: np.random.Generator, side: str = "right") -> DemonstratorHand:
    """Return a new person's hand: overall size, single bones ±4 %, axes a few degrees off.

    Args:
        rng: source of the person.
        side: "right" or "left".

    Raises:
        ValueError: if the side is neither.
    """
    if side not in ("right", "left"):
        raise ValueError(f"hand side must be 'right' or 'left', got {side!r}")
    size = rng.uniform(0.97, 1.03)
    bones = _BONES * size * rng.uniform(0.96, 1.04, _BONES.shape)
    bases = _BASE * size + rng.normal(0.0, 0.001, _BASE.shape)
    bases[2, 1:] = 0.0  # the wrist frame's x axis runs along the middle metacarpal
    axes = np.zeros((5, 4, 3, 3))
    for finger in range(5):
        for k in range(4):
            tilt = rng.normal(0.0, np.radians(2.0), 3)
            axes[finger, k] = _rest_axis(finger, k) @ rotation_from_vector(tilt)
    return DemonstratorHand(side, bases, bones, axes, float(rng.uniform(0.95, 1.05)))


def _rest_axis(finger: int, k: int) -> Array:
    """Return the fixed rotation before joint k of a finger: splay, roll of the hinge, thumb."""
    if finger > 0:
        turn = {0: np.array([0.0, 0.0, _SPLAY[finger]]), 1: np.array([_ROLL[finger], 0.0, 0.0])}
        return rotation_from_vector(turn.get(k, np.zeros(3)))
    if k == 0:  # opposition turns about a line nearly along the metacarpals
        z = np.array([0.945, -0.20, -0.26])
        x = np.array([0.20, -0.33, 0.92])
        return _frame(x, z)
    if k == 1:  # the metacarpal stands out of the palm, the hinge crosses it
        first = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
        return np.asarray(first @ _about_z(np.radians(48.0)) @ first.T)
    twist = np.radians(46.0) if k == 2 else 0.0
    return rotation_from_vector(np.array([twist, 0.0, 0.0]))


def _frame(x: Array, z: Array) -> Array:
    z = z / np.linalg.norm(z)
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    return np.asarray(np.stack([x, np.cross(z, x), z], axis=1))


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_minus_y(angle: float) -> Array:
    """Flexion: x turns towards z, the palm's side."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
