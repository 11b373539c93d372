"""Features of a grasp, Table I: the same code for simulated and for tracked grasps.

The paper defines size, dir, npos, fcon and obcl; conv, fvol, coc and gbvl are named but not
defined there, so their definitions below are ours.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from intent_perception.basics.arrays import Array
from intent_perception.basics.kernels import exact_kernel
from intent_perception.geometry.boxes import Box
from intent_perception.geometry.transforms import quaternion_from_rotation, transform_points
from intent_perception.objects.database import ObjectModel
from intent_tracking.scene.joint_table import JointTable, link_poses

_SAMPLES = 2000
_DILATION = 0.010
"""The hand covers what lies in the convex hull of its links dilated by this [m]."""
_TOUCH = 0.004
"""A part of the hand touches where its skin is this close to a surface sample [m]."""
_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T / np.sqrt(3.0)
_SHELL = np.concatenate([np.eye(3), -np.eye(3), _CORNERS])


@dataclass(frozen=True, eq=False)
class GraspFeatures:
    """The variables of Table I for one grasp; None where a variable was not observed."""

    object_class: str | None
    """`obcl`."""
    size: Array | None
    """(3,) edges of the object's bounding box along the object axes [m]."""
    conv: Array | None
    """(1,) volume of the object / volume of its convex hull; None for an open mesh."""
    dir: Array | None
    """(4,) orientation of the hand in the object frame, quaternion xyzw with w >= 0."""
    npos: Array | None
    """(3,) unit vector from the centre of the object's box to the palm, object frame."""
    fcon: Array | None
    """(J,) joint angles [rad]."""
    fvol: Array | None
    """(1,) share of the object's surface that the closed hand leaves free."""
    coc: Array | None
    """(3,) mean contact point relative to the box centre / half the box edges."""
    gbvl: Array | None
    """(3,) edges of the box nearest to the contacts, longest first [m]."""


_UNIT = 0.01
"""Tolerance of unit vectors and shares: messages round."""
FEATURE_RANGES = {
    "size": (3, 1e-4, 10.0),
    "conv": (1, -_UNIT, 1.0 + _UNIT),
    "dir": (4, -1.0 - _UNIT, 1.0 + _UNIT),
    "npos": (3, -1.0 - _UNIT, 1.0 + _UNIT),
    "fcon": (0, -6.2832, 6.2832),
    "fvol": (1, -_UNIT, 1.0 + _UNIT),
    "coc": (3, -20.0, 20.0),
    "gbvl": (3, 0.0, 10.0),
}
"""Of each variable of Table I: how many values (0: one per joint), least and greatest."""
_LARGEST_DEVIATION = 100.0


def check_features(features: GraspFeatures, std: GraspFeatures | None = None) -> None:
    """Refuse values of Table I that no grasp has, and deviations that are none.

    Raises:
        ValueError: that names the variable, what it may be and what it is.
    """
    for name, (count, low, high) in FEATURE_RANGES.items():
        value = getattr(features, name)
        if value is None:
            continue
        values = np.ravel(value)
        fits = len(values) == count if count else 0 < len(values) <= 100
        if not fits or not np.all((values >= low) & (values <= high)):
            raise ValueError(
                f"expected {name} as {count or 'some'} values in {low:g}..{high:g}, "
                f"got {_shown(values)}"
            )
        if name in ("dir", "npos") and abs(float(np.linalg.norm(values)) - 1.0) > _UNIT:
            raise ValueError(f"expected {name} as a unit vector, got {_shown(values)}")
        spread = getattr(std, name, None)
        if spread is None:
            continue
        deviations = np.ravel(spread)
        known = deviations[~np.isnan(deviations)]
        if len(deviations) != len(values) or not np.all(
            (known >= 0.0) & (known <= _LARGEST_DEVIATION)
        ):
            raise ValueError(
                f"expected {len(values)} standard deviations of {name} from 0 on, "
                f"got {_shown(deviations)}"
            )


def _shown(values: Array) -> str:
    """Return at most four values as words."""
    some = ", ".join(f"{value:.4g}" for value in values[:4])
    return f"{len(values)} values {some}{' …' if len(values) > 4 else ''}"


