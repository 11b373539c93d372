"""What nodes say to each other: grasps, states and objects of impossible values."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tests.faults import mutation
from tests.faults.mutation import Rng
from tests.faults.outcome import Answer, Subject
from tests.support import demo_records

from intent_imitation.planner.planner import GraspPlanner
from intent_imitation.planner.planner_config import PlannerConfig
from intent_inference import SHARE
from intent_inference.intention.estimator import IntentionEstimator
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_perception.basics.array_files import read_arrays
from intent_perception.geometry.transforms import require_pose
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.grasp.grasp_detector import GraspDetector, StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures

_NAMES = ("size", "conv", "dir", "npos", "fcon", "fvol", "coc", "gbvl")


def finite(*values: Any) -> bool:
    return all(np.all(np.isfinite(np.asarray(v, dtype=np.float64))) for v in values)


@cache
def features() -> dict[str, Any]:
    """Return three rows of Table I."""
    table = read_grasps(SHARE / "data" / "human.csv.gz")
    return {name: values[:3] for name, values in table.features.items()}


@cache
def _estimator() -> IntentionEstimator:
    return IntentionEstimator()


@cache
def _database() -> ObjectDatabase:
    return ObjectDatabase.load().select(demo_records.NAMES)


@cache
def _planner() -> GraspPlanner:
    return GraspPlanner(_database(), PlannerConfig())


def _changed(rng: Rng, arrays: dict[str, Any], file: Path) -> Path:
    """Write arrays of which one is changed in values or shape."""
    name = str(rng.choice(sorted(arrays)))
    changed = {key: np.atleast_1d(value) for key, value in arrays.items()}
    changed[name] = mutation.wild(rng, changed[name])
    if rng.random() < 0.25:
        changed[name] = changed[name].ravel()[:-1]
    np.savez(file, **changed)
    return file


def _grasp(rng: Rng, folder: Path) -> Path:
    row = {name: np.asarray(features()[name][0]) for name in _NAMES}
    std = {f"std_{name}": np.full(np.size(value), 0.05) for name, value in row.items()}
    if rng.random() < 0.1:
        row = {name: np.full(np.shape(value), -1.0) for name, value in row.items()}
    return _changed(rng, {**row, **std, "T": np.eye(4)}, folder / "grasp.npz")


def _use_grasp(path: Path) -> Answer:
    stored = read_arrays(path, "grasp")
    values = GraspFeatures("mug", **{name: stored.get(name) for name in _NAMES})
    std = GraspFeatures(None, **{name: stored.get(f"std_{name}") for name in _NAMES})
    grasp = StableGrasp(1, "mug_0", "mug_0", "mug", "right", values, std, stored["T"])
    posterior = _estimator().step(grasp)
    assert posterior is not None
    return Answer(finite(posterior.probability, posterior.unknown_score))


def _state(rng: Rng, folder: Path) -> Path:
    state = demo_records.state(demo_records.recognized(_database()), 1, True)
    arrays = {
        "state": state.state, "state_std": state.state_std, "hand_shape": state.hand_shape,
        "T_table_camera": state.T_table_camera,
    }  # fmt: skip
    return _changed(rng, arrays, folder / "state.npz")


def _use_state(path: Path) -> Answer:
    whole = demo_records.state(demo_records.recognized(_database()), 1, True)
    state = replace(whole, **read_arrays(path, "state"))
    detector = GraspDetector(_database())
    for k in range(8):
        grasp = detector.step(replace(state, stamp=(k + 1) * demo_records.STEP))
        assert grasp is None or finite(grasp.T_object_hand)
    posterior = _estimator().step(state)
    return Answer(posterior is None or finite(posterior.probability))


def _objects(rng: Rng, folder: Path) -> Path:
    objects = demo_records.recognized(_database())
    arrays = {f"T{k}": item.T_table_object for k, item in enumerate(objects.objects)}
    arrays |= {"confidence": np.array([item.confidence for item in objects.objects])}
    return _changed(rng, {**arrays, "camera": objects.T_table_camera}, folder / "objects.npz")


def _use_objects(path: Path) -> Answer:
    stored = read_arrays(path, "objects")
    items = tuple(
        RecognizedObject(name, name, "mug", stored[f"T{k}"], float(stored["confidence"][k]), 0.8)
        for k, name in enumerate(demo_records.NAMES[: len(stored["confidence"])])
    )
    _planner().start(RecognizedObjects(1, items, stored["camera"]))
    plan = _planner().step(demo_records.posterior(2, False))
    for grasp in () if plan is None else plan.grasps:
        require_pose(grasp.T_table_hand, "plan")
    return Answer(plan is None or finite(*(grasp.score for grasp in plan.grasps)))


RESULT_SUBJECTS = (
    Subject("stable grasp", _grasp, _use_grasp),
    Subject("scene state", _state, _use_state),
    Subject("recognised objects", _objects, _use_objects),
)
