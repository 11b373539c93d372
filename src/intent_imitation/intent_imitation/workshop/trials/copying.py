"""The alternative to goal-directed imitation: the robot copies the human's grasp (Fig. 1).

The robot's hand takes the place, the orientation and the closing of the human's hand relative to
the object, whatever the task; then its fingers close until they touch.
"""

import numpy as np

from intent_imitation.planner.plan import GraspCandidate
from intent_inference.grasping.autograsp import close_hand
from intent_inference.grasping.grasp_hypotheses import GraspHypothesis
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import make_pose

_HUMAN_CENTER = np.array([0.085, 0.0, 0.035])
"""Where a human hand holds things, in `hand_wrist` [m]."""


def copied_grasp(
    target: TaskObject,
    hand: GraspingHand,
    T_object_human: Array,
    T_table_object: Array,
    object_id: str,
    preshape: str = "power",
    back: float = 0.16,
) -> GraspCandidate | None:
    """Return the robot's imitation of a human posture; None where its hand closes on nothing.

    Args:
        target: the robot's object.
        hand: the robot's hand.
        T_object_human: (4, 4) `hand_wrist` of the human in the frame of the human's object.
        T_table_object: (4, 4) the robot's object.
        object_id: its name.
        preshape: how the robot's hand opens.
        back: length of the approach [m].
    """
    shape = next(p for p in hand.preshapes if p.name == preshape)
    # palm normal -> approach, fingers' direction -> closing direction
    human = T_object_human[:3, :3]
    wanted = np.stack([human[:, 2], human[:, 0], np.cross(human[:, 2], human[:, 0])], axis=1)
    own = np.stack([shape.approach, shape.closing, np.cross(shape.approach, shape.closing)])
    rotation = wanted @ own
    held = T_object_human[:3, 3] + human @ _HUMAN_CENTER
    approach = rotation @ shape.approach
    final = make_pose(rotation, held - rotation @ shape.center)
    start = make_pose(rotation, final[:3, 3] - back * approach)
    hypothesis = GraspHypothesis(shape.name, start, approach, back, shape.open, shape.rates)
    grasp = close_hand(hand, target.field, hypothesis)[1]
    if grasp is None:
        return None
    return GraspCandidate(
        object_id,
        T_table_object @ grasp.T_object_hand,
        T_table_object[:3, :3] @ approach,
        shape.open,
        grasp.joints,
        float("nan"),
        {},
        shaken=False,
    )
