"""Things that are in no database, measured: rendered scenes of them, and ten real frames."""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from intent_perception.basics.arrays import Array, Floats
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.coded_images import write_picture
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.database import OBJECT_CLASSES, ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.overlay import overlay
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.recognizer import RecognizerConfig
from intent_perception.workshop.figures.benchmark_plan import Plan
from intent_perception.workshop.figures.scoring import LEAST_PIXELS, expected_calibration_error
from intent_perception.workshop.scenes.table_scenes import PlacedObject, TabletopScene
from intent_perception.workshop.scenes.unseen_scenes import unseen_scene

_LEAST = RecognizerConfig().least_confidence
_VISIBLE = 0.7
_HANDLE_PIXELS, _HANDLE_SHARE = 25, 0.2  # a handle of which less is seen is hidden
_SAME_SURFACE = 0.008
_TOOLS = ("knife", "hammer", "screwdriver")
_GREEN, _RED = (60, 220, 60), (255, 60, 60)


@dataclass(frozen=True, eq=False)
class Report:
    """One thing as the recogniser reports it."""

    model: ObjectModel
    """What it is said to look like."""
    T_camera_object: Array
    """(4, 4)."""
    confidence: float
    """That the class is right."""
    known: bool
    """Whether it is taken for an object of the database."""


def reports_of(detector: Detector, frame: RgbdFrame) -> tuple[list[Report], float]:
    """Return everything that is reported of a frame, and the CPU time it took [s]."""
    start = time.process_time()
    findings = detector.find(frame)
    seconds = time.process_time() - start
    reports = [
        Report(detector.library.models[d.model], d.T_camera_object, d.confidence, True)
        for d in findings.detections
        if d.confidence >= _LEAST
    ]
    table = findings.segmentation.table
    if table is not None:
        T_camera_table = inverse(table.T_table_camera())
        reports += [
            Report(s.model, T_camera_table @ s.T_table_object, s.confidence, False)
            for s in findings.shapes
        ]
    return reports, seconds


def _shipped_detector() -> Detector:
    return Detector(ModelLibrary.of(ObjectDatabase.load()), DetectorConfig())


@dataclass
class _Tally:
    """What is counted over scenes; grows."""

    six: list[bool] = field(default_factory=list)
    """Of each thing of a class: whether that is said."""
    none: list[bool] = field(default_factory=list)
    """Of each other thing: whether a class is said."""
    reported: list[bool] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)
    shifts: list[float] = field(default_factory=list)
    turns: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    sure: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)
    by_class: dict[str, list[int]] = field(default_factory=dict)
    """Right and all of each class."""


