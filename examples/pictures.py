"""A notebook of cells (VS Code, Jupytext): a bag looked at step by step, with pictures."""

# %% A bag and what is on the table
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from intent_inference.intention.estimator import IntentionEstimator
from intent_perception.bags.bag_files import read_frames
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import Recognizer
from intent_tracking.grasp.grasp_detector import GraspDetector
from intent_tracking.tracker.tracker import Tracker

bag, out = Path(sys.argv[1] if len(sys.argv) > 1 else "bags/pour_bottle"), Path("out/examples")
out = Path(sys.argv[2]) if len(sys.argv) > 2 else out
out.mkdir(parents=True, exist_ok=True)
known = ObjectDatabase.load()
frames = list(read_frames(bag))
recognizer = Recognizer(known)
objects = next(found for frame in frames if (found := recognizer.step(frame)) and found.complete)

# %% Every frame: 26 values of the hand, 6 of each object
tracker = Tracker(known)
tracker.start(objects)
states = [tracker.step(frame) for frame in frames]

# %% The camera's picture with the tracked joints
state = next(s for s in states[::-1] if s.hand_tracked)
frame = next(f for f in frames if f.stamp == state.stamp)
canvas = Figure(figsize=(8, 6), layout="constrained")
axes = canvas.subplots()
axes.imshow(frame.color)
axes.plot(*frame.camera.project(state.joints_camera).T, "o", color="white", markeredgecolor="black")
axes.set_axis_off()
axes.set_title(f"21 joints, {(state.stamp - frames[0].stamp) * 1e-9:.2f} s")
canvas.savefig(out / "joints.png")

# %% How far the wrist is from each object
seconds = np.array([(s.stamp - frames[0].stamp) * 1e-9 for s in states])
canvas = Figure(figsize=(8, 4), layout="constrained")
axes = canvas.subplots()
for index, name in enumerate(objects.objects):
    away = [np.linalg.norm(s.T_table_objects[index, :3, 3] - s.state[:3]) for s in states]
    axes.plot(seconds, away, label=name.id)
axes.set_xlabel("time [s]")
axes.set_ylabel("wrist to object [m]")
axes.legend()
canvas.savefig(out / "distances.png")

# %% The posterior while the hand reaches, and when it has grasped
detector, estimator = GraspDetector(known), IntentionEstimator()
told = []
for state in states:
    grasp = detector.step(state)
    told += [p for p in map(estimator.step, filter(None, (state, grasp))) if p is not None]
canvas = Figure(figsize=(8, 4), layout="constrained")
axes = canvas.subplots()
for index, task in enumerate(told[-1].tasks if told else ()):
    times = [(p.stamp - frames[0].stamp) * 1e-9 for p in told]
    axes.plot(times, [p.probability[index] for p in told], ".-", label=task)
axes.set_xlabel("time [s]")
axes.set_ylabel("p(task)")
axes.legend()
canvas.savefig(out / "posterior.png")
print("pictures in", out)
