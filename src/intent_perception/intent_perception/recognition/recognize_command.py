"""Command: the objects in one RGB-D image, known or estimated, or in one point cloud.

python -m intent_perception.recognize [--models DB]
    (--rgb P --depth P --depth-scale M --camera K.json | --cloud P.ply --unit m|mm)
    [--json FILE|-] [--picture P.png] [--hash-only] [--seed S]
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import output_file, write_json
from intent_perception.geometry.camera import RgbdFrame, clean_depth, depth_advice
from intent_perception.geometry.cloud import read_cloud, view_cloud
from intent_perception.geometry.coded_images import read_picture, write_picture
from intent_perception.geometry.lens import read_lens
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import Functions, ObjectModel
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.estimation.shape_estimator import EstimatedShape
from intent_perception.recognition.findings import Findings
from intent_perception.recognition.overlay import overlay
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.recognizer import RecognizerConfig

_PAINT = (60, 220, 60)


def read_images(rgb: Path, depth: Path, scale: float, camera: Path) -> RgbdFrame:
    """Return the frame of two image files.

    Args:
        rgb: colour image.
        depth: 16-bit depth image.
        scale: metres per unit of depth; from 1 on, units per metre.
        camera: see `read_lens`.

    Raises:
        ValueError: if a file cannot be read or they do not fit each other.
    """
    color = read_picture(rgb, cv2.IMREAD_COLOR)
    values = read_picture(depth, cv2.IMREAD_UNCHANGED)
    if values.ndim != 2:
        raise ValueError(f"expected one channel of depth in {depth}, got {values.shape}")
    metres = clean_depth(values.astype(np.float64) * (1.0 / scale if scale >= 1.0 else scale))
    typical = float(np.median(metres[metres > 0.0])) if (metres > 0.0).any() else 0.0
    if not 0.1 < typical < 20.0:
        raise ValueError(
            f"expected depth of 0.1 to 20 m, the median of {depth} is {typical:.3g} m: "
            "check --depth-scale (0.001 for millimetres)"
        )
    height, width = values.shape
    rgb_image = np.ascontiguousarray(color[..., ::-1], dtype=np.uint8)
    lens = read_lens(camera, (width, height))
    straight = lens.rectified(rgb_image, nearest=False)
    return RgbdFrame(0, straight, lens.rectified(metres, nearest=True), lens.camera)


def report(findings: Findings, detector: Detector, T_out_camera: Array) -> list[dict[str, Any]]:
    """Return the objects that are more likely right than wrong, as the contract lists them."""
    least = RecognizerConfig().least_confidence
    models = detector.library.models
    return [
        {
            "model": models[found.model].name,
            "object_class": models[found.model].object_class,
            "T_camera_object": (T_out_camera @ found.T_camera_object).ravel().tolist(),
            "confidence": found.confidence,
            "visible_fraction": found.visible_fraction,
        }
        for found in findings.detections
        if found.confidence >= least
    ] + [
        {
            "model": "",
            "object_class": found.model.object_class,
            "T_camera_object": (T_out_camera @ pose).ravel().tolist(),
            "confidence": found.confidence,
            "visible_fraction": found.likeness.visible,
            "shape": shape_entry(found.model),
        }
        for found, pose in _placed(findings)
    ]


def _placed(findings: Findings) -> list[tuple[EstimatedShape, Array]]:
    """Return the estimated shapes and their poses in the camera's frame."""
    table = findings.segmentation.table
    if table is None:
        return []
    T_camera_table = inverse(table.T_table_camera())
    return [(shape, T_camera_table @ shape.T_table_object) for shape in findings.shapes]


