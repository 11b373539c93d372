"""Figures on the synthetic views: errors, recovery of a lost track, coverage, CPU time."""

import time
from dataclasses import dataclass, replace

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.scene.hand_model import LIMITS, HandModel
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.views import (
    ViewFrame,
    mismatched_hand,
    pour_sequence,
    rendered_frames,
)

VIEWS = {"v0": 0.0, "v120": 120.0, "v240": 240.0}
OBJECT = "mug_0"


@dataclass(frozen=True, eq=False)
class ViewSequence:
    """One rendered sequence with its truth."""

    model: ObjectModel
    hand: HandModel
    truths: list[ViewFrame]
    frames: list[RgbdFrame]

    def every(self, stride: int, first: int) -> "ViewSequence":
        """Return the sequence as a camera sees it that delivers every stride-th frame only."""
        chosen = slice(first, None, stride)
        return replace(self, truths=self.truths[chosen], frames=self.frames[chosen])

    def joints(self, number: int) -> Array:
        """Return the true landmarks (21, 3) of a frame in the camera's frame [m]."""
        truth = self.truths[number]
        return transform_points(truth.T_camera_hand, self.hand.joint_positions(truth.joints))


@dataclass(frozen=True, eq=False)
class ViewErrors:
    """What a tracker got wrong on one sequence, per frame."""

    joints: Array
    """(F,) mean error of 21 landmarks [m]."""
    place: Array
    """(F,) object position [m]."""
    tilt: Array
    """(F,) angle between the object's axes [rad]."""
    covered: Array
    """(F, 21) whether the published two deviations cover the landmark."""
    seconds: Array
    """(F,) CPU time [s]."""


def view_sequence(view: str, seed: int, frames: int | None = None) -> ViewSequence:
    """Return the sequence of one view; the seed draws hand and noise."""
    rng = np.random.default_rng(seed)
    model = ObjectDatabase.load()[OBJECT]
    hand = mismatched_hand(rng)
    hull = SignedDistance.from_mesh(model.mesh.convex_hull, 0.003, 0.03)
    truths = pour_sequence(VIEWS[view], hand, hull)[:frames]
    drawn = list(rendered_frames(truths, hand, (model.mesh, model.color), rng))
    return ViewSequence(model, hand, truths, drawn)


def started(sequence: ViewSequence, config: TrackerConfig, rng: np.random.Generator) -> Tracker:
    """Return a tracker that begins within 10 mm and 10 degrees of the first frame's truth.

    The views have no table.
    """
    first = sequence.truths[0]
    tracker = Tracker({sequence.model.name: sequence.model}, replace(config, table=False))
    item = RecognizedObject(
        OBJECT,
        OBJECT,
        "mug",
        jittered(first.T_camera_object, 0.005, np.radians(3.0), rng),
        1.0,
        1.0,
    )
    tracker.start(RecognizedObjects(0, (item,), np.eye(4)))
    pose = jittered(first.T_camera_hand, 0.010, np.radians(10.0), rng)
    joints = np.clip(
        first.joints + rng.uniform(-1, 1, 20) * np.radians(10.0), LIMITS[:, 0], LIMITS[:, 1]
    )
    tracker.place_hand("right", pose, joints)
    return tracker


def jittered(pose: Array, place: float, angle: float, rng: np.random.Generator) -> Array:
    """Return a pose (4, 4) moved by up to `place` [m] and turned by up to `angle` [rad]."""
    offset, axis = rng.normal(size=3), rng.normal(size=3)
    turn = rotation_from_vector(axis / np.linalg.norm(axis) * rng.uniform(0.0, angle))
    shift = offset / np.linalg.norm(offset) * rng.uniform(0.0, place)
    return make_pose(turn @ pose[:3, :3], pose[:3, 3] + shift)


