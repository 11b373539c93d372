"""Recognition on real data: a laser scan, read as a plain cloud with normals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from intent_perception.geometry.cloud import read_cloud, view_cloud
from intent_perception.geometry.transforms import inverse, rotation_angle
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.workshop.figures.real_scenes import uwa_reference


@pytest.fixture
def scans(real_data: Path) -> Path:
    return real_data / "recognizer" / "uwa_opencv"


def dinosaur(scans: Path, folder: Path, unit: str) -> ObjectDatabase:
    mesh = str(scans / "parasaurolophus_6700.ply")
    entry = {"name": "parasaurolophus", "mesh": mesh, "unit": unit, "class": "dinosaur"}
    (folder / "objects.yaml").write_text(yaml.safe_dump({"only": True, "objects": [entry]}))
    return ObjectDatabase.load(folder)


@pytest.mark.slow
def test_the_parasaurolophus_is_found_in_the_laser_scan(scans: Path, tmp_path: Path) -> None:
    database = dinosaur(scans, tmp_path, "mm")
    view = view_cloud(*read_cloud(scans / "rs1_normals.ply", "mm"))
    detector = Detector(ModelLibrary.of(database), replace(DetectorConfig.for_clouds(), seed=3))
    best = detector.find(view.frame).detections[0]
    difference = inverse(uwa_reference(scans)) @ view.T_cloud_camera @ best.T_camera_object
    center = database.models[0].center
    shift = difference[:3, :3] @ center + difference[:3, 3] - center
    assert np.linalg.norm(shift) < 0.005
    assert rotation_angle(difference[:3, :3]) < np.radians(3.0)
    assert best.confidence > 0.5


def test_a_cloud_in_the_wrong_unit_is_refused(scans: Path) -> None:
    with pytest.raises(ValueError, match="is its unit mm"):
        read_cloud(scans / "rs1_normals.ply", "m")


def test_a_model_in_the_wrong_unit_is_refused(scans: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="unit"):
        dinosaur(scans, tmp_path, "m")


def test_a_cloud_without_normals_is_refused(tmp_path: Path) -> None:
    header = "ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(
        f"property float {axis}\n" for axis in "xyz"
    )
    (tmp_path / "bare.ply").write_text(header + "end_header\n0 0 1\n")
    with pytest.raises(ValueError, match="lacks nx"):
        read_cloud(tmp_path / "bare.ply", "m")