class GraspedShape:
    """What the features need of an object, computed once."""

    def __init__(self, model: ObjectModel) -> None:
        self.model = model
        self.size, self.center = model.size, model.center
        rng = np.random.default_rng(0)
        self.points, self.normals, _ = model.mesh.sample_surface(_SAMPLES, rng)

    def prepare(self) -> None:
        """Compute now what is otherwise computed when it is first asked for."""
        _ = self.boxes, self.convexity, self.mirror

    @property
    def boxes(self) -> tuple[Box, ...]:
        """Boxes that the object decomposes into."""
        return self.model.boxes

    @cached_property
    def convexity(self) -> Array | None:
        """`conv` (1,); None where the mesh encloses no volume."""
        mesh = self.model.mesh
        if not mesh.is_watertight or mesh.volume <= 0.0:
            return None
        return np.array([self.model.convexity])

    @cached_property
    def mirror(self) -> Array:
        """Reflection (4, 4) of the object frame that changes the object's surface least.

        A left-hand grasp, reflected by it, is a right-hand grasp on the same object as far as the
        object is its own mirror image; cups, bottles and tools are.
        """
        samples = self.points[::4] - self.center
        nearest, errors = cKDTree(samples), []
        for axis in range(3):
            flip = np.ones(3)
            flip[axis] = -1.0
            errors.append(float(nearest.query(samples * flip)[0].mean()))
        # y = 0 is the plane of handles, blades and heads; round objects have several.
        best = 1 if errors[1] < 1.5 * min(errors) else int(np.argmin(errors))
        reflection = np.eye(4)
        reflection[best, best] = -1.0
        reflection[best, 3] = 2.0 * self.center[best]
        return reflection


def grasp_features(
    geometry: GraspedShape, T_object_hand: Array, joints: Array, table: JointTable
) -> GraspFeatures:
    """Return Table I of one grasp.

    Args:
        geometry: the object.
        T_object_hand: (4, 4) the hand's frame (`hand_wrist`) in the object frame.
        joints: (J,) [rad].
        table: the hand; a right hand, or the mirrored grasp of a left one (`as_right_hand`).
    """
    points_hand = _in_hand(geometry.points, T_object_hand)
    palm = transform_points(T_object_hand, palm_center(table)) - geometry.center
    contact = contact_center(geometry.points, points_hand, table, joints)
    return GraspFeatures(
        geometry.model.object_class,
        geometry.size,
        geometry.convexity,
        quaternion_from_rotation(T_object_hand[:3, :3]),
        palm / np.linalg.norm(palm),
        np.asarray(joints, dtype=np.float64),
        np.array([free_share(points_hand, table, joints)]),
        (contact - geometry.center) / np.maximum(geometry.size / 2.0, 1e-6),
        grasped_box(geometry.boxes, contact),
    )


def as_right_hand(geometry: GraspedShape, T_object_hand: Array) -> Array:
    """Return the pose (4, 4) of the right hand that mirrors a left hand's grasp of the object."""
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    return geometry.mirror @ T_object_hand @ flip


def palm_center(table: JointTable) -> Array:
    """Return the middle (3,) of the shapes of the hand's base in the hand frame [m]."""
    capsules = table.capsules.ends[table.capsules.links == 0].reshape(-1, 3)
    boxes = table.boxes.poses[table.boxes.links == 0][:, :3, 3]
    points = np.concatenate([capsules, boxes])
    return np.asarray(0.5 * (points.min(axis=0) + points.max(axis=0)))


