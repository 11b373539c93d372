"""Bags through recogniser, tracker, grasp detector and inference in one process.

Wired as the nodes are in lockstep, so its answers are those that a graph with time enough gives.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.bags.bag_files import read_frames
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObjects, Recognizer
from intent_tracking.grasp.grasp_detector import GraspDetector, StableGrasp
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker


@dataclass
class BagRun:
    """What came out of one bag."""

    recognized: list[tuple[int, RecognizedObjects]] = field(default_factory=list)
    """Each answer with its frame."""
    states: list[SceneState] = field(default_factory=list)
    """One per frame."""
    grasps: list[tuple[int, StableGrasp]] = field(default_factory=list)
    """Each stable grasp with its frame."""
    posteriors: list[TaskPosterior] = field(default_factory=list)
    """The final one of each grasp."""
    said: list[TaskPosterior] = field(default_factory=list)
    """All of them, while the hand reaches and moves too."""


def models_file(bag: Path) -> Path | None:
    """Return the object database that lies in a bag's folder, if it brings its own."""
    own = bag / "models.yaml"
    return own if own.exists() else None


def run_frames(frames: Iterable[RgbdFrame], database: ObjectDatabase, models: str = "") -> BagRun:
    """Return what the four steps say about frames.

    Args:
        frames: the recording.
        database: objects that recogniser, tracker and grasp detector know.
        models: its file, for the inference; empty: the shipped one.
    """
    run = BagRun()
    recognizer, detector = Recognizer(database), GraspDetector(database)
    tracker = Tracker(database)
    estimator = IntentionEstimator(InferenceConfig(models=models))
    waiting: RecognizedObjects | None = None
    for index, frame in enumerate(frames):
        objects = recognizer.step(frame)
        if objects is not None:
            run.recognized.append((index, objects))
            for item in objects.objects:
                if item.shape is not None:
                    estimator.database.learn(item.shape)
        if index == 0 and objects is not None:  # the first frame always gives an answer
            tracker.start(objects)
        elif waiting is not None:
            tracker.join(waiting)
        waiting = objects if index else None
        state = tracker.step(frame)
        run.states.append(state)
        grasp = detector.step(state)
        if grasp is not None:
            run.grasps.append((index, grasp))
            posterior = estimator.step(grasp)
            assert posterior is not None
            run.posteriors.append(posterior)
        else:
            posterior = estimator.step(state)
        if posterior is not None:
            run.said.append(posterior)
    return run


def run_bag(bag: Path) -> BagRun:
    """Return the run of a bag with the objects that belong to it."""
    own = models_file(bag)
    return run_frames(read_frames(bag), ObjectDatabase.load(own), str(own or ""))
