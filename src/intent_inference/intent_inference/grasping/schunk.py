"""The Schunk Dexterous Hand (SDH) with 7 joints as a joint table.

Frame: the hand's base, z = approach, fingers 1 and 2 at +x, the thumb at -x. Lengths are those of
ipa320/schunk_modular_robotics; capsule radii are ours. Finger 2 turns with finger 1 about -z, so
the two knuckles share one of the 7 degrees of freedom.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.scene.joint_table import Capsules, JointTable, LinkBoxes

JOINT_NAMES = (
    "knuckle",
    "thumb_proximal",
    "thumb_distal",
    "finger_1_proximal",
    "finger_1_distal",
    "finger_2_proximal",
    "finger_2_distal",
)
LIMITS: Array = np.radians([[0.0, 90.0]] + [[-90.0, 90.0]] * 6)
"""(7, 2) lower and upper angle of each joint [rad]."""

_KNUCKLE, _PROXIMAL, _DISTAL = 0.0165, 0.0865, 0.0685  # lengths along z [m]
_RADII = (0.014, 0.0135, 0.0110)
_BASE_HEIGHT = 0.0745
_MOUNT_RADIUS = 0.0220  # the motor housings that the fingers stand on


@dataclass(frozen=True)
class _Finger:
    name: str
    base: tuple[float, float]
    yaw: float
    knuckle_axis: float
    first_joint: int


_FINGERS = (
    _Finger("thumb", (-0.03811, 0.0), 0.0, 0.0, 1),
    _Finger("finger_1", (0.01905, 0.033), np.pi, 1.0, 3),
    _Finger("finger_2", (0.01905, -0.033), np.pi, -1.0, 5),
)


@cache
def schunk_hand() -> JointTable:
    """Return the joint table: the palm, then per finger knuckle, proximal and distal link."""
    names, parents, origins, axes, drivers = ["palm"], [-1], [np.eye(4)], [np.zeros(3)], [-1]
    links, ends, radii = [], [], []
    for finger in _FINGERS:
        mount = np.array([*finger.base, _BASE_HEIGHT])
        links.append(0)
        ends.append([mount - [0.0, 0.0, 0.0245], mount - [0.0, 0.0, 0.0120]])
        radii.append(_MOUNT_RADIUS)
        for level, (length, radius) in enumerate(
            zip((_KNUCKLE, _PROXIMAL, _DISTAL), _RADII, strict=True)
        ):
            names.append(f"{finger.name}_{('knuckle', 'proximal', 'distal')[level]}")
            parents.append(len(names) - 2 if level else 0)
            origins.append(_origin(finger, level))
            axes.append(np.array([0.0, 1.0, 0.0] if level else [0.0, 0.0, finger.knuckle_axis]))
            drivers.append(_driver(finger, level))
            links.append(len(names) - 1)
            tip = length - (radius if level == 2 else 0.0)
            ends.append([np.zeros(3), np.array([0.0, 0.0, tip])])
            radii.append(radius)
    tips = [names.index(f"{finger.name}_distal") for finger in _FINGERS]
    return JointTable(
        "schunk",
        tuple(names),
        np.array(parents),
        np.array(origins),
        np.array(axes),
        np.array(drivers),
        np.ones(len(names)),
        JOINT_NAMES,
        LIMITS,
        Capsules(np.array(links), np.array(ends), np.array(radii)),
        np.array(tips),
        np.tile([0.0, 0.0, _DISTAL], (3, 1)),
        _palm(),
    )


def _driver(finger: _Finger, level: int) -> int:
    """Return the degree of freedom of a link; the thumb's knuckle does not turn."""
    if level == 0:
        return 0 if finger.knuckle_axis else -1
    return finger.first_joint + level - 1


def _origin(finger: _Finger, level: int) -> Array:
    """Return the (4, 4) link frame in its parent at angle zero."""
    origin = np.eye(4)
    if level == 0:
        cosine, sine = np.cos(finger.yaw), np.sin(finger.yaw)
        origin[:2, :2] = [[cosine, -sine], [sine, cosine]]
        origin[:3, 3] = [*finger.base, _BASE_HEIGHT]
    else:
        origin[2, 3] = (_KNUCKLE, _PROXIMAL)[level - 1]
    return origin


def _palm() -> LinkBoxes:
    """Return the palm body as one box below the finger mounts."""
    pose = np.eye(4)
    pose[:3, 3] = [-0.0050, 0.0, 0.0300]
    return LinkBoxes(np.array([0]), pose[None], np.array([[0.0475, 0.0550, 0.0300]]))
