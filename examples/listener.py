"""Says what the person is about to do and what the robot would take, from a running graph."""

import rclpy
from intent_msgs.msg import GraspPlan, TaskPosterior
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Listener(Node):
    def __init__(self) -> None:
        super().__init__("listener")
        self.create_subscription(TaskPosterior, "intent/task_posterior", self.posterior, latched)
        self.create_subscription(GraspPlan, "intent/grasp_plan", self.plan, latched)

    def posterior(self, message: TaskPosterior) -> None:
        if message.stage == "GRASP" and not message.preliminary:  # the hand has closed
            chances = zip(message.tasks, message.probability, strict=True)
            print(message.object_id, {task: round(p, 2) for task, p in chances}, flush=True)

    def plan(self, message: GraspPlan) -> None:
        chosen = message.grasps[0].object_id if message.grasps else "nothing"
        print(f"for {message.task} the robot takes {chosen}", flush=True)


rclpy.init()
rclpy.spin(Listener())
