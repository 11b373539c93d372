"""The robot's answer as pictures: its table, the ranked hypotheses, the chosen grasp."""

import numpy as np

from intent_imitation.demo.hand_mesh import hand_mesh
from intent_imitation.demo.mesh_pictures import (
    DrawnBody,
    Image,
    Tag,
    annotate,
    shaded,
    studio,
    task_color,
)
from intent_imitation.demo.panels import MARKED_COLOR, OBJECT_COLORS, picture_of_objects
from intent_imitation.demo.run_record import DemoRecord
from intent_imitation.planner.plan import GraspCandidate, GraspPlan
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.transforms import look_at
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

ROBOT_COLOR = (0.52, 0.56, 0.62)
_VIEWS = np.radians([115.0, -115.0, 75.0, -75.0, 150.0, -150.0, 40.0, -40.0])
"""Directions to look from, about the vertical, relative to the approach [rad]."""


def picture_of_robot_table(record: DemoRecord) -> Image | None:
    """Return the robot's table with p(o | t*) written on each object; None if it saw none."""
    frame, objects, plan = record.robot_frame, record.robot_objects, record.plan
    if frame is None or objects is None:
        return None
    if plan is None:
        return picture_of_objects(frame, objects, record.database)
    chances = {choice.id: choice.probability for choice in plan.objects if choice.judged}
    numbers = [chances.get(item.id) for item in objects.objects]
    chosen = plan.grasps[0].object_id if plan.grasps else None
    return picture_of_objects(frame, objects, record.database, numbers, chosen)


def picture_of_grasp(
    candidate: GraspCandidate,
    objects: RecognizedObjects,
    known: ObjectDatabase,
    size: tuple[int, int],
    hand: GraspingHand,
) -> Image:
    """Return the robot's closed hand on its object among its neighbours, RGB.

    Args:
        candidate: the grasp.
        objects: the robot's table.
        known: the database with their meshes.
        size: width and height of the picture in pixels.
        hand: that grasps.
    """
    shape = hand_mesh(hand.table, candidate.grasp_joints)
    bodies = [DrawnBody(shape, candidate.T_table_hand, ROBOT_COLOR)]
    target = objects.objects[0]
    for index, item in enumerate(objects.objects):
        color = OBJECT_COLORS[index % len(OBJECT_COLORS)]
        if item.id == candidate.object_id:
            target, color = item, MARKED_COLOR
        bodies.append(DrawnBody((item.shape or known[item.model]).mesh, item.T_table_object, color))
    own = [item.id for item in objects.objects].index(target.id) + 1
    T_table_camera = _best_view(candidate, target, known, bodies, own)
    return studio(_camera(*size), T_table_camera, bodies)


def _camera(width: int, height: int) -> Camera:
    focal = 1.5 * width
    return Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


def _best_view(
    candidate: GraspCandidate,
    target: RecognizedObject,
    known: ObjectDatabase,
    bodies: list[DrawnBody],
    own: int,
) -> Array:
    """Return T_table_camera of the view in which neighbours hide hand and object least."""
    wrist = candidate.T_table_hand[:3, 3]
    middle = 0.45 * wrist + 0.55 * target.T_table_object[:3, 3]
    model = target.shape or known[target.model]
    reach = model.diameter / 2 + float(np.linalg.norm(middle - wrist))
    flat = candidate.approach[:2]
    start = np.arctan2(flat[1], flat[0]) if np.linalg.norm(flat) > 0.2 else -np.pi / 2
    distance = max(0.45, 4.0 * reach)
    best, best_seen = np.eye(4), -1.0
    for turn in _VIEWS:
        angle = start + turn
        eye = np.array([0.88 * np.cos(angle), 0.88 * np.sin(angle), 0.47]) * distance + middle
        pose = look_at(eye, middle)
        label = shaded(_camera(72, 72), pose, bodies)[1]
        hand, thing = float(np.sum(label == 0)), float(np.sum(label == own))
        seen = min(hand, 2.0 * thing) + 0.2 * (hand + thing)
        if seen > 1.08 * best_seen:
            best, best_seen = pose, seen
    return best


def pictures_of_hypotheses(record: DemoRecord, count: int = 4) -> list[Image]:
    """Return the best grasp hypotheses as small pictures with rank and p(t* | o*, a)."""
    plan, objects = record.plan, record.robot_objects
    if plan is None or objects is None or record.robot_hand is None:
        return []
    pictures = []
    for rank, candidate in enumerate(different(plan, count)):
        picture = picture_of_grasp(
            candidate, objects, record.database, (400, 540), record.robot_hand
        )
        words = f"p = {candidate.score_parts.get('task', candidate.score):.2f}"
        code = task_color(plan.task, (plan.task,))
        red, green, blue = (int(code[k : k + 2], 16) / 255 for k in (1, 3, 5))
        tag = Tag(f"{rank + 1}   {words}", (red, green, blue), (0.0, 0.0))
        pictures.append(annotate(picture, [tag], size=0.8))
    return pictures


def different(
    plan: GraspPlan, count: int, turn: float = 0.5, shift: float = 0.03
) -> list[GraspCandidate]:
    """Return the best candidates that differ from one another by a turn [rad] or a shift [m]."""
    chosen: list[GraspCandidate] = []
    for candidate in plan.grasps:
        if all(_differ(candidate, other, turn, shift) for other in chosen):
            chosen.append(candidate)
    rest = [candidate for candidate in plan.grasps if candidate not in chosen]
    return (chosen + rest)[:count]


def _differ(a: GraspCandidate, b: GraspCandidate, turn: float, shift: float) -> bool:
    relative = a.T_table_hand[:3, :3].T @ b.T_table_hand[:3, :3]
    angle = np.arccos(np.clip((np.trace(relative) - 1.0) / 2.0, -1.0, 1.0))
    distance = np.linalg.norm(a.T_table_hand[:3, 3] - b.T_table_hand[:3, 3])
    return bool(angle > turn or distance > shift)
