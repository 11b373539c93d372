"""Any hand of a joint table as a mesh, to be drawn like every other object."""

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.mesh import Mesh, merge_meshes
from intent_tracking.scene.joint_table import JointTable, link_poses, placed_capsules

_AROUND = 20
_RINGS = 6
_BOX_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def hand_mesh(table: JointTable, joints: Array) -> Mesh:
    """Return the hand's capsules and boxes as one mesh.

    Args:
        table: the hand.
        joints: (J,) posture [rad].

    Returns:
        Mesh in the hand's base frame.
    """
    ends = placed_capsules(table, joints)[0]
    parts = [capsule_mesh(e, float(r)) for e, r in zip(ends, table.capsules.radii, strict=True)]
    poses = link_poses(table, joints)[0][table.boxes.links] @ table.boxes.poses
    parts += [box_mesh(p, h) for p, h in zip(poses, table.boxes.half_sizes, strict=True)]
    return merge_meshes(parts)


def capsule_mesh(ends: Array, radius: float) -> Mesh:
    """Return a capsule between the centres ends (2, 3) [m]."""
    axis = ends[1] - ends[0]
    length = float(np.linalg.norm(axis))
    z = axis / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    x = np.cross(z, [0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    polar = np.linspace(-np.pi / 2, 0.0, _RINGS)
    heights = np.concatenate([radius * np.sin(polar), length - radius * np.sin(polar[::-1])])
    widths = np.concatenate([radius * np.cos(polar), radius * np.cos(polar[::-1])])
    turn = np.linspace(0.0, 2 * np.pi, _AROUND, endpoint=False)
    circle = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    vertices = ends[0] + heights[:, None, None] * z + widths[:, None, None] * circle
    ring, step = np.meshgrid(np.arange(len(heights) - 1), np.arange(_AROUND), indexing="ij")
    a = ring * _AROUND + step
    b = ring * _AROUND + (step + 1) % _AROUND
    lower = np.stack([a, b, b + _AROUND], axis=-1)
    upper = np.stack([a, b + _AROUND, a + _AROUND], axis=-1)
    return Mesh.of(vertices.reshape(-1, 3), np.concatenate([lower, upper]).reshape(-1, 3))


def box_mesh(pose: Array, half_size: Array) -> Mesh:
    """Return a box at a pose (4, 4) with half its edges (3,) [m]."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    return Mesh.of((signs * half_size) @ pose[:3, :3].T + pose[:3, 3], _BOX_FACES)
