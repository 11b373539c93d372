"""Program: prints the checksum of a short track; `test_same_bits` gives it caches of its own."""

import hashlib
import sys
from itertools import islice
from pathlib import Path

from intent_perception.bags.bag_files import read_frames
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

BAG = Path(__file__).resolve().parents[2] / "bags" / "pour_bottle"
FRAMES = 30
"""Of which half show the hand."""


def states(frames: list, models: ObjectDatabase, objects: RecognizedObjects) -> str:
    """Return the checksum of the states of the frames."""
    tracker = Tracker({model.name: model for model in models}, TrackerConfig(seed=0))
    tracker.start(objects)
    digest = hashlib.sha256()
    for frame in frames:
        state = tracker.step(frame)
        digest.update(state.state.tobytes() + state.state_std.tobytes())
    return digest.hexdigest()


def main() -> None:
    import numpy as np

    frames = list(islice(read_frames(BAG), FRAMES))
    with np.load(BAG / "truth.npz") as truth:
        names, poses = [str(name) for name in truth["object_ids"]], truth["objects_camera"][0]
        T_table_camera = truth["T_table_camera"]
    models = ObjectDatabase.load().joined(ObjectDatabase.clutter()).select(names)
    items = tuple(
        RecognizedObject(m.name, m.name, m.object_class, T_table_camera @ pose, 1.0, 1.0)
        for m, pose in zip(models, poses.astype(np.float64), strict=True)
    )
    objects = RecognizedObjects(frames[0].stamp, items, T_table_camera)
    if "other-order" in sys.argv:  # the hand's kernels first, and helpers called from Python
        SignedDistance.from_mesh(models.models[0].mesh)
        states([frames[0], *frames[-4:]], models, objects)
    sys.stdout.write(states(frames, models, objects) + "\n")


if __name__ == "__main__":
    main()
