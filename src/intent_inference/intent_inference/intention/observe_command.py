"""Command: what a person means, from hands and objects that any other source has measured.

    python -m intent_inference.observe F.npz [--models DB] [--model M] --json OUT

F.npz: `stamp` (F,) s, `joints` (F, 21, 3) m (wrist; thumb to little finger, each from palm to
tip) in a frame with z up, `T_object` (F, 4, 4), `object_model`, `hand_side`, optional
`table_height`. The same grasp detector, features, networks and motion model as the nodes.
"""

import argparse
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.intention.observed_scene import ObservedScene, read_observed
from intent_inference.intention.task_posterior import TaskPosterior
from intent_perception.basics.safe_files import output_file, write_json
from intent_tracking.grasp.grasp_detector import GraspDetector
from intent_tracking.grasp.grasp_features import GraspFeatures


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog="intent_inference.observe",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", type=Path, help="NPZ with hands and objects")
    parser.add_argument("--models", default="", help="object database (default: the shipped one)")
    parser.add_argument("--model", default="", help="BN^H (default: the shipped one)")
    parser.add_argument("--json", type=output_file, default="-", help="file, - = print")
    options = parser.parse_args(arguments)
    try:
        estimator = IntentionEstimator(InferenceConfig(options.model, options.models))
        scene = read_observed(options.file)
        if scene.object_model not in estimator.database:
            raise ValueError(
                f"{options.file}: expected an object of the database, got "
                f"{scene.object_model!r}; give yours with --models"
            )
        answer = observed(scene, estimator)
    except ValueError as error:
        print(f"observe: {error}", file=sys.stderr)
        return 2
    write_json(options.json, answer)
    return 0


def observed(scene: ObservedScene, estimator: IntentionEstimator) -> dict[str, Any]:
    """Return the contract's `grasps` and `timeline` of a scene, through the nodes' own steps."""
    estimator.reset()
    detector = GraspDetector(estimator.database)
    grasps: list[dict[str, Any]] = []
    timeline: list[dict[str, Any]] = []
    for state in scene.states(estimator.database):
        grasp = detector.step(state)
        if grasp is not None:
            posterior = estimator.step(grasp)
            assert posterior is not None
            grasps.append({
                **_said(posterior), "unknown_score": posterior.unknown_score,
                "features": _cells(grasp.features),
            })  # fmt: skip
            timeline.append(_said(posterior))
            continue
        posterior = estimator.step(state)
        if posterior is not None:
            timeline.append(_said(posterior))
    error = float(np.nanmedian(scene.hand_error))
    return {"grasps": grasps, "timeline": timeline, "hand_error_mm": 1e3 * error}


def _said(posterior: TaskPosterior) -> dict[str, Any]:
    return {
        "stamp": posterior.stamp * 1e-9,
        "stage": posterior.stage,
        "affords": dict(zip(posterior.tasks, posterior.probability.tolist(), strict=True)),
        "intends": dict(zip(posterior.meanings, posterior.intends.tolist(), strict=True)),
    }


def _cells(features: GraspFeatures) -> dict[str, Any]:
    values = {field.name: getattr(features, field.name) for field in fields(features)}
    return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in values.items()}
