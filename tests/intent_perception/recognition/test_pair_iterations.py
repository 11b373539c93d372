"""The number of iterations follows from the success probability asked for, and keeps it."""

import numpy as np
import pytest

from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.candidates import PoseJudge
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.proposal.pair_hypotheses import pair_iterations
from intent_perception.recognition.proposal.pose_draws import Draws, drawn_poses
from intent_perception.scene.scene_view import SceneView
from intent_perception.scene.segmentation import segment
from intent_perception.workshop.figures.matching import FOUND, pose_error, surface_points
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

NAMES = ("bottle_0", "glass_0", "mug_0", "knife_0", "hammer_0", "screwdriver_0")


def test_more_success_or_less_visibility_asks_for_more_iterations() -> None:
    assert pair_iterations(0.99, 0.25) > pair_iterations(0.9, 0.25)
    assert pair_iterations(0.99, 0.1) > pair_iterations(0.99, 0.25)


def test_iterations_follow_the_geometric_law() -> None:
    once = pair_iterations(0.9, 0.5)
    assert pair_iterations(0.99, 0.5) == pytest.approx(2 * once, abs=2)


def test_impossible_probabilities_are_refused() -> None:
    with pytest.raises(ValueError, match="success"):
        DetectorConfig(success=1.0)


@pytest.mark.slow
def test_99_percent_asked_finds_97_percent_at_the_assumed_visibility() -> None:
    database = ObjectDatabase.load()
    library = ModelLibrary.of(database.select(list(NAMES)))
    config = DetectorConfig(hash_only=True, success=0.99, assumed_share=1.0)
    detector = Detector(library, config)
    found = []
    for number, name in enumerate(NAMES):
        model, points = database[name], surface_points(database[name])
        for seed in (910, 911):
            scene = tabletop_scene([model], np.random.default_rng(seed))
            image = detector.oriented(scene.frame)
            view = SceneView.of(image, segment(image, detector.table(image)))
            pixels = int(view.parts.mask.sum())
            draws = Draws.of(config, len(library), pixels, pixels)
            for run in range(6):
                slots, _ = drawn_poses(view, library, config, draws, np.random.default_rng(run))
                drafter = PoseJudge(library, view, config.tolerance)
                models, poses = drafter.aligned(*slots.best(config.refined_per_model))
                errors = [
                    pose_error(
                        model, points, library.object_pose(number, pose),
                        scene.objects[0].T_camera_object,
                    ).distance
                    for pose in poses[models == number][:6]
                ]  # fmt: skip
                found.append(min(errors, default=1.0) < FOUND * model.diameter)
    assert np.mean(found) >= 0.97
