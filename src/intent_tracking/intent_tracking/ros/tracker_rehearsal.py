"""The tracker's steps gone through once, before the node says that it is ready."""

import numpy as np

from intent_perception.geometry.transforms import inverse, make_pose
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_perception.recognition.rehearsal_scene import (
    HAND_PLACE,
    T_TABLE_CAMERA,
    rehearsal_frames,
    rehearsal_object,
)
from intent_tracking.tracker.tracker import Tracker

_FRAMES = 8
_LYING = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Of the hand: fingers away from the camera, palm down; columns are its axes in `table`."""


def rehearse(tracker: Tracker, model: ObjectModel) -> None:
    """Let a tracker start, search, follow a hand beside an object and lose it; then start over."""
    tracker.start(RecognizedObjects(0, (rehearsal_object(model),), T_TABLE_CAMERA))
    hand = make_pose(_LYING, HAND_PLACE - [0.0, 0.08, 0.0])
    frames = rehearsal_frames(model, _FRAMES)
    for number, frame in enumerate(frames):
        if number == 1:
            tracker.place_hand("right", inverse(T_TABLE_CAMERA) @ hand, np.full(20, 0.2))
        tracker.step(frame)
    tracker.place_hand("right", inverse(T_TABLE_CAMERA) @ hand, np.full(20, 0.2))
    tracker.rehearse(frames[-1])
    tracker.forget_hand()