def view_errors(sequence: ViewSequence, config: TrackerConfig, seed: int) -> ViewErrors:
    """Return the errors of a tracker on one sequence."""
    tracker = started(sequence, config, np.random.default_rng([seed, 1]))
    rows = []
    for number, frame in enumerate(sequence.frames):
        began = time.process_time()
        state = tracker.step(frame)
        seconds = time.process_time() - began
        rows.append((*_frame_errors(sequence, number, state), seconds))
    joints, place, tilt, covered, cpu = (np.array(column) for column in zip(*rows, strict=True))
    return ViewErrors(joints, place, tilt, covered, cpu)


def _frame_errors(
    sequence: ViewSequence, number: int, state: SceneState
) -> tuple[float, float, float, Array]:
    truth = sequence.truths[number]
    expected = sequence.joints(number)
    offset = np.linalg.norm(state.joints_camera - expected, axis=1)
    pose = inverse(state.T_table_camera) @ state.T_table_objects[0]
    place = float(np.linalg.norm(pose[:3, 3] - truth.T_camera_object[:3, 3]))
    cosine = float(pose[:3, 2] @ truth.T_camera_object[:3, 2])
    covered = np.abs(state.joints_camera - expected) <= 2.0 * joint_deviation(state)
    error = float(offset.mean()) if state.hand_tracked else 0.1
    return error, place, float(np.arccos(np.clip(cosine, -1.0, 1.0))), covered.mean(axis=1)


def joint_deviation(state: SceneState) -> Array:
    """Return the deviation (21, 3) of the landmarks that the state's deviations imply [m].

    Along the table's axes. The 26 values are taken as independent; NaN without a hand.
    """
    if not state.hand_tracked:
        return np.full((21, 3), np.nan)
    model, step = state.hand, 1e-4
    joints = np.tile(state.joint_angles, (21, 1))
    joints[1:][np.diag_indices(20)] += step
    local = model.joint_positions(joints)
    rotation = state.T_table_hand[:3, :3]
    slopes = ((local[1:] - local[0]) / step) @ rotation.T
    arms = local[0] @ rotation.T
    turns = np.stack([np.cross(axis, arms) for axis in np.eye(3)])
    moves = np.broadcast_to(np.eye(3)[:, None, :], (3, 21, 3))
    jacobian = np.concatenate([moves, turns, slopes])
    spread = np.sqrt(np.einsum("qpi,q->pi", jacobian**2, state.state_std[:26] ** 2))
    return np.asarray(spread @ np.eye(3))


def recovery(sequence: ViewSequence, config: TrackerConfig, seed: int, trials: int) -> float:
    """Return how often a pose 50 mm, 50 degrees and 34 degrees per joint off is mended.

    Mended: the mean error is below 10 mm within 15 frames.
    """
    rng = np.random.default_rng([seed, 2])
    mended = 0
    for _ in range(trials):
        first = int(rng.integers(0, 25))
        mended += _recovers(sequence, config, first, rng)
    return mended / trials


def _recovers(
    sequence: ViewSequence, config: TrackerConfig, first: int, rng: np.random.Generator
) -> bool:
    tracker = started(sequence, config, rng)
    truth = sequence.truths[first]
    axis, shift = rng.normal(size=3), rng.normal(size=3)
    turn = rotation_from_vector(axis / np.linalg.norm(axis) * np.radians(50.0))
    place = truth.T_camera_hand[:3, 3] + shift / np.linalg.norm(shift) * 0.05
    joints = truth.joints + rng.choice([-1.0, 1.0], 20) * np.radians(34.0)
    pose = make_pose(turn @ truth.T_camera_hand[:3, :3], place)
    tracker.place_hand("right", pose, np.clip(joints, LIMITS[:, 0], LIMITS[:, 1]))
    for number in range(first, min(first + 15, len(sequence.frames))):
        error = _frame_errors(sequence, number, tracker.step(sequence.frames[number]))[0]
        if error < 0.010:
            return True
    return False
