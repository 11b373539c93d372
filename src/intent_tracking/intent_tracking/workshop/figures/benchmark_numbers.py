"""CPU time by the number of objects: the hand of view v0 with N = 0 to 4 objects."""

import time
from dataclasses import replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_views import OBJECT, jittered
from intent_tracking.workshop.figures.views import (
    Thing,
    mismatched_hand,
    pour_sequence,
    rendered_frames,
)

_UPRIGHT = rotation_from_vector([np.radians(115.0), 0.0, 0.0])
RESTING = {
    "bottle_0": make_pose(_UPRIGHT, [-0.22, 0.08, 0.90]),
    "glass_1": make_pose(_UPRIGHT, [0.20, 0.08, 0.90]),
    "knife_0": make_pose(_UPRIGHT, [0.22, -0.10, 0.95]),
}
"""Objects beside the hand's way and their poses in the camera's frame."""
SKIPPED = 3
"""First frames, which still compile or read something."""


def milliseconds_by_objects(seed: int, frames: int) -> dict[str, float]:
    """Return the mean CPU time per frame [ms] with 0, 1, ..., 4 objects.

    The first is taken, lifted and tilted; the others are at rest. All are drawn and followed.
    """
    numbers = range(2 + len(RESTING))
    return {str(n): 1e3 * float(_seconds(n, seed, frames)[SKIPPED:].mean()) for n in numbers}


def _seconds(number: int, seed: int, frames: int) -> Array:
    """Return the CPU time (F,) of each step with a number of objects [s]."""
    rng = np.random.default_rng(seed)
    database = ObjectDatabase.load()
    hand, mug = mismatched_hand(rng), database[OBJECT]
    hull = SignedDistance.from_mesh(mug.mesh.convex_hull, 0.003, 0.03)
    truths = pour_sequence(0.0, hand, hull)[:frames]
    names = list(RESTING)[: max(number - 1, 0)]
    resting = [Thing(database[n].mesh, database[n].color, RESTING[n]) for n in names]
    held = (mug.mesh, mug.color) if number else None
    poses = {OBJECT: truths[0].T_camera_object} if number else {}
    poses |= {name: RESTING[name] for name in names}
    models = {name: database[name] for name in poses}
    tracker = Tracker(models, replace(TrackerConfig(seed=seed), table=False))
    items = tuple(
        RecognizedObject(
            name, name, models[name].object_class, jittered(pose, 0.003, 0.03, rng), 1.0, 1.0
        )
        for name, pose in poses.items()
    )
    tracker.start(RecognizedObjects(0, items, np.eye(4)))
    tracker.place_hand("right", truths[0].T_camera_hand, truths[0].joints)
    seconds = []
    for frame in rendered_frames(truths, hand, held, rng, resting):
        began = time.process_time()
        tracker.step(frame)
        seconds.append(time.process_time() - began)
    return np.array(seconds)
