"""Pictures of grasps, and sheets of positives and negatives per class and task to judge labels."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.labels import TASKS, label_grasp
from intent_inference.workshop.simulation.simulated_grasp import SimulatedGrasp
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.mesh import Mesh, convex_hull, merge_meshes
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse, look_at
from intent_tracking.scene.joint_table import JointTable, link_poses, placed_capsules

Image = NDArray[np.uint8]

_SKIN, _PALM, _ARM = (0.93, 0.70, 0.56), (0.86, 0.62, 0.50), (0.55, 0.62, 0.72)
_METAL, _DARK = (0.72, 0.74, 0.78), (0.42, 0.44, 0.50)
_THUMB = (0.84, 0.48, 0.40)


def hand_meshes(table: JointTable, joints: Array) -> tuple[list[Mesh], list[tuple[float, ...]]]:
    """Return meshes of palm, fingers, thumb and forearm in the hand frame, and their colours.

    Args:
        table: the hand.
        joints: (J,) [rad].
    """
    human = table.name.startswith("human")
    ends, radii = placed_capsules(table, joints)[0], table.capsules.radii
    poses = link_poses(table, joints)[0]
    pieces = [_capsule(end, radius) for end, radius in zip(ends, radii, strict=True)]
    names = [table.link_names[link] for link in table.capsules.links]
    for link, pose, half in zip(
        table.boxes.links, table.boxes.poses, table.boxes.half_sizes, strict=True
    ):
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T * half
        placed = poses[link] @ pose
        pieces.append(convex_hull(corners @ placed[:3, :3].T + placed[:3, 3]))
        names.append(table.link_names[link])
    groups = {
        "palm": [p for p, name in zip(pieces, names, strict=True) if name == table.link_names[0]],
        "thumb": [p for p, name in zip(pieces, names, strict=True) if name.startswith("thumb")],
    }
    taken = [*groups["palm"], *groups["thumb"]]
    fingers = [piece for piece in pieces if not any(piece is other for other in taken)]
    back = np.array([-1.0, 0.0, 0.0]) if human else np.array([0.0, 0.0, -1.0])
    arm = _capsule(np.array([0.01 * back, 0.13 * back]), 0.024 if human else 0.045)
    colors = (_PALM, _THUMB, _SKIN, _ARM) if human else (_DARK, _THUMB, _METAL, _ARM)
    meshes = [groups["palm"], groups["thumb"], fingers]
    return [merge_meshes(group) for group in meshes if group] + [arm], [
        color for group, color in zip([*meshes, [arm]], colors, strict=True) if group
    ]


def grasp_picture(
    target: TaskObject, hand: GraspingHand, T_object_hand: Array, joints: Array, size: int = 200
) -> Image:
    """Return a picture (size, size, 3) of a grasp, seen from the thumb side, object upright."""
    meshes, colors = hand_meshes(hand.table, joints)
    side = T_object_hand[:3, :3] @ np.array([0.0, -1.0, 0.0])
    back = T_object_hand[:3, :3] @ np.array([0.0, 0.0, -1.0])
    middle = 0.5 * (target.geometry.center + T_object_hand[:3, :3] @ [0.06, 0, 0.02]) + (
        0.5 * T_object_hand[:3, 3]
    )
    direction = side + 0.55 * back + np.array([0.05, 0.1, 0.35])
    direction /= np.linalg.norm(direction)
    if abs(direction[2]) > 0.85:  # keep the object upright in the picture
        direction = 0.6 * direction + 0.6 * back + np.array([0.3, 0.2, 0.0])
        direction /= np.linalg.norm(direction)
    T_object_camera = look_at(middle + 0.62 * direction, middle)
    camera = Camera(size, size, 1.75 * size, 1.75 * size, size / 2 - 0.5, size / 2 - 0.5)
    T_camera_object = inverse(T_object_camera)
    T_camera_hand = T_camera_object @ T_object_hand
    rendered = render(
        camera,
        [target.mesh, *meshes],
        np.stack([T_camera_object] + [T_camera_hand] * len(meshes)),
        np.array([target.model.color, *colors]),
    )
    assert rendered.color is not None
    picture = rendered.color.copy()
    picture[rendered.label < 0] = 255
    return picture


def task_sheet(
    target_of: dict[str, TaskObject],
    hand: GraspingHand,
    grasps: Sequence[SimulatedGrasp],
    object_class: str,
    task: str,
    count: int = 10,
) -> Image | None:
    """Return `count` positives above `count` negatives of a class and a task.

    None where the class never affords the task or there is no grasp. Both halves are spread over
    their margins.

    Args:
        target_of: the objects by name.
        hand: the hand.
        grasps: accepted grasps.
        object_class: class to show.
        task: one of `TASKS`.
        count: pictures in each half.
    """
    chosen = [g for g in grasps if target_of[g.object_name].model.object_class == object_class]
    labelled = []
    for grasp in chosen:
        target = target_of[grasp.object_name]
        label = label_grasp(target, hand, grasp.T_object_hand, grasp.joints, grasp.contacts)[task]
        labelled.append((label.margin, label, grasp))
    if task not in TASKS or not any(label.terms for _, label, _ in labelled):
        return None
    labelled.sort(key=lambda item: item[0])
    halves = [
        [item for item in labelled if item[1].afforded],
        [item for item in labelled if item[1].afforded is False],
    ]
    rows: list[Image] = []
    for half, border in zip(halves, ((40, 150, 60), (200, 50, 40)), strict=True):
        places = np.linspace(0, len(half) - 1, count) if half else np.zeros(0)
        spread = np.unique(places.astype(int))
        tiles = []
        for index in spread:
            margin, label, grasp = half[index]
            worst = min(label.terms, key=lambda term: label.terms[term], default="class")
            picture = grasp_picture(
                target_of[grasp.object_name], hand, grasp.T_object_hand, grasp.joints
            )
            caption = f"{grasp.preshape} {margin:+.2f} {worst}"
            tiles.append(_captioned(picture, caption, border))
        rows += _rows(tiles, count)
    return np.concatenate(rows) if rows else None


def _rows(tiles: list[Image], count: int, columns: int = 5) -> list[Image]:
    blank = np.full((200, 200, 3), 255, dtype=np.uint8)
    filled = tiles + [blank] * (count - len(tiles))
    return [
        np.concatenate(filled[start : start + columns], axis=1)
        for start in range(0, count, columns)
    ]


def _captioned(picture: Image, caption: str, border: tuple[int, int, int]) -> Image:
    import cv2

    tile = np.ascontiguousarray(picture)
    cv2.rectangle(tile, (0, 0), (tile.shape[1] - 1, tile.shape[0] - 1), border, 2)
    cv2.putText(tile, caption, (5, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (30, 30, 30), 1)
    return tile


def _capsule(ends: Array, radius: float) -> Mesh:
    """Return a mesh around two centres (2, 3) [m]."""
    golden = np.pi * (3.0 - np.sqrt(5.0))
    steps = np.arange(48)
    z = 1.0 - 2.0 * (steps + 0.5) / len(steps)
    ring = np.sqrt(1.0 - z**2)
    ball = np.stack([ring * np.cos(golden * steps), ring * np.sin(golden * steps), z], axis=1)
    return convex_hull(np.concatenate([ends[0] + radius * ball, ends[1] + radius * ball]))