def hand_distances(points_hand: Array, table: JointTable, joints: Array) -> Array:
    """Return the distance (N, C + K) of points to the skin of every capsule and box [m].

    Args:
        points_hand: (N, 3) in the hand frame [m].
        table: the hand with C capsules and K boxes.
        joints: (J,) [rad].
    """
    poses = link_poses(table, joints)[0]
    shapes = table.capsules
    ends = np.einsum("cij,cej->cei", poses[shapes.links][:, :3, :3], shapes.ends)
    ends = ends + poses[shapes.links][:, None, :3, 3]
    gap = np.empty((len(points_hand), len(ends)))
    _capsule_gaps(np.ascontiguousarray(points_hand), ends, shapes.radii, gap)
    if len(table.boxes.links) == 0:
        return np.asarray(gap)
    T_hand_box = poses[table.boxes.links] @ table.boxes.poses
    local = np.einsum(
        "nki,kij->nkj", points_hand[:, None] - T_hand_box[:, :3, 3], T_hand_box[:, :3, :3]
    )
    outside = np.abs(local) - table.boxes.half_sizes
    box_gap = np.linalg.norm(np.maximum(outside, 0.0), axis=2) + np.minimum(
        outside.max(axis=2), 0.0
    )
    return np.concatenate([gap, box_gap], axis=1)


@exact_kernel
def _capsule_gaps(points: Array, ends: Array, radii: Array, gaps: Array) -> None:
    """Write the distance (N, C) of points (N, 3) to capsules with ends (C, 2, 3)."""
    for c in range(len(ends)):
        ax, ay, az = ends[c, 0]
        ux, uy, uz = ends[c, 1, 0] - ax, ends[c, 1, 1] - ay, ends[c, 1, 2] - az
        length = max(ux * ux + uy * uy + uz * uz, 1e-12)
        for n in range(len(points)):
            px, py, pz = points[n, 0] - ax, points[n, 1] - ay, points[n, 2] - az
            share = min(1.0, max(0.0, (px * ux + py * uy + pz * uz) / length))
            dx, dy, dz = px - share * ux, py - share * uy, pz - share * uz
            gaps[n, c] = np.sqrt(dx * dx + dy * dy + dz * dz) - radii[c]


def contact_center(points: Array, points_hand: Array, table: JointTable, joints: Array) -> Array:
    """Return the mean (3,) of the surface points nearest to each touching part of the hand [m].

    If nothing touches, the nearest part counts: a tracked hand may float a few millimetres off.

    Args:
        points: (N, 3) surface samples in the object frame [m].
        points_hand: (N, 3) the same in the hand frame [m].
        table: the hand.
        joints: (J,) [rad].
    """
    distances = hand_distances(points_hand, table, joints)
    nearest = distances.min(axis=0)
    parts = np.flatnonzero(nearest < max(_TOUCH, float(nearest.min()) + 0.001))
    return np.asarray(points[distances[:, parts].argmin(axis=0)].mean(axis=0))


def free_share(points_hand: Array, table: JointTable, joints: Array) -> float:
    """Return the share of surface points (N, 3) outside the hull of the dilated hand, `fvol`."""
    poses = link_poses(table, joints)[0]
    shapes = table.capsules
    ends = np.einsum("cij,cej->cei", poses[shapes.links][:, :3, :3], shapes.ends)
    ends = ends + poses[shapes.links][:, None, :3, 3]
    reach = (shapes.radii + _DILATION)[:, None, None, None] * _SHELL
    cloud = [(ends[:, :, None] + reach).reshape(-1, 3)]
    for link, pose, half in zip(
        table.boxes.links, table.boxes.poses, table.boxes.half_sizes, strict=True
    ):
        corners = _CORNERS * np.sqrt(3.0) * (half + _DILATION)
        cloud.append(transform_points(poses[link] @ pose, corners))
    planes = ConvexHull(np.concatenate(cloud)).equations
    covered = np.all(points_hand @ planes[:, :3].T + planes[:, 3] < 0.0, axis=1)
    return float(1.0 - covered.mean())


def grasped_box(boxes: tuple[Box, ...], point: Array) -> Array:
    """Return the edges (3,), longest first [m], of the box nearest to a point (3,), `gbvl`."""
    outside = [
        float((np.abs((point - box.center) @ box.rotation) - box.half_size).max()) for box in boxes
    ]
    return np.asarray(np.sort(2.0 * boxes[int(np.argmin(outside))].half_size)[::-1])


def _in_hand(points: Array, T_object_hand: Array) -> Array:
    return np.asarray((points - T_object_hand[:3, 3]) @ T_object_hand[:3, :3])
