"""People's own grasps and motions, with the intent known (one person's motion capture).

Read from the folder `INTENT_REAL_GRASPS`, evaluated only: nothing is fitted to it, and none of it
ships. How near its grasps are to the simulated ones is told by -log p(evidence) and by the nearest
grasp of the class. Lift-off is the first frame in which the object is 2 cm above where it lay; a
look "1 s after" takes the last word about the held object up to then.
"""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.intention.observe_command import observed
from intent_inference.intention.observed_scene import ObservedScene, read_observed
from intent_inference.quantisation.feature_table import Features
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.evaluation.scores import auc
from intent_inference.workshop.simulation.labels import label_grasp
from intent_inference.workshop.training.labelled_table import read_grasps
from intent_inference.workshop.training.shown_grasps import features_of_cells
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import Functions, ObjectModel, Opening
from intent_tracking.grasp.grasp_detector import GraspDetector
from intent_tracking.grasp.grasp_features import GraspFeatures

FOLDER = "out/real/grasps"
_PASSED = ("pass", "offhand")
_POURED = ("drink", "pour", "toast")
_USED = ("use",)
_LIFT, _AFTER, _RIM = 0.02, 1.0, 0.004
_VESSELS = ("mug", "glass", "bottle")
_DRAWS = 1000


def human_figures(model: str, data: Path, seed: int) -> dict[str, Any] | None:
    """Return the contract's `human`; None where the recordings are absent.

    Args:
        model: file of BN^H; empty: the shipped one.
        data: table of the simulated grasps that it was learned from.
        seed: of the bootstrap.
    """
    folder = Path(os.environ.get("INTENT_REAL_GRASPS", FOLDER))
    database = folder / "objects.yaml"
    if not database.is_file():
        return None
    config = InferenceConfig(model=model, models=str(database), explain=False)
    estimator = IntentionEstimator(config)
    own = ObjectDatabase.load(database, alone=True)
    table = read_grasps(data).features
    rows = [_row(path, estimator, own, table) for path in sorted(folder.glob("*.npz"))]
    return {
        "sequences": len(rows),
        "no_grasp": [row["name"] for row in rows if not row["grasped"]],
        "hand_error_mm": float(np.median([row["error"] for row in rows])),
        "unknown_score": _median(rows, "unknown"),
        "nearest_deg": np.degrees(_median(rows, "nearest")),
        "nearest_count": sum(bool(np.isfinite(row["nearest"])) for row in rows),
        **_passes(rows, np.random.default_rng(seed)),
        "poured_accepted": _share([row["poured"] for row in rows if row["intent"] in _POURED]),
        "poured_count": sum(row["intent"] in _POURED for row in rows),
        "tool_use_used": [row["used_1s"] for row in rows if _hammer(row, _USED)],
        "tool_use_passed": [row["used_1s"] for row in rows if _hammer(row, _PASSED)],
        "tool_use_used_grasp": [row["used"] for row in rows if _hammer(row, _USED)],
        "tool_use_passed_grasp": [row["used"] for row in rows if _hammer(row, _PASSED)],
    }


def _hammer(row: dict[str, Any], intents: tuple[str, ...]) -> bool:
    return row["class"] == "hammer" and row["intent"] in intents


def _median(rows: list[dict[str, Any]], key: str) -> float:
    """Return the median over the grasps of known classes."""
    return float(np.nanmedian([row[key] for row in rows if row["class"]]))


def _share(accepted: list[bool | None]) -> float | None:
    known = [own for own in accepted if own is not None]
    return float(np.mean(known)) if known else None


def _row(
    path: Path, estimator: IntentionEstimator, own: ObjectDatabase, table: Features
) -> dict[str, Any]:
    """Return what is known and what was said about one sequence."""
    scene = read_observed(path)
    answer = observed(scene, estimator)
    heights = scene.T_table_object[:, 2, 3]
    lifted = heights > heights[0] + _LIFT
    lift = float(scene.stamp[int(np.argmax(lifted))]) if lifted.any() else float(scene.stamp[-1])
    held = [said for said in answer["timeline"] if said["stage"] != "REACH"]
    later = [said for said in held if lift <= said["stamp"] <= lift + _AFTER]
    first = answer["grasps"][0] if answer["grasps"] else None
    last = later[-1] if later else None
    intent = str(read_arrays(path, "recording")["intent"])
    return {
        "name": path.stem,
        "class": own[scene.object_model].object_class,
        "intent": intent,
        "grasped": first is not None,
        "unknown": float("nan") if first is None else first["unknown_score"],
        "nearest": float("nan")
        if first is None
        else nearest_grasp(features_of_cells(first["features"]), table),
        "error": answer["hand_error_mm"],
        "passed": _meant(first, "hand-over"),
        "passed_1s": _meant(last, "hand-over"),
        "used": _meant(first, "tool-use"),
        "used_1s": _meant(last, "tool-use"),
        "poured": _poured(scene, own) if intent in _POURED else None,
    }


