"""Where the table goes in the tree of frames, and the vertical of an IMU."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Vector3
from rclpy.node import Node
from sensor_msgs.msg import Imu
from tests.support.harness import CAMERA_FRAME, SECOND, Graph, Probe, ros_arguments
from tf2_msgs.msg import TFMessage

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import inverse, make_pose, rotation_from_vector
from intent_perception.objects.database import ObjectDatabase
from intent_perception.ros.camera_frames import CameraFrames, FramesConfig
from intent_perception.ros.convert import header_at, pose_from_msg, transforms_to_msg
from intent_perception.ros.node import LATCHED
from intent_perception.workshop.scenes.table_scenes import tabletop_scene

STAMP = 1_000 * SECOND
T_TABLE_CAMERA = make_pose(rotation_from_vector(np.array([2.2, 0.1, 0.0])), [0.1, -0.6, 0.5])
T_BASE_CAMERA = make_pose(rotation_from_vector(np.array([0.3, -1.1, 0.4])), [0.2, 0.1, 1.1])
Started = Callable[..., CameraFrames]


@pytest.fixture
def started(probe: Probe) -> Started:
    """Starts frames of a configuration, with drivers that say a tree and what an IMU feels."""

    def start(
        config: FramesConfig,
        tree: dict[tuple[str, str], Array],
        imu: tuple[str, list[float]] | None = None,
    ) -> CameraFrames:
        node = Node("camera_frames")
        probe.run_with(node)
        frames = CameraFrames(node, config)
        say_tree(probe, tree)
        if imu is not None:
            publisher = probe.create_publisher(Imu, config.imu, 10)
            assert probe.until(lambda: publisher.get_subscription_count() > 0)
            felt = Vector3(**dict(zip("xyz", imu[1], strict=True)))
            publisher.publish(Imu(header=header_at(STAMP, imu[0]), linear_acceleration=felt))
        probe.until(lambda: False, timeout=0.5)
        return frames

    return start


def say_tree(probe: Probe, tree: dict[tuple[str, str], Array]) -> None:
    """Publish fixed transforms as a driver does, {(parent, child): pose}."""
    publisher = probe.create_publisher(TFMessage, "/tf_static", LATCHED)
    for (parent, child), pose in tree.items():
        publisher.publish(transforms_to_msg(header_at(STAMP, parent), [(child, pose)]))


def transform_in(message: Any) -> tuple[str, str, Array]:
    """Return parent, child and pose of the only transform of a message."""
    (one,) = message.transforms
    shift, turn = one.transform.translation, one.transform.rotation
    pose = pose_from_msg(Pose(position=Point(x=shift.x, y=shift.y, z=shift.z), orientation=turn))
    return one.header.frame_id, one.child_frame_id, pose


def test_an_imu_of_the_optical_frame_tells_the_vertical(started: Started) -> None:
    frames = started(FramesConfig(imu="/imu"), {}, ("imu_optical_frame", [0.0, -9.81, 0.0]))
    np.testing.assert_allclose(frames.up(CAMERA_FRAME), [0.0, -1.0, 0.0], atol=1e-9)


def test_an_imu_that_is_mounted_otherwise_is_turned_into_the_camera(started: Started) -> None:
    turn = make_pose(rotation_from_vector(np.array([0.0, 0.0, np.pi / 2])), np.zeros(3))
    tree = {("camera_link", CAMERA_FRAME): turn, ("camera_link", "imu_link"): np.eye(4)}
    frames = started(FramesConfig(imu="/imu"), tree, ("imu_link", [9.81, 0.0, 0.0]))
    np.testing.assert_allclose(frames.up(CAMERA_FRAME), [0.0, -1.0, 0.0], atol=1e-9)


def test_an_imu_in_motion_tells_nothing(started: Started) -> None:
    frames = started(FramesConfig(imu="/imu"), {}, ("imu_optical_frame", [14.0, 0.0, 0.0]))
    assert frames.up(CAMERA_FRAME) is None


def test_an_imu_that_nothing_connects_is_left_aside_with_one_warning(
    started: Started, probe: Probe
) -> None:
    frames = started(FramesConfig(imu="/imu"), {}, ("imu_link", [0.0, 0.0, 9.81]))
    assert [frames.up(CAMERA_FRAME) for _ in range(3)] == [None] * 3
    assert probe.until(lambda: bool(probe.warnings))
    (warning,) = probe.warnings
    assert f"does not connect imu_link with {CAMERA_FRAME}" in warning


@pytest.mark.parametrize(
    ("parent", "tree", "expected"),
    [
        ("", {}, ("table", CAMERA_FRAME, T_TABLE_CAMERA)),
        (
            "",
            {("camera_link", CAMERA_FRAME): np.eye(4)},
            (CAMERA_FRAME, "table", inverse(T_TABLE_CAMERA)),
        ),
        (
            "base",
            {("base", CAMERA_FRAME): T_BASE_CAMERA},
            ("base", "table", T_BASE_CAMERA @ inverse(T_TABLE_CAMERA)),
        ),
    ],
    ids=["no tree", "a driver's tree", "a robot's base"],
)
def test_the_table_takes_its_place_without_a_second_parent(
    started: Started,
    parent: str,
    tree: dict[tuple[str, str], Array],
    expected: tuple[str, str, Array],
) -> None:
    frames = started(FramesConfig(table_parent=parent), tree)
    above, below, pose = transform_in(frames.message(STAMP, CAMERA_FRAME, T_TABLE_CAMERA))
    assert (above, below) == expected[:2]
    np.testing.assert_allclose(pose, expected[2], atol=1e-6)


def test_a_parent_that_is_not_connected_gives_no_transform_but_a_warning(
    started: Started, probe: Probe
) -> None:
    frames = started(FramesConfig(table_parent="base"), {})
    assert [frames.message(STAMP, CAMERA_FRAME, T_TABLE_CAMERA) for _ in range(3)] == [None] * 3
    assert probe.until(lambda: bool(probe.warnings))
    (warning,) = probe.warnings
    assert f"does not connect base with {CAMERA_FRAME}" in warning


def test_the_node_hangs_the_table_it_finds_into_the_robots_tree(graph: Graph, probe: Probe) -> None:
    say_tree(probe, {("base", CAMERA_FRAME): T_BASE_CAMERA})
    probe.listen(TFMessage, "/tf_static")
    graph.start("intent_perception", "recognizer", *ros_arguments("table_parent:=base"))
    assert probe.until(probe.connected, timeout=120.0)
    scene = tabletop_scene([ObjectDatabase.load()["bottle_2"]], np.random.default_rng(0))

    def placed() -> list[Any]:
        messages = probe.heard["/tf_static"]
        return [m for m in messages if m.transforms[0].child_frame_id == "table"]

    for number in range(40):  # until the node has heard of the tree
        probe.send(replace(scene.frame, stamp=STAMP + number * SECOND))
        if probe.until(lambda: bool(placed()), timeout=3.0):
            break
    parent, _, pose = transform_in(placed()[0])
    assert parent == "base"
    up = (T_BASE_CAMERA @ inverse(scene.T_table_camera))[:3, 2]
    np.testing.assert_allclose(pose[:3, 2], up, atol=0.01)
