"""Command: the figures of recognition as JSON (keys in CONTRACT.md).

python -m intent_perception.benchmark [--part NAME] [--seed S] [--scenes N] [--quick]
    [--json FILE|-] [--pictures FOLDER]
"""

import argparse
import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from intent_perception.basics.late_module import need
from intent_perception.basics.progress import counted
from intent_perception.basics.safe_files import output_file, write_text
from intent_perception.geometry.cloud import read_cloud, view_cloud
from intent_perception.geometry.coded_images import write_picture
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.overlay import overlay
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.recognizer import RecognizerConfig
from intent_perception.workshop.figures.benchmark_peers import open3d_peer, ppf_tabletop, ppf_uwa
from intent_perception.workshop.figures.benchmark_plan import (
    CLASSES,
    Plan,
    file_database,
    pose_difference,
    scenes,
)
from intent_perception.workshop.figures.benchmark_unseen import real_tabletop, unseen_instances
from intent_perception.workshop.figures.machine import machine
from intent_perception.workshop.figures.real_scenes import (
    COUNTED,
    OTHERS,
    match_box,
    uwa_reference,
    ycb_frame,
)
from intent_perception.workshop.figures.scoring import LEAST_PIXELS, Claim, Score, judge
from intent_perception.workshop.figures.table_figures import VIEWS, tables
from intent_perception.workshop.figures.worst_frame import worst_frame
from intent_perception.workshop.scenes.table_scenes import TabletopScene

_GREEN, _RED, _ORANGE = (60, 220, 60), (255, 60, 60), (255, 170, 0)
_LEAST = RecognizerConfig().least_confidence


def parametric(plan: Plan, variants: int, hash_only: bool = False) -> dict[str, Any]:
    """Return the figures with so many variants of each class in the library."""
    database = ObjectDatabase.load()
    models = [database[f"{name}_{k}"] for k in range(variants) for name in CLASSES]
    detector = Detector(ModelLibrary.of(models), replace(DetectorConfig(), hash_only=hash_only))
    known = {model.name for model in models}
    score = Score()
    part = f"{'hash_' if hash_only else ''}{len(models)}"
    for seed, scene in scenes(plan, models, list(ObjectDatabase.clutter())):
        if seed == plan.seed:
            detector.find(scene.frame)  # compiles
        cpu, wall = time.process_time(), time.perf_counter()
        findings = detector.find(scene.frame)
        score.cpu.append(time.process_time() - cpu)
        score.wall.append(time.perf_counter() - wall)
        claims = [
            Claim(detector.library.models[d.model], d.T_camera_object, d.confidence)
            for d in findings.detections
            if d.confidence >= _LEAST
        ]
        score.add(scene, claims, known)
        if plan.pictures is not None:
            _draw(plan.pictures / f"{part}_{seed}.png", scene, claims, known)
    return score.figures()


def uwa_rs1(plan: Plan) -> dict[str, Any] | None:
    """Return how often the parasaurolophus is found in the laser scan within 5 mm and 3 degrees."""
    folder = plan.data / "recognizer" / "uwa_opencv"
    if not folder.is_dir():
        return None
    database = file_database(folder, {"parasaurolophus": "parasaurolophus_6700.ply"}, "mm")
    library = ModelLibrary.of(database)
    reference, center = uwa_reference(folder), database.models[0].center
    view = view_cloud(*read_cloud(folder / "rs1_normals.ply", "mm"))
    found, cpu = 0, []
    for seed in range(plan.seed, plan.seed + plan.scans):
        detector = Detector(library, replace(DetectorConfig.for_clouds(), seed=seed))
        start = time.process_time()
        findings = detector.find(view.frame)
        cpu.append(time.process_time() - start)
        for detection in findings.detections:
            if detection.confidence < _LEAST:
                continue
            T_found = view.T_cloud_camera @ detection.T_camera_object
            shift, turn = pose_difference(reference, T_found, center)
            if shift <= 0.005 and turn <= np.radians(3.0):
                found += 1
                break
    return {"found": found, "seeds": plan.scans, "cpu_s_median": float(np.median(cpu))}


