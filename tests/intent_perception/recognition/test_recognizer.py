"""Recognition in rendered scenes: right poses, silence where nothing is known, steady answers."""

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import (
    inverse,
    look_at,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.detection import Detector
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.proposal.model_library import ModelLibrary
from intent_perception.recognition.recognizer import Recognizer, RecognizerConfig
from intent_perception.workshop.figures.matching import FOUND, pose_error, surface_points
from intent_perception.workshop.figures.scoring import Claim, expected_calibration_error, judge
from intent_perception.workshop.scenes.sensor_noise import observe
from intent_perception.workshop.scenes.table_scenes import TabletopScene, tabletop_scene

DATABASE = ObjectDatabase.load()
NAMES = ("bottle_0", "mug_0", "hammer_0")


@pytest.fixture(scope="module")
def models() -> ObjectDatabase:
    return DATABASE.select(list(NAMES))


@pytest.fixture(scope="module")
def detector(models: ObjectDatabase) -> Detector:
    return Detector(ModelLibrary.of(models), DetectorConfig())


def scene_of(names: tuple[str, ...], seed: int) -> TabletopScene:
    rng = np.random.default_rng(seed)
    return tabletop_scene([DATABASE[name] for name in names], rng, standing=1.0)


def claims(detector: Detector, frame: RgbdFrame) -> list[Claim]:
    return [
        Claim(detector.library.models[d.model], d.T_camera_object, d.confidence)
        for d in detector.find(frame).detections
        if d.confidence >= RecognizerConfig().least_confidence
    ]


def test_every_object_is_found_at_its_pose(detector: Detector) -> None:
    scene = scene_of(NAMES, 15)
    judged, found = judge(scene.objects, claims(detector, scene.frame))
    assert sorted(found.values()) == ["model"] * 3
    assert all(j.right for j in judged)
    assert all(j.error is not None and j.error.translation < 0.005 for j in judged)


def test_a_pose_found_moves_with_the_scene(models: ObjectDatabase) -> None:
    pairs = Detector(ModelLibrary.of(models), DetectorConfig(hash_only=True))
    mug, rng = DATABASE["mug_0"], np.random.default_rng(31)
    errors = []
    for _ in range(8):
        # about the optical axis and across it: the camera sees the same side of the mug
        turn = rotation_from_vector(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)]))
        motion = make_pose(turn, rng.uniform(-0.04, 0.04, 3))
        pose = motion @ make_pose(rotation_from_vector(np.array([2.0, 0.4, 0.3])), [0.0, 0.0, 0.7])
        found = [c for c in claims(pairs, seen("mug_0", pose)) if c.model is mug]
        gaps = [pose_error(mug, surface_points(mug), c.T_camera_object, pose) for c in found]
        errors.append(min((gap.distance for gap in gaps), default=1.0) / mug.diameter)
    assert np.median(errors) < 0.2 * FOUND
    assert np.sum(np.array(errors) < FOUND) >= 7


def test_an_object_in_the_air_is_found_without_a_table(detector: Detector) -> None:
    pose = make_pose(rotation_from_vector(np.array([0.3, 1.9, 0.4])), [0.02, -0.03, 0.7])
    best = claims(detector, seen("hammer_0", pose))[0]
    hammer = DATABASE["hammer_0"]
    assert best.model is hammer
    error = pose_error(hammer, surface_points(hammer), best.T_camera_object, pose)
    assert error.distance < FOUND * hammer.diameter


def test_an_object_partly_outside_the_image_is_found(detector: Detector) -> None:
    pose = make_pose(rotation_from_vector(np.array([2.0, 0.3, 0.2])), [0.4, 0.0, 0.7])
    bottle = DATABASE["bottle_0"]
    columns = KINECT.project(transform_points(pose, surface_points(bottle)))[:, 0]
    assert 0.15 < np.mean(columns > KINECT.width) < 0.5
    best = claims(detector, seen("bottle_0", pose))[0]
    error = pose_error(bottle, surface_points(bottle), best.T_camera_object, pose)
    assert error.distance < FOUND * bottle.diameter


def test_the_same_frame_gives_the_same_answer(detector: Detector) -> None:
    scene = scene_of(NAMES, 6)
    first, second = (claims(detector, scene.frame) for _ in range(2))
    assert len(first) == len(second) > 0
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.T_camera_object, b.T_camera_object)


