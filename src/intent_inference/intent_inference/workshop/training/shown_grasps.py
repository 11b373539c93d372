"""Grasps that somebody has shown for a task: observed scenes as rows of a labelled table."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.intention.observe_command import observed
from intent_inference.intention.observed_scene import read_observed
from intent_inference.quantisation.feature_table import stack_features
from intent_inference.quantisation.variables import OBJECT_CLASS
from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.basics.checked_files import read_json
from intent_tracking.grasp.grasp_features import GraspFeatures, check_features


def shown_grasps(paths: Sequence[Path], task: str, models: str) -> GraspTable:
    """Return the first grasp of each recording, labelled with what it was shown for.

    Args:
        paths: what `observe` wrote (.json), or the timelines that it reads (.npz).
        task: that all of them show; of other tasks nothing is known.
        models: object database of the timelines; empty: the shipped one.

    Raises:
        ValueError: if a file is neither, or in one of them nothing is grasped.
    """
    if not task:
        raise ValueError("expected --shown TASK: recordings do not say what they show")
    grasps = [_first_grasp(path, models) for path in paths]
    features = stack_features(grasps)
    classes = np.asarray(features.get(OBJECT_CLASS, np.full(len(grasps), "")), dtype=str)
    return GraspTable(features, {task: np.ones(len(grasps))}, {"object_class": classes})


def _first_grasp(path: Path, models: str) -> GraspFeatures:
    if path.suffix == ".npz":
        estimator = IntentionEstimator(InferenceConfig(models=models, explain=False))
        answer = observed(read_observed(path), estimator)
    else:
        answer = read_json(path)
    grasps = answer.get("grasps") if isinstance(answer, dict) else None
    if not grasps or not isinstance(grasps[0].get("features"), dict):
        raise ValueError(f"{path}: expected a recording in which something is grasped")
    return features_of_cells(grasps[0]["features"])


def features_of_cells(cells: dict[str, Any]) -> GraspFeatures:
    """Return the features of a grasp as `observe` writes them.

    Raises:
        ValueError: if one is missing or no grasp has such a value.
    """
    names = [field.name for field in fields(GraspFeatures)]
    if missing := [name for name in names if name not in cells]:
        raise ValueError(f"expected the features of a grasp, {missing} are missing")
    values: dict[str, Any] = {
        name: cells[name] if name == "object_class" or cells[name] is None
        else np.asarray(cells[name], dtype=np.float64)
        for name in names
    }  # fmt: skip
    features = GraspFeatures(**values)
    check_features(features)
    return features