def shape_entry(model: ObjectModel) -> dict[str, Any]:
    """Return an estimated shape as JSON takes it: in the object's own frame, lengths in m."""
    functions = model.functions or Functions()
    opening, edge, face, tip = functions.opening, functions.edge, functions.face, functions.tip
    axis = model.symmetry.axis
    return {
        "vertices": np.round(model.mesh.vertices, 5).tolist(),
        "triangles": model.mesh.faces.tolist(),
        "closed": bool(model.mesh.is_watertight),
        "color": np.round(model.color, 3).tolist(),
        "opening": opening
        and {
            "center": opening.center.tolist(),
            "normal": opening.normal.tolist(),
            "radius": float(opening.radius),
        },
        "edge": edge
        and {
            "start": edge.start.tolist(),
            "end": edge.end.tolist(),
            "direction": edge.direction.tolist(),
        },
        "face": face and {"center": face.center.tolist(), "normal": face.normal.tolist()},
        "tip": None if tip is None else tip.tolist(),
        "handle": list(functions.handle),
        "functional": list(functions.functional),
        "symmetry_axis": None if axis is None else axis.tolist(),
        "stable_poses": [pose.ravel().tolist() for pose in model.stable_poses],
    }


def picture(frame: RgbdFrame, findings: Findings, detector: Detector, path: Path) -> None:
    """Write the frame with the reported objects drawn over it."""
    least = RecognizerConfig().least_confidence
    found = [d for d in findings.detections if d.confidence >= least]
    models = [detector.library.models[d.model] for d in found]
    texts = [f"{m.name} {d.confidence:.2f}" for m, d in zip(models, found, strict=True)]
    poses = [d.T_camera_object for d in found]
    for shape, pose in _placed(findings):
        models.append(shape.model)
        texts.append(f"{shape.model.object_class or 'unknown'} {shape.confidence:.2f}")
        poses.append(pose)
    image = overlay(frame.color, frame.camera, models, poses, texts, [_PAINT] * len(models))
    write_picture(path, image)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=Path, help="object database, default: the shipped 48")
    parser.add_argument("--rgb", type=Path)
    parser.add_argument("--depth", type=Path)
    parser.add_argument("--depth-scale", type=float, default=0.001, help="metres per unit")
    parser.add_argument(
        "--camera", type=Path, help="ROS's camera yaml, or JSON with fx, fy, cx, cy or K"
    )
    parser.add_argument("--cloud", type=Path, help="PLY with normals, instead of images")
    parser.add_argument("--unit", choices=("m", "mm"), default="m")
    parser.add_argument("--json", type=output_file, default="-")
    parser.add_argument("--picture", type=output_file)
    parser.add_argument("--hash-only", action="store_true", help="without the table prior")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    write_json(arguments.json, run(arguments))


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the answer to parsed arguments.

    Raises:
        ValueError: if an input is missing or wrong.
    """
    config = DetectorConfig() if arguments.cloud is None else DetectorConfig.for_clouds()
    config = replace(config, hash_only=arguments.hash_only, seed=arguments.seed)
    T_out_camera = np.eye(4)
    if arguments.cloud is not None:
        view = view_cloud(*read_cloud(arguments.cloud, arguments.unit))
        frame, T_out_camera = view.frame, view.T_cloud_camera
    elif None in (arguments.rgb, arguments.depth, arguments.camera):
        raise ValueError("expected --rgb, --depth and --camera, or --cloud")
    else:
        frame = read_images(arguments.rgb, arguments.depth, arguments.depth_scale, arguments.camera)
    # a scan of a user's own thing is no table with the shipped objects on it
    database = ObjectDatabase.load(arguments.models, alone=arguments.cloud is not None)
    for note in database.notes:
        print(f"recognize: {note}", file=sys.stderr)
    detector = Detector(ModelLibrary.of(database), config)
    start = time.process_time()
    findings = detector.find(frame)
    seconds = time.process_time() - start
    if findings.segmentation.table is None and arguments.cloud is None:
        advice = depth_advice(frame.depth)
        searched = "things in the air were" if findings.hypotheses else "nothing was"
        print(f"recognize: no table is seen: {searched} searched for{advice}", file=sys.stderr)
    if arguments.picture is not None:
        picture(frame, findings, detector, arguments.picture)
    return {
        "objects": report(findings, detector, T_out_camera),
        "seconds": seconds,
        "hypotheses": findings.hypotheses,
    }
