"""Whole bags followed without ROS, and what is said where something is missing in them."""

import numpy as np
import pytest
from tests.support.hand_films import ROOT as REPOSITORY
from tests.support.hand_films import frames_of, needs_networks, truth_of

from intent_perception.bags.bag_files import BagWriter
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.tracker.recording import follow, track_bag
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

pytestmark = [pytest.mark.slow, needs_networks]

REACH = slice(36, 56)
"""Frames of pour_bottle around its grasp."""


def written(path, frames):
    with BagWriter(path, color="raw") as writer:
        for frame in frames:
            writer.write(frame)
    return path


@pytest.fixture(scope="module")
def reach(tmp_path_factory):
    """A bag in which a hand grasps a bottle."""
    frames = frames_of("pour_bottle", REACH.stop)[REACH]
    return written(tmp_path_factory.mktemp("bags") / "reach", frames)


@pytest.fixture(scope="module")
def database():
    return ObjectDatabase.load(None).select(("bottle_0", "glass_0", "hammer_0"))


def test_the_hand_of_a_bag_is_followed_without_any_object(reach, database):
    warnings = []
    recording = track_bag(reach, database, TrackerConfig(), None, warnings.append)
    truth = truth_of(REPOSITORY / "bags" / "pour_bottle")["joints_camera"][REACH]
    error = np.linalg.norm(recording.joints_camera - truth, axis=2).mean(axis=1)
    assert recording.arrays["object_ids"].size == 0
    assert np.isfinite(error[5:]).all()
    assert np.median(error[5:]) < 0.015
    assert warnings == []


def test_where_no_known_object_is_in_view_it_is_said_once(reach, database):
    warnings = []
    recording = track_bag(reach, database, TrackerConfig(), ("hammer_0",), warnings.append)
    assert len(recording.states) == REACH.stop - REACH.start
    assert len(warnings) == 1
    assert "no object" in warnings[0]


def test_where_no_table_is_in_view_it_is_said_once(tmp_path, database):
    color = np.full((480, 640, 3), 90, np.uint8)
    wall = np.full((480, 640), 1.2, np.float32)
    frames = [RgbdFrame(n * 33_000_000, color, wall, KINECT) for n in range(1, 3)]
    warnings = []
    track_bag(written(tmp_path / "wall", frames), database, TrackerConfig(), (), warnings.append)
    assert len(warnings) == 1
    assert "no table" in warnings[0]


def test_without_network_files_the_remedy_is_said_once(database, tmp_path, monkeypatch):
    monkeypatch.setenv("INTENT_HAND_NETWORKS", str(tmp_path))
    one = written(tmp_path / "one", frames_of("pour_bottle", 1))
    warnings = []
    track_bag(one, database, TrackerConfig(), None, warnings.append)
    assert len(warnings) == 1
    assert "fetch_hand_networks" in warnings[0]


def test_a_recording_of_no_frame_is_an_error():
    with pytest.raises(ValueError, match="at least one frame"):
        follow(Tracker({}, TrackerConfig(networks=False)), [])
