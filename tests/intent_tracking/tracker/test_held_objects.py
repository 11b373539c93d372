import numpy as np
import pytest

from intent_perception.geometry.sdf import SignedDistance
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.views import mismatched_hand, pour_sequence, rendered_frames


@pytest.fixture(scope="module")
def moments():
    """Truths and frames of the views' mug: held, then lifted by 40 mm per frame, then let go."""
    rng = np.random.default_rng(4)
    mug, hand = ObjectDatabase.load()["mug_0"], mismatched_hand(rng)
    hull = SignedDistance.from_mesh(mug.mesh.convex_hull, 0.003, 0.03)
    truths = pour_sequence(0.0, hand, hull)
    truths = [*truths[48:54:2], *truths[54:79:4], *truths[100:124:2]]
    return mug, truths, list(rendered_frames(truths, hand, (mug.mesh, mug.color), rng))


def offsets(moments):
    """Return the distance of the tracked mug from the truth in every frame [m]."""
    mug, truths, frames = moments
    tracker = Tracker({"mug_0": mug}, TrackerConfig(table=False))
    item = RecognizedObject("mug_0", "mug_0", "mug", truths[0].T_camera_object, 1.0, 1.0)
    tracker.start(RecognizedObjects(0, (item,), np.eye(4)))
    tracker.place_hand("right", truths[0].T_camera_hand, truths[0].joints)
    found = []
    for truth, frame in zip(truths, frames, strict=True):
        pose = tracker.step(frame).T_table_objects[0]
        found.append(np.linalg.norm(pose[:3, 3] - truth.T_camera_object[:3, 3]))
    return np.array(found)


@pytest.mark.slow
def test_a_lifted_object_follows_the_hand_and_a_released_one_stays(moments):
    found = offsets(moments)
    assert found[:10].max() < 0.012  # at rest and through the lift
    assert found[-4:].max() < 0.012  # the hand is leaving