def test_a_scene_of_unknown_objects_gives_an_empty_list(detector: Detector) -> None:
    clutter = ObjectDatabase.clutter()
    rng = np.random.default_rng(7)
    scene = tabletop_scene([clutter["toy_car"], clutter["book"]], rng)
    assert claims(detector, scene.frame) == []


def test_an_empty_table_gives_an_empty_list(detector: Detector) -> None:
    T_table_camera = look_at(np.array([0.0, -0.6, 0.5]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert claims(detector, flat_table(T_table_camera)) == []


def test_without_the_table_prior_pairs_alone_find_the_object(models: ObjectDatabase) -> None:
    pairs = Detector(ModelLibrary.of(models), DetectorConfig(hash_only=True))
    scene = scene_of(("mug_0", "bottle_0"), 21)
    _, found = judge(scene.objects, claims(pairs, scene.frame))
    assert list(found.values()) == ["model", "model"]


def test_an_unchanged_scene_is_answered_once(models: ObjectDatabase) -> None:
    recognizer = Recognizer(models)
    scene = scene_of(("bottle_0", "mug_0"), 9)
    answer = recognizer.step(scene.frame)
    assert answer is not None
    assert {item.model for item in answer.objects} == {"bottle_0", "mug_0"}
    assert recognizer.step(scene.frame) is None
    recognizer.reset()
    assert recognizer.step(scene.frame) is not None


def test_poses_in_the_table_frame_stand_on_it(models: ObjectDatabase) -> None:
    answer = Recognizer(models).step(scene_of(("bottle_0",), 10).frame)
    assert answer is not None
    (bottle,) = answer.objects
    height = 0.5 * DATABASE["bottle_0"].size[2]
    assert bottle.T_table_object[2, 3] == pytest.approx(height, abs=0.004)
    assert bottle.T_table_object[2, 2] == pytest.approx(1.0, abs=0.01)


def test_a_frame_without_depth_gives_an_empty_list(models: ObjectDatabase) -> None:
    blank = np.zeros((480, 640), np.float32)
    frame = RgbdFrame(3, np.zeros((480, 640, 3), np.uint8), blank, KINECT)
    answer = Recognizer(models).step(frame)
    assert answer is not None
    assert answer.objects == ()


def test_a_library_needs_a_model() -> None:
    with pytest.raises(ValueError, match="at least one model"):
        ModelLibrary.of([])


def test_calibration_error_is_zero_for_honest_confidence() -> None:
    assert expected_calibration_error([0.75] * 4, [True, True, True, False]) == pytest.approx(0.0)
    assert expected_calibration_error([1.0] * 4, [True, True, False, False]) == pytest.approx(0.5)


def test_symmetric_poses_have_no_error() -> None:
    bottle = DATABASE["bottle_1"]
    spin = make_pose(rotation_from_vector(np.array([0.0, 0.0, np.pi / 2.0])), np.zeros(3))
    pose = make_pose(rotation_from_vector(np.array([0.5, 0.2, 0.1])), np.array([0.0, 0.1, 0.8]))
    error = pose_error(bottle, surface_points(bottle), pose @ spin, pose)
    assert error.distance < 1e-4
    assert error.rotation < 1e-3


def seen(name: str, T_camera_object: Array) -> RgbdFrame:
    """Return a frame of one object in the air, with a wall beyond the reach of recognition."""
    model = DATABASE[name]
    drawn = render(KINECT, [model.mesh], T_camera_object[None], np.array([model.color]))
    assert drawn.color is not None
    rng = np.random.default_rng(5)
    behind = np.where(drawn.depth > 0.0, drawn.depth, np.float32(2.5))
    depth, color = observe(behind, drawn.color, rng)
    return RgbdFrame(0, color, depth, KINECT)


def flat_table(T_table_camera: Array) -> RgbdFrame:
    """Return a frame of nothing but the plane z = 0."""
    rays = KINECT.rays() @ T_table_camera[:3, :3].T
    depth = (-T_table_camera[2, 3] / np.minimum(rays[..., 2], -1e-3)).astype(np.float32)
    depth[depth > 3.0] = 0.0
    assert np.allclose(inverse(T_table_camera) @ T_table_camera, np.eye(4))
    return RgbdFrame(0, np.full((480, 640, 3), 120, np.uint8), depth, KINECT)
