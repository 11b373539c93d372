"""Grasp plans to and from messages."""

from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from intent_msgs import msg as msgs
from sensor_msgs.msg import JointState

from intent_imitation.planner.plan import GraspCandidate, GraspPlan, ObjectChoice
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.basics.arrays import Array
from intent_perception.ros.convert import (
    TABLE_FRAME,
    header_at,
    pose_from_msg,
    pose_to_msg,
    vector_from_msg,
    vector_to_msg,
)


def plan_to_msg(plan: GraspPlan, frame: str = TABLE_FRAME) -> Any:
    """Return the message of a plan in the frame of the robot's objects."""
    header = header_at(plan.stamp, frame)
    return msgs.GraspPlan(
        header=header,
        task=plan.task,
        nothing_affords=bool(plan.nothing_affords),
        hand=plan.hand,
        objects=[
            msgs.ObjectChoice(
                id=choice.id,
                object_class=choice.object_class or "",
                probability=float(choice.probability),
                affords=bool(choice.affords),
            )
            for choice in plan.objects
        ],
        grasps=[_grasp_to_msg(grasp, header, plan.joint_names) for grasp in plan.grasps],
        cancelled=bool(plan.cancelled),
    )


def _grasp_to_msg(grasp: GraspCandidate, header: Any, names: tuple[str, ...]) -> Any:
    def posture(joints: Array) -> Any:
        return JointState(header=header, name=list(names), position=np.ravel(joints).tolist())

    return msgs.RobotGrasp(
        object_id=grasp.object_id,
        wrist_pose=PoseStamped(header=header, pose=pose_to_msg(grasp.T_table_hand)),
        approach=vector_to_msg(grasp.approach),
        pregrasp=posture(grasp.pregrasp_joints),
        grasp=posture(grasp.grasp_joints),
        score=float(grasp.score),
        score_parts=[
            msgs.ScorePart(name=name, value=float(value))
            for name, value in grasp.score_parts.items()
        ],
        shaken=bool(grasp.shaken),
    )


def plan_from_msg(message: Any) -> GraspPlan:
    """Return the plan of a message."""
    names = tuple(message.grasps[0].grasp.name) if message.grasps else ()
    return GraspPlan(
        stamp=stamp_of(message),
        task=message.task,
        nothing_affords=message.nothing_affords,
        objects=tuple(
            ObjectChoice(o.id, o.object_class, o.probability, o.affords) for o in message.objects
        ),
        grasps=tuple(
            GraspCandidate(
                object_id=g.object_id,
                T_table_hand=pose_from_msg(g.wrist_pose.pose),
                approach=vector_from_msg(g.approach),
                pregrasp_joints=np.array(g.pregrasp.position),
                grasp_joints=np.array(g.grasp.position),
                score=g.score,
                score_parts={part.name: part.value for part in g.score_parts},
                shaken=g.shaken,
            )
            for g in message.grasps
        ),
        hand=message.hand,
        joint_names=names,
        cancelled=message.cancelled,
    )