def _meant(said: dict[str, Any] | None, task: str) -> float:
    return float("nan") if said is None else float(said["intends"].get(task, 0.0))


def _poured(scene: ObservedScene, own: ObjectDatabase) -> bool | None:
    """Return whether the pouring rule accepts the first stable grasp of a vessel."""
    model = own[scene.object_model]
    if model.object_class not in _VESSELS:
        return None
    detector = GraspDetector(own)
    for state in scene.states(own):
        grasp = detector.step(state)
        if grasp is not None and grasp.features.fcon is not None:
            target, hand = TaskObject(with_opening(model)), GraspingHand.load("human")
            labels = label_grasp(target, hand, grasp.T_object_hand, grasp.features.fcon)
            return labels["pouring"].afforded
    return False


def with_opening(model: ObjectModel) -> ObjectModel:
    """Return a vessel whose opening, where nobody has annotated it, is the ring of its top."""
    if model.functions is not None:
        return model
    vertices = model.mesh.vertices
    top = float(vertices[:, 2].max())
    ring = vertices[vertices[:, 2] > top - _RIM][:, :2]
    middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
    radius = float(np.median(np.linalg.norm(ring - middle, axis=1)))
    opening = Opening(np.array([*middle, top]), np.array([0.0, 0.0, 1.0]), radius)
    return replace(model, functions=Functions(opening=opening))


def _passes(rows: list[dict[str, Any]], rng: np.random.Generator) -> dict[str, Any]:
    """Return how p(hand-over) ranks passing and handing to the other hand above all else."""
    labels = np.array([float(row["intent"] in _PASSED) for row in rows])
    result: dict[str, Any] = {}
    for name, key in (("pass_auc_grasp", "passed"), ("pass_auc_1s", "passed_1s")):
        scores = np.array([row[key] for row in rows])
        known = np.isfinite(scores)
        result[name] = auc(labels[known], scores[known])
        result[name.replace("auc", "auc_ci")] = _interval(labels[known], scores[known], rng)
    result["pass_auc_ci"] = result["pass_auc_ci_1s"]
    return result


def _interval(labels: Array, scores: Array, rng: np.random.Generator) -> list[float]:
    """Return the 95 % interval of the AUC, sequences drawn with replacement."""
    draws = []
    for _ in range(_DRAWS):
        rows = rng.integers(0, len(labels), len(labels))
        if 0.0 < labels[rows].mean() < 1.0:
            draws.append(auc(labels[rows], scores[rows]))
    return [float(value) for value in np.percentile(draws, (2.5, 97.5))] if draws else []


def nearest_grasp(grasp: GraspFeatures, table: Features) -> float:
    """Return how far the nearest grasp of the same class is off [rad].

    Three angles alike: between the hands' orientations, between the sides of the object on which
    they are, and of the finger joints (root mean square).

    Args:
        grasp: with class, dir, npos and fcon; NaN comes back where one of them is unknown.
        table: of N grasps, with the same variables.
    """
    if grasp.dir is None or grasp.npos is None or grasp.fcon is None:
        return float("nan")
    alike = np.asarray(table[OBJECT_CLASS], dtype=str) == (grasp.object_class or "")
    if not alike.any():
        return float("nan")
    turn = 2.0 * _angle(np.abs(table["dir"][alike] @ grasp.dir))
    side = _angle(table["npos"][alike] @ grasp.npos)
    fingers = np.sqrt(np.mean((table["fcon"][alike] - grasp.fcon) ** 2, axis=1))
    return float(np.nanmin((turn + side + fingers) / 3.0))


def _angle(cosine: Array) -> Array:
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))
