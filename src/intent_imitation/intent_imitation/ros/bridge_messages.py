"""Results of the graph as messages of MoveIt, of vision_msgs, and for a gripper's controller.

Packages that an installation may lack are handed in as modules, so that nothing here needs them.
"""

from collections.abc import Iterator
from typing import Any

from builtin_interfaces.msg import Duration
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

_WAY, _LEAST_WAY = 0.16, 0.07
"""Length of the straight approach that the planner has checked, and the least that is asked [m]."""
_RETREAT = 0.1
"""Length of the way up after the grasp [m]."""


def posture(joints: Any, seconds: float = 0.0) -> Any:
    """Return a trajectory_msgs/JointTrajectory of one posture, reached after so long [s]."""
    point = JointTrajectoryPoint(positions=list(joints.position))
    point.time_from_start = _duration(seconds)
    return JointTrajectory(header=joints.header, joint_names=list(joints.name), points=[point])


def hand_trajectory(grasp: Any, seconds: float) -> Any:
    """Return the way of a hand's joints: the pre-grasp at once, the grasp after so long [s].

    Args:
        grasp: intent_msgs/RobotGrasp.
        seconds: time for closing.
    """
    way = posture(grasp.pregrasp, 1.0)
    closed = JointTrajectoryPoint(positions=list(grasp.grasp.position))
    closed.time_from_start = _duration(1.0 + seconds)
    way.points = [*way.points, closed]
    way.header = Header(frame_id=grasp.wrist_pose.header.frame_id)  # stamp 0: start at once
    return way


def moveit_grasps(plan: Any, moveit: Any) -> Iterator[Any]:
    """Yield a moveit_msgs/Grasp for each grasp of a plan, best first.

    Args:
        plan: intent_msgs/GraspPlan.
        moveit: the module moveit_msgs.msg.
    """
    for rank, grasp in enumerate(plan.grasps, start=1):
        message = moveit.Grasp()
        message.id = f"{grasp.object_id}_{rank}"
        message.pre_grasp_posture = posture(grasp.pregrasp)
        message.grasp_posture = posture(grasp.grasp)
        message.grasp_pose = grasp.wrist_pose
        message.grasp_quality = float(grasp.score)
        approach = moveit.GripperTranslation()
        approach.direction.header = grasp.wrist_pose.header
        approach.direction.vector = grasp.approach
        approach.desired_distance, approach.min_distance = _WAY, _LEAST_WAY
        message.pre_grasp_approach = approach
        retreat = moveit.GripperTranslation()
        retreat.direction.header = grasp.wrist_pose.header
        retreat.direction.vector.z = 1.0
        retreat.desired_distance, retreat.min_distance = _RETREAT, 0.0
        message.post_grasp_retreat = retreat
        message.allowed_touch_objects = [grasp.object_id]
        yield message


def detections(objects: Any, sizes: dict[str, Any], vision: Any) -> Any:
    """Return a vision_msgs/Detection3DArray of recognised objects.

    Args:
        objects: intent_msgs/RecognizedObjects.
        sizes: edges (3,) [m] of the bounding box of each model, in the object's frame.
        vision: the module vision_msgs.msg.
    """
    array = vision.Detection3DArray(header=objects.header)
    found = []
    for item in objects.objects:
        detection = vision.Detection3D(header=objects.header)
        detection.id = item.id
        hypothesis = vision.ObjectHypothesisWithPose()
        hypothesis.hypothesis.class_id = item.object_class or "unknown"
        hypothesis.hypothesis.score = float(item.confidence)
        hypothesis.pose.pose = item.pose
        detection.results = [hypothesis]
        detection.bbox.center = item.pose
        size = sizes.get(item.model or item.id)
        if size is not None:
            edges = detection.bbox.size
            edges.x, edges.y, edges.z = (float(edge) for edge in size)
        found.append(detection)
    array.detections = found
    return array


def _duration(seconds: float) -> Any:
    whole = int(seconds)
    return Duration(sec=whole, nanosec=round((seconds - whole) * 1e9))
