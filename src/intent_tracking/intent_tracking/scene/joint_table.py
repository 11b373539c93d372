"""Articulated hands as one table: links, joints, limits and shapes, for any hand.

The human hand (`intent_tracking.scene.hand_model`) and a robot hand are both a `JointTable`;
tracker, grasp features, simulation and drawing read the same one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Capsules:
    """Swept spheres fixed to links."""

    links: Indices
    """(C,) link that carries each capsule."""
    ends: Array
    """(C, 2, 3) the two centres in the link's frame [m]."""
    radii: Array
    """(C,) radius [m]."""


@dataclass(frozen=True, eq=False)
class LinkBoxes:
    """Boxes fixed to links."""

    links: Indices
    """(K,) link that carries each box."""
    poses: Array
    """(K, 4, 4) box centre and axes in the link's frame."""
    half_sizes: Array
    """(K, 3) half the edges along the box axes [m]."""


NO_BOXES = LinkBoxes(np.zeros(0, np.int64), np.zeros((0, 4, 4)), np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class JointTable:
    """A tree of L links driven by J degrees of freedom; link 0 is the base.

    The pose of link l in its parent is `origins[l]` followed by a turn about `axes[l]` by
    `ratios[l] * q[drivers[l]]`; parents stand before their children.
    """

    name: str
    link_names: tuple[str, ...]
    parents: Indices
    """(L,) parent link, -1 for the base."""
    origins: Array
    """(L, 4, 4) link frame in its parent's frame at angle zero."""
    axes: Array
    """(L, 3) unit axis in the link's own frame; ignored where nothing drives the link."""
    drivers: Indices
    """(L,) degree of freedom that turns the link, -1 for a fixed link."""
    ratios: Array
    """(L,) link angle per driver angle: 1, or another factor for a coupled joint."""
    joint_names: tuple[str, ...]
    """(J,) names of the degrees of freedom."""
    limits: Array
    """(J, 2) lower and upper angle [rad]."""
    capsules: Capsules
    landmark_links: Indices
    """(P,) link of each landmark (joints, fingertips)."""
    landmark_offsets: Array
    """(P, 3) landmark in its link's frame [m]."""
    boxes: LinkBoxes = NO_BOXES

    def __post_init__(self) -> None:
        links = len(self.link_names)
        if np.any(self.parents[1:] >= np.arange(1, links)) or self.parents[0] != -1:
            raise ValueError(f"{self.name}: every parent must stand before its children")
        if self.limits.shape != (len(self.joint_names), 2):
            raise ValueError(
                f"{self.name}: expected limits ({len(self.joint_names)}, 2), "
                f"got {self.limits.shape}"
            )


def link_poses(table: JointTable, joints: Array) -> Array:
    """Return the pose of every link in the base frame for a batch of postures.

    Args:
        table: the hand.
        joints: (B, J) angles [rad].

    Returns:
        (B, L, 4, 4) T_base_link.
    """
    joints = np.atleast_2d(np.asarray(joints, dtype=np.float64))
    poses = np.empty((len(joints), len(table.link_names), 4, 4))
    for link, parent in enumerate(table.parents):
        pose = poses[:, parent] @ table.origins[link] if parent >= 0 else table.origins[link]
        if table.drivers[link] >= 0:
            angles = table.ratios[link] * joints[:, table.drivers[link]]
            pose = pose @ _turns(table.axes[link], angles)
        poses[:, link] = pose
    return poses


def landmark_positions(table: JointTable, joints: Array) -> Array:
    """Return the landmarks (B, P, 3) in the base frame [m] of postures (B, J) [rad]."""
    poses = link_poses(table, joints)[:, table.landmark_links]
    return np.asarray(
        np.einsum("bpij,pj->bpi", poses[..., :3, :3], table.landmark_offsets) + poses[..., :3, 3]
    )


def placed_capsules(table: JointTable, joints: Array) -> Array:
    """Return the capsule ends (B, C, 2, 3) in the base frame [m] of postures (B, J) [rad]."""
    poses = link_poses(table, joints)[:, table.capsules.links]
    turned = np.einsum("bcij,cej->bcei", poses[..., :3, :3], table.capsules.ends)
    return np.asarray(turned + poses[:, :, None, :3, 3])


def mirrored(table: JointTable) -> JointTable:
    """Return the mirror image under y -> -y; equal angles give mirrored postures."""
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    y_flip = np.array([1.0, -1.0, 1.0])
    return JointTable(
        table.name,
        table.link_names,
        table.parents,
        flip @ table.origins @ flip,
        -table.axes * y_flip,  # an axis of rotation is a pseudo-vector
        table.drivers,
        table.ratios,
        table.joint_names,
        table.limits,
        Capsules(table.capsules.links, table.capsules.ends * y_flip, table.capsules.radii),
        table.landmark_links,
        table.landmark_offsets * y_flip,
        LinkBoxes(table.boxes.links, flip @ table.boxes.poses @ flip, table.boxes.half_sizes),
    )


def _turns(axis: Array, angles: Array) -> Array:
    """Return the rotations (B, 4, 4) about a unit axis by angles (B,) [rad] (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turns = np.zeros((len(angles), 4, 4))
    turns[:, :3, :3] = (
        np.eye(3)
        + np.sin(angles)[:, None, None] * cross
        + (1.0 - np.cos(angles))[:, None, None] * (cross @ cross)
    )
    turns[:, 3, 3] = 1.0
    return turns
