"""Writes the grasps of a running graph into a table for `train add`, each labelled by a key.

The same with more comfort: `ros2 run intent_inference record`, see docs/teach.md.
"""

import sys
from pathlib import Path

import rclpy
from intent_msgs.msg import StableGrasp
from rclpy.node import Node

from intent_inference.intention.demonstration_log import DemonstrationLog
from intent_tracking.ros.convert import grasp_from_msg


class Recorder(Node):
    def __init__(self, log: DemonstrationLog, task: str) -> None:
        super().__init__("recorder")
        self.log, self.task = log, task
        self.create_subscription(StableGrasp, "intent/stable_grasp", self.grasp, 10)

    def grasp(self, message: StableGrasp) -> None:
        self.log.add(grasp_from_msg(message), {self.task: 1})
        print(f"{message.object_id} was grasped for {self.task}: row {len(self.log)}", flush=True)


rclpy.init()
rclpy.spin(Recorder(DemonstrationLog(Path(sys.argv[1])), sys.argv[2]))  # FILE TASK
