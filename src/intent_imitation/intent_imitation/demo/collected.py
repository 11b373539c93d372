"""What the nodes have said about one bag."""

from dataclasses import dataclass, field

from intent_imitation.planner.plan import GraspPlan
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.scene.scene_state import SceneState


@dataclass
class Collected:
    """Everything the nodes have said, in the order of arrival."""

    objects: list[RecognizedObjects] = field(default_factory=list)
    robot_objects: list[RecognizedObjects] = field(default_factory=list)
    states: list[SceneState] = field(default_factory=list)
    grasps: list[StableGrasp] = field(default_factory=list)
    posteriors: list[TaskPosterior] = field(default_factory=list)
    plans: list[GraspPlan] = field(default_factory=list)
    started: float | None = None
    """Wall time of the first frame [s]."""
    planned: float | None = None
    """Wall time of the first plan, else of the last message [s]."""
