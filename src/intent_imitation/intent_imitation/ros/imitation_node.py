"""ROS node: the task and the robot's own table in, object and ranked grasps for the robot out."""

from concurrent.futures import wait
from typing import Any

from intent_msgs import msg as msgs

from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.planner.planner_config import PlannerConfig
from intent_imitation.ros.convert import plan_to_msg
from intent_inference.intention.task_posterior import TaskPosterior
from intent_inference.ros.convert import posterior_from_msg
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_perception.ros.convert import TABLE_FRAME
from intent_perception.ros.declared import declared, declared_database
from intent_perception.ros.latest_result import LatestResult
from intent_perception.ros.node import IntentNode, aside, run
from intent_perception.ros.shaped_objects import listen_for_objects

_PREPARED = 4.0
"""For so long the node waits for what it prepares before it says that it is ready [s]."""


class ImitationNode(IntentNode):
    """Plans once a task is concluded and the robot's table is known, whichever comes first.

    A task that was concluded before this node was started is not planned for again; the table, as
    it was recognised last, holds all the same.
    """

    def __init__(self) -> None:
        super().__init__("imitation")
        database = declared_database(self)
        self._planner = GraspPlanner(database, declared(self, PlannerConfig()))
        self._planner.rehearse()
        self._workshop = aside()
        # Objects without a library take a second each: few are ready when the node is.
        wait({self._workshop.submit(self._planner.prepare)}, timeout=_PREPARED)
        self._publisher = LatestResult(self, msgs.GraspPlan, "intent/grasp_plan")
        self.reset()
        listen_for_objects(self, "~/robot_objects", "~/robot_shapes", database, self._on_objects)
        self.listen_for_news(msgs.TaskPosterior, "intent/task_posterior", self._on_posterior)

    def rehearse_rare(self) -> None:
        """Compile what objects without a library need."""
        self._planner.rehearse_unpractised()

    def reset(self) -> None:
        """Forget the task that waits for a table, and the answer to the one before."""
        self._publisher.take_back()
        self._planner.forget()
        self._waiting: TaskPosterior | None = None
        self._frame = TABLE_FRAME

    def _on_objects(self, objects: RecognizedObjects, header: Any) -> None:
        self._planner.start(objects)
        self._frame = header.frame_id
        if self._waiting is not None:
            self._plan(self._waiting)

    def _on_posterior(self, message: Any) -> None:
        self._plan(posterior_from_msg(message))

    def _plan(self, posterior: TaskPosterior) -> None:
        if posterior.preliminary:  # another reach: the last plan answers nothing any more
            self._publisher.take_back()
            self._waiting = None
        plan = self._planner.step(posterior)
        if plan is not None:
            self._publisher.publish(plan_to_msg(plan, self._frame))
            if plan.refusal:
                self.get_logger().warning(f"no grasp for {plan.task}: {plan.refusal}")
            self._waiting = None
        elif not posterior.preliminary and self._waiting is None:
            self._waiting = posterior  # the grasp's own, not that of a later moment


def main() -> None:
    """Run the node until Ctrl-C."""
    run(ImitationNode)
