"""Which preplanned grasps of an object the robot's hand can reach where it stands."""

import numpy as np
from numpy.typing import NDArray

from intent_imitation.planner.collision import Obstacle, clearances
from intent_imitation.planner.library_hypotheses import Hypotheses, HypothesisSource
from intent_imitation.planner.plan import GraspCandidate
from intent_imitation.planner.planner_config import PlannerConfig
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.arrays import Array
from intent_perception.recognition.recognizer import RecognizedObjects


class Reachable:
    """Looks among the hypotheses of an object for those that collide with nothing."""

    def __init__(self, hand: GraspingHand, source: HypothesisSource, config: PlannerConfig) -> None:
        self._hand, self._source, self._config = hand, source, config

    def best(
        self, table: RecognizedObjects, index: int, hypotheses: Hypotheses, task_chance: Array
    ) -> tuple[GraspCandidate, ...]:
        """Return the best collision-free grasps of an object at its recognised pose.

        Grasps that do not fit the task are not looked at: nobody would execute them.

        Args:
            table: all objects.
            index: of the object among them.
            hypotheses: its G grasps.
            task_chance: (G,) p(t* | o, a).
        """
        config, grasps = self._config, hypotheses.grasps
        score = task_chance * grasps.stability**config.stability_weight
        found: list[GraspCandidate] = []
        order = np.argsort(-score, kind="stable")
        order = order[task_chance[order] >= config.minimum_grasp]
        for first in range(0, len(order), config.batch):
            rows = order[first : first + config.batch]
            found += self._checked(table, index, hypotheses, rows, task_chance, score)
            if len(found) >= config.grasps:
                break
        return tuple(found[: config.grasps])

    def _checked(
        self,
        table: RecognizedObjects,
        index: int,
        hypotheses: Hypotheses,
        rows: NDArray[np.int64],
        task_chance: Array,
        score: Array,
    ) -> list[GraspCandidate]:
        """Return those of some rows of the hypotheses that collide with nothing."""
        items, grasps = table.objects, hypotheses.grasps
        pose = items[index].T_table_object
        T_table_hands = pose @ grasps.T_object_hand[rows]
        approaches = grasps.approach[rows] @ pose[:3, :3].T
        target = Obstacle(pose, self._source.distance(items[index].model))
        neighbours = tuple(
            Obstacle(other.T_table_object, self._source.distance(other.model))
            for k, other in enumerate(items)
            if k != index and self._source.knows(other.model)
        )
        gaps = clearances(
            self._hand,
            T_table_hands,
            approaches,
            grasps.pregrasp_joints[rows],
            grasps.grasp_joints[rows],
            target,
            neighbours,
        )
        free = self._config.leaves_room(gaps)
        return [
            GraspCandidate(
                items[index].id,
                T_table_hands[k],
                approaches[k],
                grasps.pregrasp_joints[row],
                grasps.grasp_joints[row],
                float(score[row]),
                {
                    "task": float(task_chance[row]),
                    "stability": float(grasps.stability[row]),
                    "clearance": float(gaps.surroundings[k]),
                },
                bool(grasps.shaken[row]),
            )
            for k, row in enumerate(rows)
            if free[k]
        ]
