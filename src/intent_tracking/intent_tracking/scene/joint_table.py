"""Articulated hands as one table: links, joints, limits and shapes, for any hand.

The human hand (`intent_tracking.scene.hand_model`) and a robot hand are both a `JointTable`;
tracker, grasp features, simulation and drawing read the same one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import require_pose

Indices = NDArray[np.int64]
_WIDEST = 100.0
"""Angles and coupling factors of a hand are smaller."""
_LARGEST = 1.0
"""Lengths of a hand's shapes are smaller [m]."""


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

    The pose of link l in its parent is `origins[l]` followed by a turn about `axes[l]`, or for a
    sliding joint a shift along it, by `ratios[l] * q[drivers[l]]`; parents stand before their
    children.
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
    """(J, 2) lower and upper angle [rad], of sliding joints place [m]."""
    capsules: Capsules
    landmark_links: Indices
    """(P,) link of each landmark (joints, fingertips)."""
    landmark_offsets: Array
    """(P, 3) landmark in its link's frame [m]."""
    boxes: LinkBoxes = NO_BOXES
    sliding: tuple[int, ...] = ()
    """Links that slide along their axis instead of turning about it."""

    @property
    def slides(self) -> NDArray[np.bool_]:
        """(L,) whether each link slides."""
        return np.isin(np.arange(len(self.link_names)), self.sliding)

    @property
    def sliding_joints(self) -> NDArray[np.bool_]:
        """(J,) whether the value of each joint is a place [m], not an angle [rad]."""
        return np.isin(np.arange(len(self.joint_names)), self.drivers[list(self.sliding)])

    def __post_init__(self) -> None:
        links = len(self.link_names)
        if np.any(self.parents[1:] >= np.arange(1, links)) or self.parents[0] != -1:
            raise ValueError(f"{self.name}: every parent must stand before its children")
        if self.limits.shape != (len(self.joint_names), 2):
            raise ValueError(
                f"{self.name}: expected limits ({len(self.joint_names)}, 2), "
                f"got {self.limits.shape}"
            )
        self._check_values()

    def _check_values(self) -> None:
        """Refuse joints that cannot turn and shapes that are none.

        Raises:
            ValueError: that names the joint or link.
        """
        for name, (low, high) in zip(self.joint_names, self.limits, strict=True):
            if not -_WIDEST <= low <= high <= _WIDEST:
                raise ValueError(f"{self.name}: joint {name}: expected limits lower <= upper [rad]")
        require_pose(self.origins, f"{self.name}: the origin of each link")
        for link in np.flatnonzero(self.drivers >= 0):
            length = float(np.linalg.norm(self.axes[link]))
            if not abs(length - 1.0) < 1e-3 or not 0.0 < abs(self.ratios[link]) < _WIDEST:
                raise ValueError(
                    f"{self.name}: link {self.link_names[link]}: expected an axis of length 1 and "
                    f"a ratio other than 0, got {self.axes[link]}, {self.ratios[link]}"
                )
        shapes = self.capsules
        sizes = (("radius", shapes.links, shapes.radii[:, None]),
                 ("box", self.boxes.links, self.boxes.half_sizes))  # fmt: skip
        for what, links, values in sizes:
            wrong = ~np.all((values > 0.0) & (values < _LARGEST), axis=1)
            if np.any(wrong):
                link = self.link_names[links[np.flatnonzero(wrong)[0]]]
                raise ValueError(f"{self.name}: link {link}: expected a {what} above 0 m, below 1")
        if not np.all(np.abs(shapes.ends) < _LARGEST):
            raise ValueError(f"{self.name}: expected shapes within {_LARGEST:g} m of their links")
        require_pose(self.boxes.poses, f"{self.name}: the pose of each box")


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
    ways = _turns(table.axes, table.ratios * joints[:, table.drivers])
    for link in table.sliding:
        places = table.ratios[link] * joints[:, table.drivers[link]]
        ways[:, link] = _shifts(table.axes[link], places)
    for link, parent in enumerate(table.parents):
        pose = poses[:, parent] @ table.origins[link] if parent >= 0 else table.origins[link]
        if table.drivers[link] >= 0:
            pose = pose @ ways[:, link]
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
    # An axis of rotation is a pseudo-vector, a direction of sliding is none.
    sense = np.where(table.slides, 1.0, -1.0)[:, None]
    return JointTable(
        table.name,
        table.link_names,
        table.parents,
        flip @ table.origins @ flip,
        sense * table.axes * y_flip,
        table.drivers,
        table.ratios,
        table.joint_names,
        table.limits,
        Capsules(table.capsules.links, table.capsules.ends * y_flip, table.capsules.radii),
        table.landmark_links,
        table.landmark_offsets * y_flip,
        LinkBoxes(table.boxes.links, flip @ table.boxes.poses @ flip, table.boxes.half_sizes),
        table.sliding,
    )


def _shifts(axis: Array, places: Array) -> Array:
    """Return the shifts (B, 4, 4) along a unit axis by (B,) [m]."""
    shifts = np.tile(np.eye(4), (len(places), 1, 1))
    shifts[:, :3, 3] = places[:, None] * axis
    return shifts


def _turns(axes: Array, angles: Array) -> Array:
    """Return the rotations (B, L, 4, 4) about unit axes (L, 3) by angles (B, L) [rad] (Rodrigues).

    Of a link that is not driven axis and angle mean nothing, and neither does its rotation.
    """
    x, y, z = axes.T
    none = np.zeros_like(x)
    cross = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    turns = np.zeros((*angles.shape, 4, 4))
    turns[..., :3, :3] = (
        np.eye(3)
        + np.sin(angles)[..., None, None] * cross
        + (1.0 - np.cos(angles))[..., None, None] * (cross @ cross)
    )
    turns[..., 3, 3] = 1.0
    return turns
