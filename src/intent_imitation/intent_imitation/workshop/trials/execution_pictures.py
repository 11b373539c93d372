"""An execution as a strip of pictures: one for each stage of the motion."""

from collections.abc import Sequence

import numpy as np

from intent_imitation.demo.grasp_pictures import ROBOT_COLOR
from intent_imitation.demo.hand_mesh import hand_mesh
from intent_imitation.demo.mesh_pictures import DrawnBody, Image, Tag, annotate, studio
from intent_imitation.demo.panels import MARKED_COLOR, OBJECT_COLORS, mosaic
from intent_imitation.workshop.trials.execution import Outcome, Snapshot
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera
from intent_perception.geometry.transforms import look_at
from intent_perception.objects.database import ObjectModel

STRIP_CAMERA = Camera(400, 460, 620.0, 620.0, 199.5, 229.5)
_GOOD, _BAD = (0.10, 0.65, 0.35), (0.85, 0.25, 0.20)


def picture_of_execution(
    outcome: Outcome, hand: GraspingHand, models: Sequence[ObjectModel], target: int, words: str
) -> Image:
    """Return the stages of an execution side by side, the last one with what came of it.

    Args:
        outcome: of `World.execute`.
        hand: the robot's hand.
        models: N objects of the scene.
        target: index of the object to be grasped.
        words: caption of the first picture.
    """
    first, last = outcome.snapshots[0], outcome.snapshots[-1]
    middle = 0.5 * (first.T_table_objects[target][:3, 3] + last.T_table_hand[:3, 3])
    away = first.T_table_hand[:3, 3] - first.T_table_objects[target][:3, 3]
    angle = np.arctan2(away[1], away[0]) + np.radians(75.0)
    eye = middle + np.array([0.85 * np.cos(angle), 0.85 * np.sin(angle), 0.36])
    T_table_camera = look_at(eye, middle)
    tiles = []
    for index, snapshot in enumerate(outcome.snapshots):
        tile = studio(STRIP_CAMERA, T_table_camera, _bodies(snapshot, hand, models, target))
        text, color = (words, (1.0, 1.0, 1.0)) if index == 0 else (snapshot.stage, (1.0, 1.0, 1.0))
        if snapshot is last:
            text = f"{snapshot.stage}: {'held' if outcome.held else 'lost'}"
            color = _GOOD if outcome.held else _BAD
        tiles.append(annotate(tile, [Tag(text, color, (0.0, 0.0))], size=0.65))
    return mosaic(tiles, len(tiles))


def _bodies(
    snapshot: Snapshot, hand: GraspingHand, models: Sequence[ObjectModel], target: int
) -> list[DrawnBody]:
    """Return hand and objects of a snapshot; the target is green."""
    placed: list[tuple[ObjectModel, Array]] = list(
        zip(models, snapshot.T_table_objects, strict=True)
    )
    bodies = [DrawnBody(hand_mesh(hand.table, snapshot.joints), snapshot.T_table_hand, ROBOT_COLOR)]
    for index, (model, pose) in enumerate(placed):
        color = MARKED_COLOR if index == target else OBJECT_COLORS[index % len(OBJECT_COLORS)]
        bodies.append(DrawnBody(model.mesh, pose, color))
    return bodies