def ycb_frames(plan: Plan) -> dict[str, Any] | None:
    """Return recall, false objects and depth residual on the five real frames, 21 models."""
    folder = plan.data / "recognizer" / "ycbv_posecnn_demo"
    meshes = plan.data / "meshes" / "ycb_bop"
    if not folder.is_dir() or not meshes.is_dir():
        return None
    database = file_database(meshes, {p.stem: p.name for p in sorted(meshes.glob("*.ply"))}, "m")
    detector = Detector(ModelLibrary.of(database), DetectorConfig())
    hits, false, residuals, cpu, missed = 0, 0, [], [], []
    for number in COUNTED:
        frame = ycb_frame(folder, number)
        start = time.process_time()
        findings = detector.find(frame)
        cpu.append(time.process_time() - start)
        boxes, open_names = {**COUNTED[number], **OTHERS[number]}, set(COUNTED[number])
        models, poses, texts, paints = [], [], [], []
        for detection in findings.detections:
            if detection.confidence < _LEAST:
                continue
            model = detector.library.models[detection.model]
            box = boxes.pop(model.name, None)
            match = box and match_box(frame, model, detection.T_camera_object, box)
            right = match is not None and match.right
            if match is not None and right and model.name in open_names:
                hits += 1
                open_names.discard(model.name)
                residuals.append(1000.0 * match.residual)
            false += not right
            models.append(model)
            poses.append(detection.T_camera_object)
            texts.append(f"{model.name} {detection.confidence:.2f}")
            paints.append(_GREEN if right else _RED)
        missed += [f"{number}:{name}" for name in sorted(open_names)]
        if plan.pictures is not None:
            image = overlay(frame.color, frame.camera, models, poses, texts, paints)
            write_picture(plan.pictures / f"ycb_{number}.png", image)
    return {
        "recall": hits / sum(len(boxes) for boxes in COUNTED.values()),
        "false_per_frame": false / len(COUNTED),
        "residual_mm_median": float(np.median(residuals)) if residuals else None,
        "cpu_s_median": float(np.median(cpu)),
        "missed": missed,
    }


def _draw(path: Path, scene: TabletopScene, claims: Sequence[Claim], known: set[str]) -> None:
    """Write a scene with right claims in green, wrong ones in red, missed objects in orange."""
    judged, found = judge(scene.objects, claims)
    ordered = sorted(claims, key=lambda c: -c.confidence)
    missed = [
        item
        for item in scene.objects
        if item.model.name in known
        and item.pixels >= LEAST_PIXELS
        and found.get(id(item)) != "model"
    ]
    models = [item.model for item in missed] + [c.model for c in ordered]
    poses = [item.T_camera_object for item in missed] + [c.T_camera_object for c in ordered]
    texts = [f"missed {item.model.name}, {item.visibility:.0%} seen" for item in missed] + [
        f"{'' if j.right else 'false '}{c.model.name} {c.confidence:.2f}"
        for c, j in zip(ordered, judged, strict=True)
    ]
    paints = [_ORANGE] * len(missed) + [_GREEN if j.right else _RED for j in judged]
    image = overlay(scene.frame.color, scene.frame.camera, models, poses, texts, paints)
    write_picture(path, image)


PARTS: dict[str, Callable[[Plan], Any]] = {
    "parametric_6": lambda plan: parametric(plan, 1),
    "hash_only": lambda plan: parametric(plan, 1, hash_only=True),
    "parametric_12": lambda plan: parametric(plan, 2),
    "parametric_48": lambda plan: parametric(plan, 8),
    "uwa_rs1": uwa_rs1,
    "ycb_frames": ycb_frames,
    "real_tabletop": real_tabletop,
    "unseen_instances": unseen_instances,
    "tables": lambda plan: tables(plan, max(5, VIEWS * plan.scans // 20)),
    "worst_frame_cpu_s": lambda plan: worst_frame(plan, max(2, plan.scans)),
    "peers": lambda plan: {
        "open3d": open3d_peer(plan) if find_spec("open3d") else None,
        "ppf_match_3d": {"parametric_6": ppf_tabletop(plan), "uwa_rs1": ppf_uwa(plan)},
    },
}
"""What can be measured, by name."""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=PARTS, help="only this one")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--quick", action="store_true", help="a tenth of everything")
    parser.add_argument("--json", type=output_file, default="-")
    parser.add_argument("--pictures", type=Path)
    arguments = parser.parse_args()
    if arguments.part == "peers":
        need("open3d")
    share = 10 if arguments.quick else 1
    plan = Plan(
        seed=arguments.seed,
        scenes=max(6, arguments.scenes // share),
        empty=max(3, 20 // share),
        scans=max(2, 20 // share),
        data=Path(os.environ.get("INTENT_DATA", "../shared/data")),
        pictures=arguments.pictures,
    )
    if plan.pictures is not None:
        plan.pictures.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    report: dict[str, Any] = {
        "machine": machine(),
        "seed": plan.seed,
    }
    for name in counted("part", [arguments.part] if arguments.part else list(PARTS)):
        figures = PARTS[name](plan)
        report |= figures if name in (figures or ()) else {name: figures}
        report["seconds"] = time.perf_counter() - start
        if arguments.json != Path("-"):  # what is there, should a later part be stopped
            write_text(arguments.json, json.dumps(report, indent=1) + "\n")
    if arguments.json == Path("-"):
        print(json.dumps(report, indent=1))
