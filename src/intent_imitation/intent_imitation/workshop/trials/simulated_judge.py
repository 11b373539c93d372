"""What simulated grasps say is true of a scene: the benchmark's judge, unknown to the planner."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_imitation.planner.collision import Obstacle, clearances
from intent_imitation.planner.planner_config import PlannerConfig
from intent_imitation.workshop.trials.robot_tables import Scene
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.workshop.simulation.grasp_table import poses_of_rows, read_rows
from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance

_UPRIGHT = 0.5
"""A vessel pours only if its opening points up: cosine of 60 degrees."""
_CHECKED = 150
"""Labelled grasps per object that are checked for room."""


@dataclass(frozen=True, eq=False)
class LabelledGrasps:
    """G stable grasps of one object with their labels."""

    T_object_hand: Array
    """(G, 4, 4)."""
    approach: Array
    """(G, 3) in the object frame."""
    pregrasp_joints: Array
    grasp_joints: Array
    """(G, J) [rad]."""
    labels: dict[str, NDArray[np.bool_]]
    """Task to (G,) whether the grasp affords it."""


def read_experience(path: Path, hand: GraspingHand) -> dict[str, LabelledGrasps]:
    """Return the labelled grasps of every object in a data set of `simulate`."""
    by_object: dict[str, list[dict[str, str]]] = {}
    for row in read_rows(path):
        by_object.setdefault(row["object_id"], []).append(row)
    opened = {preshape.name: preshape for preshape in hand.preshapes}
    found = {}
    for name, rows in by_object.items():
        poses = poses_of_rows(rows)
        shapes = [opened[row["preshape"]] for row in rows]
        count = len(hand.table.joint_names)
        found[name] = LabelledGrasps(
            poses,
            np.einsum("gij,gj->gi", poses[:, :3, :3], np.array([s.approach for s in shapes])),
            np.array([shape.open for shape in shapes]),
            np.array([[float(row[f"fcon_{k}"]) for k in range(count)] for row in rows]),
            {
                task: np.array([row[task] in ("1", "1.0") for row in rows])
                for task in ("hand-over", "pouring", "tool-use", "dish-washing")
                if task in rows[0]
            },
        )
    return found


class Judge:
    """Knows from labelled grasps which objects of a scene afford its task."""

    def __init__(
        self,
        hand: GraspingHand,
        experience: dict[str, LabelledGrasps],
        distance: Callable[[str], SignedDistance],
        config: PlannerConfig,
    ) -> None:
        """Take what is known.

        Args:
            hand: the robot's hand.
            experience: labelled grasps by object.
            distance: gives the signed distance of a model.
            config: the gaps that a reachable grasp leaves, the same for planner and judge.
        """
        self._hand, self._experience, self._distance = hand, experience, distance
        self._config = config

    def affording(self, scene: Scene) -> tuple[bool, ...]:
        """Return for each object whether a grasp with the task's label can be reached there.

        Labelled grasps alone decide, the same for every chooser; what an execution shows later
        changes nothing.
        """
        return tuple(self._affords(scene, index) for index in range(len(scene.models)))

    def share(self, name: str, task: str) -> float | None:
        """Return the share of an object's stable grasps that afford a task; None if unknown."""
        known = self._experience.get(name)
        return None if known is None else float(known.labels[task].mean())

    def _affords(self, scene: Scene, index: int) -> bool:
        model, pose = scene.models[index], scene.T_table_objects[index]
        known = self._experience.get(model.name)
        if known is None:
            return False
        opening = model.functions.opening if model.functions is not None else None
        pours = opening is None or float((pose[:3, :3] @ opening.normal)[2]) >= _UPRIGHT
        if scene.task == "pouring" and not pours:
            return False
        rows = np.flatnonzero(known.labels[scene.task])[:_CHECKED]
        if len(rows) == 0:
            return False
        obstacles = [
            Obstacle(p, self._distance(scene.models[k].name))
            for k, p in enumerate(scene.T_table_objects)
        ]
        target = obstacles.pop(index)
        gaps = clearances(
            self._hand,
            pose @ known.T_object_hand[rows],
            known.approach[rows] @ pose[:3, :3].T,
            known.pregrasp_joints[rows],
            known.grasp_joints[rows],
            target,
            tuple(obstacles),
        )
        return bool(np.any(self._config.leaves_room(gaps)))
