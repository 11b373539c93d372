"""Is the way to a grasp free? The robot's hand against the table, the neighbours and the object."""

from dataclasses import dataclass

import numpy as np

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_tracking.scene.joint_table import link_poses

_RETREATS = (0.16, 0.11, 0.07, 0.035, 0.0)
"""Stations of the approach, back from the grasp along the approach direction [m]."""
_CLOSINGS = (0.35, 0.7, 1.0)
"""Stations of the closing, as shares of the way from the open to the closed posture."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """One object on the robot's table."""

    T_table_object: Array
    """(4, 4) recognised pose."""
    distance: SignedDistance
    """Of its mesh, in the object frame."""


@dataclass(frozen=True, eq=False)
class Clearances:
    """How much room G grasps leave on their way; negative = penetration [m]."""

    table: Array
    """(G,) least gap to the table."""
    neighbours: Array
    """(G,) least gap to any other object; infinite where there is none."""
    target: Array
    """(G,) least gap of the open hand to the object to be grasped, along the approach."""

    @property
    def surroundings(self) -> Array:
        """(G,) the smaller of table and neighbours."""
        return np.minimum(self.table, self.neighbours)


def clearances(
    hand: GraspingHand,
    T_table_hands: Array,
    approaches: Array,
    pregrasps: Array,
    grasps: Array,
    target: Obstacle,
    neighbours: tuple[Obstacle, ...],
) -> Clearances:
    """Return the room along approach and closing of G grasps.

    The open hand moves straight along `approaches` to its final pose, then the fingers close.

    Args:
        hand: the robot's hand.
        T_table_hands: (G, 4, 4) final poses of the hand's base.
        approaches: (G, 3) unit directions of motion in the table frame.
        pregrasps: (G, J) open postures [rad].
        grasps: (G, J) closed postures [rad].
        target: the object to be grasped.
        neighbours: the other objects.

    Returns:
        (G,) gaps to each kind of obstacle.
    """
    stations = [(retreat, 0.0) for retreat in _RETREATS] + [(0.0, share) for share in _CLOSINGS]
    radii = hand.arrays.sphere_radii.astype(np.float64)
    table = np.full(len(grasps), np.inf)
    others = np.full(len(grasps), np.inf)
    own = np.full(len(grasps), np.inf)
    local = [
        hand_spheres(hand, pregrasps + share * (grasps - pregrasps)) for share in (0.0, *_CLOSINGS)
    ]
    for retreat, share in stations:
        centers = local[0] if share == 0.0 else local[1 + _CLOSINGS.index(share)]
        placed = centers @ np.swapaxes(T_table_hands[:, :3, :3], 1, 2)
        placed += (T_table_hands[:, :3, 3] - retreat * approaches)[:, None]
        table = np.minimum(table, (placed[..., 2] - radii).min(axis=1))
        for obstacle in neighbours:
            others = np.minimum(others, _gap(obstacle, placed, radii))
        if share == 0.0:
            own = np.minimum(own, _gap(target, placed, radii))
    return Clearances(table, others, own)


def hand_spheres(hand: GraspingHand, joints: Array) -> Array:
    """Return the covering spheres' centres (G, S, 3) in the hand frame [m] at (G, J) [rad]."""
    poses = link_poses(hand.table, joints)
    starts = hand.arrays.sphere_starts
    centers = hand.arrays.sphere_centers.astype(np.float64)
    spheres = np.empty((len(poses), len(centers), 3))
    for link in range(len(starts) - 1):
        own = slice(starts[link], starts[link + 1])
        turned = centers[own] @ np.swapaxes(poses[:, link, :3, :3], 1, 2)
        spheres[:, own] = turned + poses[:, link, None, :3, 3]
    return spheres


def _gap(obstacle: Obstacle, points: Array, radii: Array) -> Array:
    """Return the least distance (G,) between spheres (G, S, 3) and an obstacle [m]."""
    rotation, translation = obstacle.T_table_object[:3, :3], obstacle.T_table_object[:3, 3]
    local = (points.reshape(-1, 3) - translation) @ rotation
    distance = obstacle.distance.distance(local).reshape(points.shape[:2])
    return np.asarray((distance - radii).min(axis=1))
