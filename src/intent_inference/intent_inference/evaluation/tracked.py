"""Rendered demonstrations, tracked: what BN^H sees of a person it has never seen (Sec. IV-A).

A demonstrator (not the tracker's hand) takes an object that is in no training set (a shipped one
stretched by up to 15 %) for a task. The tracker follows the frames from the object's true pose with
a recogniser's error; the grasp detector says when and how the object is held. Labels are those of
the label rules on the *true* grasp.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from intent_inference.reach import palm_gap, palm_of, reach_features
from intent_inference.simulation.dataset import Row, feature_cells
from intent_inference.simulation.grasping_hand import GraspingHand
from intent_inference.simulation.labels import TASKS, label_grasp
from intent_inference.simulation.task_object import TaskObject
from intent_perception.draft import Draft, finish
from intent_perception.geometry import (
    Array,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.mesh import Mesh
from intent_perception.model import Functions, ObjectModel, Part
from intent_perception.objects import ObjectDatabase
from intent_perception.parametric import MAKERS
from intent_perception.recognition import RecognizedObject, RecognizedObjects
from intent_tracking.demonstrator import Shot, film, sample_set
from intent_tracking.demonstrator_hand import sample_hand
from intent_tracking.demonstrator_script import Act, Scenario, Script, rehearse
from intent_tracking.demonstrator_skin import make_skin
from intent_tracking.features import ObjectGeometry, as_right_hand
from intent_tracking.grasp import GraspDetector, StableGrasp
from intent_tracking.scene import SceneState
from intent_tracking.tracker import Tracker

_SHOWN = (
    ("mug", "pouring"), ("mug", "dish-washing"), ("mug", "hand-over"),
    ("glass", "pouring"), ("glass", "dish-washing"), ("glass", "hand-over"),
    ("bottle", "pouring"), ("bottle", "hand-over"),
    ("knife", "tool-use"), ("knife", "hand-over"), ("knife", "dish-washing"),
    ("hammer", "tool-use"), ("hammer", "hand-over"),
    ("screwdriver", "tool-use"), ("screwdriver", "hand-over"),
)  # fmt: skip
_AFTER = 20
"""Frames after the true grasp in which the detector may still find it."""
_STRETCH = 0.15
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


def stretched(model_class: str, index: int, rng: np.random.Generator, name: str) -> ObjectModel:
    """Return an object of a class that is in no database: a parametric one with other proportions.

    Args:
        model_class: one of the six classes.
        index: which of its eight makers.
        rng: source of the factors.
        name: of the new object.
    """
    draft = MAKERS[model_class][index]()
    across, along = 1.0 + rng.uniform(-_STRETCH, _STRETCH, 2)
    factor = np.array([across, across, along])

    def scaled(mesh: Mesh) -> Mesh:
        return Mesh(mesh.vertices * factor, mesh.faces)

    return finish(
        replace(
            draft,
            mesh=scaled(draft.mesh),
            parts=tuple(Part(part.name, scaled(part.mesh)) for part in draft.parts),
            functions=_stretched_functions(draft, factor),
        ),
        name,
        model_class,
    )


def _stretched_functions(draft: Draft, factor: Array) -> Functions:
    functions = draft.functions
    opening, edge, face, tip = functions.opening, functions.edge, functions.face, functions.tip
    if opening is not None:
        opening = replace(
            opening, center=opening.center * factor, radius=float(opening.radius * factor[0])
        )
    if edge is not None:
        edge = replace(edge, start=edge.start * factor, end=edge.end * factor)
    if face is not None:
        face = replace(face, center=face.center * factor)
    return replace(
        functions, opening=opening, edge=edge, face=face,
        tip=None if tip is None else tip * factor,
    )  # fmt: skip


def tracked_demonstration(seed: int) -> TrackedDemonstration:
    """Return one demonstration as the tracker saw it; the seed decides everything."""
    rng = np.random.default_rng([seed, 20_000])
    model_class, task = _SHOWN[seed % len(_SHOWN)]
    model = stretched(model_class, int(rng.integers(8)), rng, f"unseen_{model_class}_{seed}")
    side = "left" if rng.random() < 0.15 else "right"
    skin = make_skin(sample_hand(rng, side))
    scenario = Scenario("demonstration", (Act(model.name, task),), side=side)
    try:
        script = rehearse(scenario, {model.name: model}, skin, rng)
    except ValueError as error:
        return TrackedDemonstration(None, (), f"not shown: {error}")
    scene = sample_set(rng, script.edge)
    shots = film(script, skin, scene, rng)
    geometry = ObjectGeometry(model)
    share = _progress(script)
    reach: list[Row] = []
    for frame, state, grasp in _track(model, script, shots, scene.T_table_camera, rng):
        if grasp is not None:
            row = _grasp_row(seed, scenario, geometry, script, grasp)
            row["delay"] = frame - script.grasp_frames[0]
            return TrackedDemonstration(row, tuple(reach), "")
        if state.hand_tracked and frame < script.touch_frames[0]:
            reach.append(_reach_row(seed, geometry, state, float(share[frame])))
    return TrackedDemonstration(None, tuple(reach), "grasp not found")


def _track(
    model: ObjectModel, script: Script, shots: Iterator[Shot], T_table_camera: Array,
    rng: np.random.Generator,
) -> Iterator[tuple[int, SceneState, StableGrasp | None]]:  # fmt: skip
    """Yield frame number, tracked state and the grasp, if it was found in that frame."""
    error = make_pose(
        rotation_from_vector(rng.normal(0.0, _ANGLE_ERROR, 3)), rng.normal(0.0, _POSITION_ERROR, 3)
    )
    start = script.objects[0, 0] @ error
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


def _grasp_row(
    seed: int, scenario: Scenario, geometry: ObjectGeometry, script: Script, grasp: StableGrasp
) -> Row:
    """Return the tracked features, their deviations and the true grasp's labels."""
    pose = script.grips[0]
    if scenario.side == "left":
        pose = as_right_hand(geometry, pose)
    joints = script.angles[script.grasp_frames[0]]
    labels = label_grasp(TaskObject(geometry.model), GraspingHand.load("human"), pose, joints)
    row: Row = {
        "demonstration": str(seed),
        "object_id": geometry.model.name,
        "shown": scenario.acts[0].task,
        "hand_side": grasp.hand_side,
    }
    row.update(feature_cells(grasp.features))
    for name in TASKS:
        afforded = labels[name].afforded
        row[name] = "" if afforded is None else int(afforded)
    deviations = feature_cells(grasp.std)
    row.update({f"std_{n}": v for n, v in deviations.items() if n != "object_class"})
    return row


def _reach_row(seed: int, geometry: ObjectGeometry, state: SceneState, progress: float) -> Row:
    row: Row = {"demonstration": str(seed), "progress": progress, "stamp": state.stamp * 1e-9}
    palm = transform_points(state.T_table_hand, palm_of(state.hand_side))
    row["gap"] = palm_gap(geometry, state.T_table_objects[0], palm)
    row.update(feature_cells(reach_features(geometry, state, 0)))
    return row