def unseen_instances(plan: Plan) -> dict[str, Any] | None:
    """Return the figures on rendered scenes of things that nobody modelled."""
    meshes = plan.data / "meshes"
    if not meshes.is_dir():
        return None
    detector, tally = _shipped_detector(), _Tally()
    detector.find(unseen_scene(plan.seed, meshes).frame)  # compiles
    count = max(12, plan.scenes * 200 // 60)
    for seed in range(plan.seed, plan.seed + count):
        scene = unseen_scene(seed, meshes)
        reports, seconds = reports_of(detector, scene.frame)
        tally.cpu.append(seconds)
        _count(scene, reports, tally)
        if plan.pictures is not None:
            _draw(plan.pictures / f"unseen_{seed}.png", scene.frame, reports)
    return {
        "scenes": count,
        "class_right": float(np.mean(tally.six)),
        "false_class": float(np.mean(tally.none)),
        "reported": float(np.mean(tally.reported)),
        "size_error_median": float(np.median(tally.sizes)),
        "translation_mm_median": 1000.0 * float(np.median(tally.shifts)),
        "rotation_deg_median": float(np.degrees(np.median(tally.turns))),
        "cpu_s_median": float(np.median(tally.cpu)),
        "cpu_s_max": float(np.max(tally.cpu)),
        "ece": expected_calibration_error(tally.sure, tally.right),
        "by_class": {name: f"{a} of {b}" for name, (a, b) in sorted(tally.by_class.items())},
    }


def _count(scene: TabletopScene, reports: list[Report], tally: _Tally) -> None:
    owners = [_owner(scene, report) for report in reports]
    for number, truth in enumerate(scene.objects):
        if truth.visibility < _VISIBLE or truth.pixels < LEAST_PIXELS:
            continue
        own = [r for r, owner in zip(reports, owners, strict=True) if owner == number]
        report = max(own, key=lambda r: r.confidence, default=None)
        said = report.model.object_class if report is not None else ""
        named = said if said in OBJECT_CLASSES else ""
        wanted = truth.model.object_class
        tally.reported.append(report is not None)
        right = named == wanted
        if wanted == "mug" and named == "glass" and _handle_hidden(scene, number, truth):
            right = True
        if wanted:
            tally.six.append(right)
        else:
            tally.none.append(bool(named))
        counted = tally.by_class.setdefault(wanted or "none", [0, 0])
        counted[0] += right
        counted[1] += 1
        if report is not None:
            tally.sure.append(report.confidence)
            tally.right.append(right)
            if wanted and right:
                _measure(truth, report, tally)


def _owner(scene: TabletopScene, report: Report) -> int:
    """Return the number of the object that a report covers most of, -1 = none."""
    drawn = render(scene.frame.camera, [report.model.mesh], report.T_camera_object[None]).label == 0
    own = scene.owner[drawn]
    own = own[own >= 0]
    return int(np.bincount(own).argmax()) if len(own) else -1


def _handle_hidden(scene: TabletopScene, number: int, truth: PlacedObject) -> bool:
    """Return whether too little of a mug's handle is seen to tell it from a glass."""
    parts = [part.mesh for part in truth.model.annotated_parts or () if part.name == "handle"]
    if not parts:
        return False  # of others' meshes nobody says which part is the handle
    poses = np.repeat(truth.T_camera_object[None], len(parts), axis=0)
    depth = render(scene.frame.camera, parts, poses).depth
    seen = (depth > 0.0) & (np.abs(scene.frame.depth - depth) < _SAME_SURFACE)
    pixels = int((seen & (scene.owner == number)).sum())
    return pixels < max(_HANDLE_PIXELS, _HANDLE_SHARE * int((depth > 0.0).sum()))


def _measure(truth: PlacedObject, report: Report, tally: _Tally) -> None:
    true, found = truth.model.size, report.model.size
    sizes = [np.array([size[2], *np.sort(size[:2])]) for size in (true, found)]
    tally.sizes.append(float(np.mean(np.abs(sizes[1] - sizes[0]) / sizes[0])))
    centers = [
        T[:3, :3] @ model.center + T[:3, 3]
        for T, model in (
            (truth.T_camera_object, truth.model),
            (report.T_camera_object, report.model),
        )
    ]
    tally.shifts.append(float(np.linalg.norm(centers[1] - centers[0])))
    cosine = float(truth.T_camera_object[:3, 2] @ report.T_camera_object[:3, 2])
    if truth.model.object_class in _TOOLS and not truth.model.annotated_parts:
        cosine = abs(cosine)  # of others' meshes nobody says which end is the handle
    tally.turns.append(float(np.arccos(np.clip(cosine, -1.0, 1.0))))


REAL: dict[str, tuple[str, float | None]] = {
    "blue_mug": ("mug", 0.0),
    "red_mug": ("mug", 180.0),
    "mustard": ("bottle", None),
    "cylinder": ("", None),
    "pepper": ("", None),
    "sugar": ("", None),
    "cheezit": ("", None),
    "green_bowl": ("", None),
    "white_bowl": ("", None),
    "white_mug": ("", None),  # a bowl in truth
}
"""Class and, by eye, the direction of the handle in the image [deg, 0 = right, 90 = up]."""


def real_frame(folder: Path, name: str) -> RgbdFrame:
    """Return one of the real frames of the folder `recognizer/nv_realsense`."""
    color = cv2.imread(str(folder / f"{name}_color.png"), cv2.IMREAD_COLOR)
    depth = cv2.imread(str(folder / f"{name}_depth.png"), cv2.IMREAD_UNCHANGED)
    if color is None or depth is None:
        raise ValueError(f"expected the frame {name} in {folder}")
    entry = json.loads((folder / f"{name}_camera.json").read_text())
    (fx, _, cx), (_, fy, cy), _ = entry["K"]
    camera = Camera(entry["width"], entry["height"], fx, fy, cx, cy)
    metres = (depth.astype(np.float64) * entry["depth_unit_m"]).astype(np.float32)
    return RgbdFrame(0, np.ascontiguousarray(color[..., ::-1]), metres, camera)


def real_tabletop(plan: Plan) -> dict[str, Any] | None:
    """Return the figures on ten real frames, each with one thing on a bare table."""
    folder = plan.data / "recognizer" / "nv_realsense"
    if not folder.is_dir():
        return None
    detector = _shipped_detector()
    detector.find(real_frame(folder, "blue_mug"))  # compiles
    said: dict[str, str] = {}
    cpu, residuals, handles, more = [], [], [], 0
    for name, frame in _real_frames(folder):
        reports, seconds = reports_of(detector, frame)
        cpu.append(seconds)
        more += max(0, len(reports) - 1)
        if plan.pictures is not None:
            _draw(plan.pictures / f"real_{name}.png", frame, reports)
        if not reports:
            continue
        best = max(reports, key=lambda r: _drawn_pixels(frame, r))
        said[name] = best.model.object_class
        residuals.append(_residual(frame, best))
        wanted, direction = REAL[name]
        if direction is not None and said[name] == wanted:
            gap = np.radians(_handle_direction(frame.camera, best) - direction)
            handles.append(float(np.degrees(np.abs(np.arctan2(np.sin(gap), np.cos(gap))))))
    classes = {name: kind for name, (kind, _) in REAL.items()}
    return {
        "frames": len(REAL),
        "mugs_right": sum(said.get(n) == "mug" for n, kind in classes.items() if kind == "mug"),
        "bottle_right": int(said.get("mustard") == "bottle"),
        "false_class": sum(
            said.get(n, "") in OBJECT_CLASSES for n, kind in classes.items() if not kind
        ),
        "reported": len(said),
        "reported_more_than_once": more,
        "residual_mm_median": 1000.0 * float(np.median(residuals)) if residuals else None,
        "handle_deg_max": max(handles) if handles else None,
        "cpu_s_median": float(np.median(cpu)),
        "cpu_s_max": float(np.max(cpu)),
        "said": said,
    }


def _real_frames(folder: Path) -> Iterator[tuple[str, RgbdFrame]]:
    for name in REAL:
        yield name, real_frame(folder, name)


def _drawn_pixels(frame: RgbdFrame, report: Report) -> int:
    return int((_depth(frame, report) > 0.0).sum())


def _depth(frame: RgbdFrame, report: Report) -> Floats:
    return render(frame.camera, [report.model.mesh], report.T_camera_object[None]).depth


def _residual(frame: RgbdFrame, report: Report) -> float:
    """Return the median distance of measured depth from the drawn surface, where both are [m]."""
    depth = _depth(frame, report)
    gap = np.abs(frame.depth - depth)[(depth > 0.0) & (frame.depth > 0.0)]
    gap = gap[gap < 0.05]  # what is further away is behind it
    return float(np.median(gap)) if len(gap) else float("inf")


def _handle_direction(camera: Camera, report: Report) -> float:
    """Return where a mug's handle points in the image [deg, 0 = right, 90 = up]."""
    model = report.model
    center = model.center
    named = [part.mesh for part in model.annotated_parts or () if part.name == "handle"]
    handle = np.mean([mesh.vertices.mean(axis=0) for mesh in named], axis=0)
    pixels = []
    for point in (center, np.array([handle[0], handle[1], center[2]])):
        x, y, z = report.T_camera_object[:3, :3] @ point + report.T_camera_object[:3, 3]
        pixels.append(np.array([camera.fx * x / z, camera.fy * y / z]))
    across, down = pixels[1] - pixels[0]
    return float(np.degrees(np.arctan2(-down, across)))


def _draw(path: Path, frame: RgbdFrame, reports: list[Report]) -> None:
    """Write a frame with everything reported: classes in green, things of none in red."""
    texts = [f"{r.model.object_class or 'unknown'} {r.confidence:.2f}" for r in reports]
    paints = [_GREEN if r.model.object_class in OBJECT_CLASSES else _RED for r in reports]
    models, poses = [r.model for r in reports], [r.T_camera_object for r in reports]
    write_picture(path, overlay(frame.color, frame.camera, models, poses, texts, paints))
