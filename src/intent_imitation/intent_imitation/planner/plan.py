"""What the robot intends to do: objects and grasps that fit the task (Sec. IV-D).

A `GraspCandidate` maps one to one to moveit_msgs/Grasp:

- id: object_id and the rank in the plan
- pre_grasp_posture: joint_names, pregrasp_joints
- grasp_posture: joint_names, grasp_joints
- grasp_pose: T_table_hand, in the frame of the robot's objects
- grasp_quality: score
- pre_grasp_approach: direction approach; desired 0.16 m, as checked for collisions
- post_grasp_retreat: direction +z of the table
- max_contact_force: 0 (not limited here; the fingers' torques are)
- allowed_touch_objects: object_id
"""

from dataclasses import dataclass, field

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import require_pose


@dataclass(frozen=True)
class ObjectChoice:
    """How well one object on the robot's table serves the task."""

    id: str
    """Name of the recognised object."""
    object_class: str
    """Class, empty where the recogniser knows none."""
    probability: float
    """p(o | t*, BN^R) over the objects on the table; sums to one over those that were judged. NaN:
    not judged, because it is of no known class while others serve, or nothing is known of it."""
    affords: bool
    """Whether p(t* | o) and at least one reachable grasp say that the object can do it."""

    @property
    def judged(self) -> bool:
        """Whether BN^R was asked about the object."""
        return not np.isnan(self.probability)


@dataclass(frozen=True, eq=False)
class GraspCandidate:
    """A grasp of the robot's hand, re-checked at the object's recognised pose."""

    object_id: str
    T_table_hand: Array
    """(4, 4) base of the robot hand (Schunk: z = approach) when the fingers have closed."""
    approach: Array
    """(3,) unit direction of the last stretch of the way, in the table frame."""
    pregrasp_joints: Array
    """(J,) posture of the open hand while it approaches [rad]."""
    grasp_joints: Array
    """(J,) posture of the closed hand [rad]."""
    score: float
    """The value that ranks the candidates; higher is better."""
    score_parts: dict[str, float] = field(default_factory=dict)
    """`task`: p(t* | o*, a); `stability` in [0, 1]; `clearance` to table and neighbours [m]."""
    shaken: bool = True
    """Whether the grasp has passed the shake test in simulation; False: static filter only."""


@dataclass(frozen=True, eq=False)
class GraspPlan:
    """The robot's answer to one demonstrated intention."""

    stamp: int
    """Stamp of the posterior that it answers [ns]."""
    task: str
    """t*, the task to be imitated."""
    nothing_affords: bool
    """True where objects were recognised and none serves the task; `grasps` is then empty."""
    objects: tuple[ObjectChoice, ...]
    """Those that afford the task first, then by p(o | t*)."""
    grasps: tuple[GraspCandidate, ...]
    """Best first, all of the chosen object."""
    hand: str
    """Name of the robot hand."""
    joint_names: tuple[str, ...]
    """(J,) order of the joint postures."""
    cancelled: bool = False
    """The intention that the plan for `task` answered no longer holds: stop."""

    @property
    def nothing_recognised(self) -> bool:
        """Whether no object was recognised on the table, so that nothing can be said of it."""
        return not self.objects

    @property
    def refusal(self) -> str:
        """Why there is no grasp, in words; "" where there is one."""
        if self.grasps:
            return ""
        if self.cancelled:
            return "the intention has changed"
        if self.nothing_recognised:
            return "nothing was recognised on its table"
        return f"nothing on its table affords {self.task}"

    def __post_init__(self) -> None:
        """Refuse a plan that no hand can carry out."""
        for grasp in self.grasps:
            require_pose(grasp.T_table_hand, f"T_table_hand of a grasp of {grasp.object_id!r}")
            for joints in (grasp.pregrasp_joints, grasp.grasp_joints):
                if joints.shape != (len(self.joint_names),) or not np.all(np.isfinite(joints)):
                    raise ValueError(
                        f"expected angles of {', '.join(self.joint_names)}, got {joints.tolist()}"
                    )
