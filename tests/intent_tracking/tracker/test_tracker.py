from dataclasses import replace

import numpy as np
import pytest

from intent_perception.basics.parameters import parameters_of, with_values
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.tracker.recording import follow
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_sr305 import data_folder, real_fit
from intent_tracking.workshop.figures.benchmark_views import jittered, started, view_sequence

NOTHING = RecognizedObjects(0, (), np.eye(4))


def no_table(seed=0):
    tracker = Tracker({}, TrackerConfig(table=False, seed=seed))
    tracker.start(NOTHING)
    return tracker


def frame_of(depth, color, camera=KINECT, stamp=0):
    return RgbdFrame(stamp, color.astype(np.uint8), depth.astype(np.float32), camera)


@pytest.fixture(scope="module")
def sequence():
    return view_sequence("v0", 3, 16)


def test_step_before_start_is_an_error():
    tracker = Tracker({})
    wall = frame_of(np.full((480, 640), 1.2), np.full((480, 640, 3), 90))
    with pytest.raises(ValueError, match="start"):
        tracker.step(wall)


def test_an_unknown_object_is_an_error():
    item = RecognizedObject("teapot", "teapot", "teapot", np.eye(4), 1.0, 1.0)
    with pytest.raises(ValueError, match="teapot"):
        Tracker({}).start(RecognizedObjects(0, (item,), np.eye(4)))


def test_an_unknown_method_is_an_error():
    with pytest.raises(ValueError, match="magic"):
        TrackerConfig(method="magic")


def test_without_a_hand_the_26_values_are_nan_and_the_flag_says_so():
    state = no_table().step(frame_of(np.full((480, 640), 1.2), np.full((480, 640, 3), 90)))
    assert np.isnan(state.state).all()
    assert state.state.shape == (26,)
    assert not state.hand_visible
    assert not state.hand_tracked


def test_a_frame_without_depth_says_no_hand():
    state = no_table().step(frame_of(np.zeros((480, 640)), np.full((480, 640, 3), 90)))
    assert not state.hand_visible


@pytest.mark.slow
def test_hand_and_object_are_followed_within_millimetres(sequence):
    tracker = started(sequence, TrackerConfig(), np.random.default_rng(0))
    recording = follow(tracker, sequence.frames)
    error = [
        np.linalg.norm(state.joints_camera - sequence.joints(number), axis=1).mean()
        for number, state in enumerate(recording.states)
    ]
    assert np.mean(error[5:]) < 0.006
    offset = recording.objects_camera[-1, 0, :3, 3] - sequence.truths[-1].T_camera_object[:3, 3]
    assert np.linalg.norm(offset) < 0.010


@pytest.mark.slow
def test_a_hand_is_followed_in_a_hurry_too(sequence):
    tracker = started(sequence, TrackerConfig(), np.random.default_rng(0))
    for number, frame in enumerate(sequence.frames):
        state = tracker.step(frame, hurried=number % 4 < 3)
        error = np.linalg.norm(state.joints_camera - sequence.joints(number), axis=1).mean()
        assert error < 0.010


def test_what_looks_like_a_hand_is_not_searched_in_a_hurry_by_depth_alone(monkeypatch):
    tracker = no_table()
    searched = []
    monkeypatch.setattr(tracker._source, "found", lambda _: searched.append(1) or ([], False))
    monkeypatch.setattr(tracker._watch, "trouble", "")
    wall = frame_of(np.full((480, 640), 1.2), np.full((480, 640, 3), 90))
    tracker.step(wall, hurried=True)
    assert not searched
    tracker.step(wall)
    tracker.step(wall)
    assert searched


def test_what_is_not_yet_recognised_is_not_taken_for_a_hand(monkeypatch):
    tracker = no_table()
    searched = []
    monkeypatch.setattr(tracker._watch, "trouble", "")
    wall = frame_of(np.full((480, 640), 1.2), np.full((480, 640, 3), 90))
    for complete in (False, True):
        tracker.start(replace(NOTHING, complete=complete))
        monkeypatch.setattr(tracker._source, "found", lambda _: searched.append(1) or ([], False))
        tracker.step(wall)
        assert bool(searched) == complete


@pytest.mark.slow
def test_in_a_hurry_no_other_start_is_tried_that_no_network_sees(sequence, monkeypatch):
    tracker = started(sequence, TrackerConfig(), np.random.default_rng(0))
    monkeypatch.setattr(tracker._source.judge, "doubtful", lambda *_: True)
    tried = []
    monkeypatch.setattr(tracker, "_try_others", lambda _: tried.append(1))
    monkeypatch.setattr(tracker._watch, "look", lambda *_: None)
    tracker.step(sequence.frames[0], hurried=True)
    assert not tried
    tracker.step(sequence.frames[1])
    assert tried


@pytest.mark.slow
def test_the_same_frames_and_seed_give_the_same_bits(sequence):
    runs = []
    for _ in range(2):
        tracker = started(sequence, TrackerConfig(seed=5), np.random.default_rng(0))
        runs.append(follow(tracker, sequence.frames[:6]).arrays["state"])
    np.testing.assert_array_equal(runs[0], runs[1])


@pytest.mark.slow
def test_the_published_swarm_alone_follows_the_hand(sequence):
    config = TrackerConfig(method="pso")
    tracker = started(sequence, config, np.random.default_rng(0))
    states = follow(tracker, sequence.frames[:8]).states
    error = np.linalg.norm(states[-1].joints_camera - sequence.joints(7), axis=1).mean()
    assert error < 0.03


@pytest.mark.slow
def test_deviations_are_published_for_every_value(sequence):
    tracker = started(sequence, TrackerConfig(), np.random.default_rng(0))
    state = tracker.step(sequence.frames[0])
    assert state.state_std.shape == state.state.shape == (32,)
    assert np.all(state.state_std > 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("end", ["low", "high"])
def test_every_end_of_a_range_can_be_run(sequence, end):
    costly = ("particles", "generations", "trials", "iterations", "turns")
    values = {"table": False, "track.swarm_cost": 0.0, "track.swarm_size": 32}
    for parameter in parameters_of(TrackerConfig()):
        name, kind = parameter.name, parameter.kind
        if kind.range is None or name in values or (end == "high" and name.endswith(costly)):
            continue
        value = kind.type(getattr(kind.range, end))
        values[name] = [value] if kind.many else value
    config = with_values(TrackerConfig(), values)
    tracker = started(sequence, config, np.random.default_rng(0))
    for frame in sequence.frames[:2]:
        tracker.step(frame)
    tracker = Tracker({}, config)
    tracker.start(NOTHING)
    tracker.step(sequence.frames[3])


def sr305_frames():
    return sorted(data_folder().rglob("*.png"))[:3]


@pytest.mark.slow
@pytest.mark.skipif(not sr305_frames(), reason="no real hand frames in INTENT_DATA")
def test_real_hand_frames_start_and_fit_the_measured_depth():
    fits = [real_fit(path) for path in sr305_frames()]
    assert all(fit.state.hand_tracked for fit in fits)
    assert np.median([fit.residual for fit in fits]) < 0.008


@pytest.mark.slow
def test_a_hand_that_was_misplaced_is_found_again(sequence):
    tracker = started(sequence, TrackerConfig(), np.random.default_rng(0))
    truth = sequence.truths[0]
    pose = jittered(truth.T_camera_hand, 0.05, 0.9, np.random.default_rng(1))
    tracker.place_hand("right", pose, truth.joints)
    state = follow(tracker, sequence.frames).states[-1]
    assert np.linalg.norm(state.joints_camera - sequence.joints(15), axis=1).mean() < 0.010
