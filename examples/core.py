"""The whole process without ROS: bag, objects, states, posterior, plan."""

import sys

from intent_imitation.planner.planner import GraspPlanner
from intent_inference.intention.estimator import IntentionEstimator
from intent_perception.bags.bag_files import read_frames
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import Recognizer
from intent_tracking.grasp.grasp_detector import GraspDetector
from intent_tracking.tracker.tracker import Tracker

known = ObjectDatabase.load()  # or .load("my_objects.yaml")
recognizer, tracker = Recognizer(known), Tracker(known)
detector, estimator, planner = GraspDetector(known), IntentionEstimator(), GraspPlanner(known)
frames = list(read_frames(sys.argv[1] if len(sys.argv) > 1 else "bags/pour_bottle"))
objects = next(found for frame in frames if (found := recognizer.step(frame)) and found.complete)
print("on the table:", ", ".join(item.id for item in objects.objects))
tracker.start(objects)
planner.start(objects)  # here the robot stands at the same table
for frame in frames:
    grasp = detector.step(tracker.step(frame))
    posterior = estimator.step(grasp) if grasp is not None else None
    plan = planner.step(posterior) if posterior is not None else None
    if plan is not None:
        print(f"{plan.task}: the robot takes {plan.grasps[0].object_id if plan.grasps else None}")
