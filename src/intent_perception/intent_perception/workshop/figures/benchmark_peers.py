"""The peers of the recognition benchmark: Open3D and OpenCV's `ppf_match_3d` on its scenes."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.scene.segmentation import segment
from intent_perception.workshop.figures.benchmark_plan import (
    CLASSES,
    Plan,
    file_database,
    pose_difference,
    scenes,
)
from intent_perception.workshop.figures.peer_ppf import is_there, ppf_answer
from intent_perception.workshop.figures.real_scenes import uwa_reference
from intent_perception.workshop.figures.scoring import Claim, Score
from intent_perception.workshop.scenes.table_scenes import TabletopScene

_UWA_STEP, _TABLETOP_STEP = 0.03, 0.06  # between the points of ppf_match_3d's models [diameters]
_MODEL_POINTS = 2000
_SCENE_POINTS = 4000
_FITS = 0.0045  # distance at which a model's point fits the scene, as for Open3D [m]


def open3d_peer(plan: Plan) -> dict[str, Any]:
    """Return the figures of Open3D on the scenes of six models, at its own best threshold."""
    from intent_perception.workshop.figures.peer_open3d import Open3dPeer

    database = ObjectDatabase.load()
    models = [database[f"{name}_0"] for name in CLASSES]
    known = {model.name for model in models}
    detector = Detector(ModelLibrary.of(models), DetectorConfig())
    peer = Open3dPeer(models, detector)
    seen, claims, cpu, wall = [], [], [], []
    for _, scene in scenes(plan, models, list(ObjectDatabase.clutter())):
        start, clock = time.process_time(), time.perf_counter()
        claims.append(peer.find(detector.oriented(scene.frame)))
        cpu.append(time.process_time() - start)
        wall.append(time.perf_counter() - clock)
        seen.append(scene)

    return _at_best_threshold(seen, claims, cpu, wall, known)


def ppf_tabletop(plan: Plan) -> dict[str, Any] | None:
    """Return the figures of ppf_match_3d on a tenth of the scenes of six models: it is slow.

    Every model is claimed once in each scene, with the share of its points that meet the scene as
    confidence; the threshold is its own best one. None without its environment.
    """
    if not is_there():
        return None
    few = replace(plan, scenes=max(1, plan.scenes // 10), empty=max(1, plan.empty // 10))
    database = ObjectDatabase.load()
    models = [database[f"{name}_0"] for name in CLASSES]
    detector = Detector(ModelLibrary.of(models), DetectorConfig())
    seen = [scene for _, scene in scenes(few, models, list(ObjectDatabase.clutter()))]
    clouds = [_object_points(detector, scene) for scene in seen]
    surfaces = [
        np.hstack(model.mesh.sample_surface(_MODEL_POINTS, np.random.default_rng(0))[:2])
        for model in models
    ]
    with tempfile.TemporaryDirectory() as temporary:
        of_models = [Path(temporary) / f"model_{k}.ply" for k in range(len(models))]
        of_scenes = [Path(temporary) / f"scene_{k}.ply" for k in range(len(clouds))]
        for path, points in zip([*of_models, *of_scenes], [*surfaces, *clouds], strict=True):
            _write_ply(path, points)
        answer = ppf_answer(_TABLETOP_STEP, of_models, of_scenes)
    claims = [
        [
            _claim(model, points[:, :3], np.array(pose).reshape(4, 4), cloud[:, :3])
            for model, points, pose in zip(models, surfaces, poses, strict=True)
            if pose is not None
        ]
        for poses, cloud in zip(answer["poses"], clouds, strict=True)
    ]
    seconds = [sum(each) for each in answer["find_s"]]
    figures = _at_best_threshold(seen, claims, seconds, seconds, {m.name for m in models})
    return {**figures, "train_s": sum(answer["train_s"])}


def ppf_uwa(plan: Plan) -> dict[str, Any] | None:
    """Return what ppf_match_3d reaches on the laser scan, None without its environment or data."""
    folder = plan.data / "recognizer" / "uwa_opencv"
    if not folder.is_dir() or not is_there():
        return None
    model, scene = folder / "parasaurolophus_6700.ply", folder / "rs1_normals.ply"
    answer = ppf_answer(_UWA_STEP, [model], [scene])
    pose = answer["poses"][0][0]
    seconds = {"train_s": answer["train_s"][0], "find_s": answer["find_s"][0][0]}
    if pose is None:
        return {"translation_mm": None, "rotation_deg": None, **seconds}
    database = file_database(folder, {"parasaurolophus": model.name}, "mm")
    T_found = np.array(pose).reshape(4, 4)
    T_found[:3, 3] /= 1000.0
    shift, turn = pose_difference(uwa_reference(folder), T_found, database.models[0].center)
    return {
        "translation_mm": 1000.0 * shift,
        "rotation_deg": float(np.degrees(turn)),
        **seconds,
    }


def _at_best_threshold(
    seen: Sequence[TabletopScene],
    claims: Sequence[Sequence[Claim]],
    cpu: list[float],
    wall: list[float],
    known: set[str],
) -> dict[str, Any]:
    """Return the figures at the threshold of confidence that balances recall and precision best."""

    def scored(threshold: float) -> Score:
        score = Score(cpu=cpu, wall=wall)
        for scene, mine in zip(seen, claims, strict=True):
            score.add(scene, [c for c in mine if c.confidence >= threshold], known)
        return score

    def balance(score: Score) -> float:
        right = sum(j.right for j in score.judged)
        return 2.0 * right / max(1, len(score.judged) + len(score.seen))

    return max((scored(t) for t in np.linspace(0.1, 0.9, 17)), key=balance).figures()


def _claim(model: ObjectModel, points: Array, T_scene_model: Array, cloud: Array) -> Claim:
    few = transform_points(T_scene_model, points)
    fits = cKDTree(cloud).query(few)[0] < _FITS
    return Claim(model, T_scene_model, float(np.mean(fits)))


def _object_points(detector: Detector, scene: TabletopScene) -> Array:
    """Return points and normals (N, 6) above the table, the same that all methods search."""
    image = detector.oriented(scene.frame)
    chosen = segment(image, detector.table(image)).mask == 1
    points = np.hstack([image.points()[chosen], image.normals[chosen]]).astype(np.float64)
    return points[:: len(points) // _SCENE_POINTS + 1]


def _write_ply(path: Path, points: Array) -> None:
    names = ("x", "y", "z", "nx", "ny", "nz")
    head = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(points)}",
        *(f"property float {name}" for name in names),
        "end_header",
    ]
    np.savetxt(path, points, "%.6f", header="\n".join(head), comments="")
