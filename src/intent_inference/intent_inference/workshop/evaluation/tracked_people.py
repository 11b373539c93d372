"""Rendered demonstrations, tracked: what BN^H sees of a person it has never seen (Sec. IV-A).

The tracker follows the frames of a demonstration (`shown`) from the object's true pose with a
recogniser's error; the grasp detector says when and how the object is held. Labels are those of the
label rules on the *true* grasp.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from intent_inference.intention.reach import palm_gap, palm_of, reach_features
from intent_inference.quantisation.grasp_cells import Row, feature_cells
from intent_inference.workshop.evaluation.shown_people import Showing, showing
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import (
    inverse,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.grasp.grasp_detector import GraspDetector, StableGrasp
from intent_tracking.grasp.grasp_features import GraspedShape
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.workshop.person.acting.script import Script
from intent_tracking.workshop.person.filming.film import CAMERA, Set, Shot, film, sample_set

_BEFORE = 6
"""Frames that are filmed before the hand comes into the picture."""
_AFTER = 20
"""Frames after the true grasp in which the detector may still find it."""
_POSITION_ERROR = 0.001
_ANGLE_ERROR = 0.01


@dataclass(frozen=True, eq=False)
class TrackedDemonstration:
    """Rows for the two files, or why there are none."""

    grasp: Row | None
    """The grasp as detected; None: not found."""
    reach: tuple[Row, ...]
    """Frames before the first touch in which the hand was tracked."""
    reason: str
    """"" or what went wrong."""


def tracked_demonstration(seed: int) -> TrackedDemonstration:
    """Return one demonstration as the tracker saw it; the seed decides everything."""
    try:
        shown = showing(seed)
    except ValueError as error:
        return TrackedDemonstration(None, (), f"not shown: {error}")
    rng = np.random.default_rng([seed, 20_002])
    scene = sample_set(rng, shown.script.edge)
    first = max(0, _entrance(shown, scene) - _BEFORE)
    script = _from(shown.script, first)
    geometry = shown.target.geometry
    share = _progress(shown.script)[first:]
    reach: list[Row] = []
    shots = film(script, shown.skin, scene, rng)
    for frame, state, grasp in _track(shown, script, shots, scene.T_table_camera, rng):
        if grasp is not None:
            row = _grasp_row(seed, shown, grasp)
            row["delay"] = frame - script.grasp_frames[0]
            return TrackedDemonstration(row, tuple(reach), "")
        if state.hand_tracked and frame < script.touch_frames[0]:
            reach.append(_reach_row(seed, geometry, state, float(share[frame])))
    return TrackedDemonstration(None, tuple(reach), "grasp not found")


def _entrance(shown: Showing, scene: Set) -> int:
    """Return the first frame in which a joint of the hand lies within the image."""
    script, hand = shown.script, shown.skin.hand
    for frame in range(script.touch_frames[0]):
        joints = transform_points(script.hands[frame], hand.joint_positions(script.angles[frame]))
        joints = transform_points(inverse(scene.T_table_camera), joints)
        u, v = CAMERA.project(joints[joints[:, 2] > 0.05]).T
        if np.any((u >= 0) & (u < CAMERA.width) & (v >= 0) & (v < CAMERA.height)):
            return frame
    return script.touch_frames[0]


def _from(script: Script, first: int) -> Script:
    """Return the script without the frames before `first`."""
    return replace(
        script,
        hands=script.hands[first:],
        angles=script.angles[first:],
        wrists=script.wrists[first:],
        elbows=script.elbows[first:],
        shoulders=script.shoulders[first:],
        objects=script.objects[first:],
        grasp_frames=tuple(frame - first for frame in script.grasp_frames),
        touch_frames=tuple(frame - first for frame in script.touch_frames),
    )


def _track(
    shown: Showing, script: Script, shots: Iterator[Shot], T_table_camera: Array,
    rng: np.random.Generator,
) -> Iterator[tuple[int, SceneState, StableGrasp | None]]:  # fmt: skip
    """Yield frame number, tracked state and the grasp, if it was found in that frame."""
    error = make_pose(
        rotation_from_vector(rng.normal(0.0, _ANGLE_ERROR, 3)), rng.normal(0.0, _POSITION_ERROR, 3)
    )
    start, model = script.objects[0, 0] @ error, shown.target.model
    tracker = Tracker({model.name: model})
    detector = GraspDetector(ObjectDatabase((model,)))
    for frame, shot in enumerate(shots):
        if frame > script.grasp_frames[0] + _AFTER:
            return
        if frame == 0:
            found = RecognizedObject(model.name, model.name, model.object_class, start, 1.0, 1.0)
            tracker.start(RecognizedObjects(shot.frame.stamp, (found,), T_table_camera))
        state = tracker.step(shot.frame)
        yield frame, state, detector.step(state)


def _progress(script: Script) -> Array:
    """Return the share (F,) of the wrist's way from first motion to touch that is done."""
    touch = script.touch_frames[0]
    steps = np.linalg.norm(np.diff(script.hands[:, :3, 3], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    return way / max(float(way[touch]), 1e-9)


def _grasp_row(seed: int, shown: Showing, grasp: StableGrasp) -> Row:
    """Return the tracked features, their deviations and the true grasp's labels."""
    row: Row = {
        "demonstration": str(seed),
        "object_id": shown.target.model.name,
        "shown": shown.scenario.acts[0].task,
        "hand_side": grasp.hand_side,
    }
    row.update(feature_cells(grasp.features))
    for name, afforded in shown.labels.items():
        row[name] = "" if afforded is None else int(afforded)
    deviations = feature_cells(grasp.std)
    row.update({f"std_{n}": v for n, v in deviations.items() if n != "object_class"})
    return row


def _reach_row(seed: int, geometry: GraspedShape, state: SceneState, progress: float) -> Row:
    row: Row = {"demonstration": str(seed), "progress": progress, "stamp": state.stamp * 1e-9}
    palm = transform_points(state.T_table_hand, palm_of(state.hand_side))
    row["gap"] = palm_gap(geometry, state.T_table_objects[0], palm)
    row.update(feature_cells(reach_features(geometry, state, 0)))
    return row
