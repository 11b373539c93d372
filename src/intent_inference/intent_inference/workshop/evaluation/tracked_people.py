"""Rendered demonstrations, tracked: what BN^H sees of a person it has never seen (Sec. IV-A).

The tracker follows the frames of a demonstration (`shown`) from the object's true pose with a
recogniser's error, or knows no more of the object than its first frame shows. The grasp detector
says when and how the object is held. Labels are those of the label rules on the *true* grasp.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

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
from intent_perception.recognition.recognizer import (
    RecognizedObject,
    RecognizedObjects,
    things_alone,
)
from intent_tracking.grasp.grasp_detector import GraspDetector, StableGrasp
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


@dataclass(frozen=True, eq=False)
class _Film:
    """A demonstration from shortly before the hand comes into the picture."""

    shown: Showing
    script: Script
    progress: Array
    """(F,) share of the wrist's way from first motion to touch that is done."""
    T_table_camera: Array
    """(4, 4)."""
    T_true_recognized: Array
    """(4, 4) a recogniser's error, in the object's frame."""
    shots: Iterator[Shot]


def tracked_demonstration(seed: int) -> TrackedDemonstration:
    """Return one demonstration as the tracker saw it; the seed decides everything."""
    try:
        filmed = _filmed(seed)
    except ValueError as error:
        return TrackedDemonstration(None, (), f"not shown: {error}")
    script, model = filmed.script, filmed.shown.target.model
    start = script.objects[0, 0] @ filmed.T_true_recognized
    found = RecognizedObject(model.name, model.name, model.object_class, start, 1.0, 1.0)
    first = next(filmed.shots)
    objects = RecognizedObjects(first.frame.stamp, (found,), filmed.T_table_camera)
    reach: list[Row] = []
    for frame, state, grasp in _track(filmed, first, objects, ObjectDatabase((model,))):
        if grasp is not None:
            return TrackedDemonstration(_grasp_row(seed, filmed, frame, grasp), tuple(reach), "")
        if state.hand_tracked and frame < script.touch_frames[0]:
            reach.append(_reach_row(seed, filmed, state, frame))
    return TrackedDemonstration(None, tuple(reach), "grasp not found")


def estimated_demonstration(seed: int) -> TrackedDemonstration:
    """Return the same film tracked by the shape that is estimated from its first frame.

    No object is known: class, mesh, pose, table and Table I all come out of the estimate.
    """
    try:
        filmed = _filmed(seed)
    except ValueError as error:
        return TrackedDemonstration(None, (), f"not shown: {error}")
    first = next(filmed.shots)
    objects = things_alone(first.frame)
    shapes = tuple(thing.shape for thing in objects.objects if thing.shape is not None)
    if not shapes:
        return TrackedDemonstration(None, (), "no shape estimated")
    for frame, _, grasp in _track(filmed, first, objects, ObjectDatabase(shapes)):
        if grasp is not None:
            return TrackedDemonstration(_grasp_row(seed, filmed, frame, grasp), (), "")
    return TrackedDemonstration(None, (), "grasp not found")


def _filmed(seed: int) -> _Film:
    """Return the film of a seed.

    Raises:
        ValueError: if the person found no comfortable grasp.
    """
    shown = showing(seed)
    rng = np.random.default_rng([seed, 20_002])
    scene = sample_set(rng, shown.script.edge)
    first = max(0, _entrance(shown, scene) - _BEFORE)
    script = _from(shown.script, first)
    turn = rotation_from_vector(rng.normal(0.0, _ANGLE_ERROR, 3))
    error = make_pose(turn, rng.normal(0.0, _POSITION_ERROR, 3))
    shots = film(script, shown.skin, scene, rng)
    progress = _progress(shown.script)[first:]
    return _Film(shown, script, progress, scene.T_table_camera, error, shots)


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
    filmed: _Film, first: Shot, objects: RecognizedObjects, models: ObjectDatabase
) -> Iterator[tuple[int, SceneState, StableGrasp | None]]:
    """Yield frame number, tracked state and the grasp, if it was found in that frame.

    Args:
        filmed: the demonstration.
        first: its first frame, which is taken from it already.
        objects: what is recognised in that.
        models: of these objects.
    """
    tracker, detector = Tracker(models), GraspDetector(models)
    tracker.start(objects)
    for frame, shot in enumerate(chain([first], filmed.shots)):
        if frame > filmed.script.grasp_frames[0] + _AFTER:
            return
        state = tracker.step(shot.frame)
        yield frame, state, detector.step(state)


def _progress(script: Script) -> Array:
    """Return the share (F,) of the wrist's way from first motion to touch that is done."""
    touch = script.touch_frames[0]
    steps = np.linalg.norm(np.diff(script.hands[:, :3, 3], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    return way / max(float(way[touch]), 1e-9)


def _grasp_row(seed: int, filmed: _Film, frame: int, grasp: StableGrasp) -> Row:
    """Return the tracked features, their deviations and the true grasp's labels."""
    shown = filmed.shown
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
    row["delay"] = frame - filmed.script.grasp_frames[0]
    return row


def _reach_row(seed: int, filmed: _Film, state: SceneState, frame: int) -> Row:
    geometry, progress = filmed.shown.target.geometry, float(filmed.progress[frame])
    row: Row = {"demonstration": str(seed), "progress": progress, "stamp": state.stamp * 1e-9}
    palm = transform_points(state.T_table_hand, palm_of(state.hand_side))
    row["gap"] = palm_gap(geometry, state.T_table_objects[0], palm)
    row.update(feature_cells(reach_features(geometry, state, 0)))
    return row
