"""Hands built as Franka's, Robotiq's and Allegro's makers ship theirs load, move and close."""

from pathlib import Path

import numpy as np
import pytest

from intent_inference.grasping.closing import place_spheres
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.hand_description import guessed_description
from intent_inference.grasping.urdf import table_from_urdf, urdf_text
from intent_inference.grasping.urdf_shapes import mesh_boxes
from intent_perception.geometry.mesh import convex_hull
from intent_tracking.scene.joint_table import landmark_positions, link_poses, mirrored

DATA = Path(__file__).parents[2] / "data" / "robot_hands"
URDFS = {
    "franka": DATA / "franka_description" / "robots" / "hand.urdf",
    "robotiq": DATA / "robotiq_2f_85" / "robotiq.urdf",
    "allegro": DATA / "allegro_hand" / "allegro.urdf",
}
JOINTS = {"franka": 1, "robotiq": 1, "allegro": 16}
FINGERS = {"franka": 1, "robotiq": 1, "allegro": 4}
"""What one motor closes is one finger."""


def hand(name: str) -> GraspingHand:
    path = URDFS[name]
    description = guessed_description(table_from_urdf(path), path)
    return GraspingHand.from_description(name, description, path.parent)


@pytest.mark.parametrize("name", URDFS)
def test_a_hand_loads_with_its_joints_and_fingers(name: str) -> None:
    made = hand(name)
    assert len(made.table.joint_names) == JOINTS[name]
    assert len(made.chains) == FINGERS[name]
    assert len(made.arrays.sphere_radii) < 1500


@pytest.mark.parametrize("name", URDFS)
def test_closing_as_guessed_brings_the_tips_together(name: str) -> None:
    made = hand(name)
    shape = made.preshapes[0]
    step = 0.3 * shape.rates
    opened = landmark_positions(made.table, shape.open)[0] @ shape.closing
    closed = landmark_positions(made.table, shape.open + step)[0] @ shape.closing
    assert np.ptp(closed) < np.ptp(opened)


def test_both_fingers_of_a_sliding_gripper_follow_one_joint() -> None:
    table = table_from_urdf(URDFS["franka"])
    assert table.sliding_joints.tolist() == [True]
    poses = link_poses(table, np.array([[0.0], [0.03]]))
    moved = poses[1, :, :3, 3] - poses[0, :, :3, 3]
    turn = table.origins[1][:3, :3]  # of the flange
    np.testing.assert_allclose(moved[1] @ turn, -(moved[2] @ turn), atol=1e-12)
    assert np.linalg.norm(moved[1]) == pytest.approx(0.03)


def test_a_hand_begins_where_it_is_told_to() -> None:
    table = table_from_urdf(URDFS["franka"], base="panda_hand")
    assert table.link_names[0] == "panda_hand"
    np.testing.assert_allclose(table.origins[1][:3, :3], np.eye(3), atol=1e-9)


def test_multiplier_and_offset_of_a_mimic_keep_the_tips_parallel() -> None:
    table = table_from_urdf(URDFS["robotiq"])
    tips = [k for k, name in enumerate(table.link_names) if "tip" in name]
    poses = link_poses(table, np.array([[0.0], [0.4], [0.8]]))[:, tips, :3, :3]
    np.testing.assert_allclose(poses - np.eye(3), 0.0, atol=1e-9)


def test_meshes_in_millimetres_are_scaled() -> None:
    table = table_from_urdf(URDFS["robotiq"])
    palm = table.boxes.half_sizes[table.boxes.links == 0]
    np.testing.assert_allclose(palm.max(axis=0)[:2] * 2, [0.075, 0.062], atol=1e-6)


def test_tips_that_are_fixed_to_a_link_belong_to_it() -> None:
    table = table_from_urdf(URDFS["allegro"])
    assert not any("tip" in name for name in table.link_names)
    assert len(table.capsules.radii) == 4
    assert len(table.landmark_links) == 4


@pytest.mark.parametrize("name", URDFS)
def test_the_kernel_and_the_table_place_the_same_hand(name: str) -> None:
    made = hand(name)
    joints = made.table.limits.mean(axis=1)
    arrays = made.arrays
    spheres = np.empty_like(arrays.sphere_centers)
    place_spheres(
        arrays, np.eye(3, dtype=np.float32), np.zeros(3, np.float32),
        joints.astype(np.float32), spheres,
    )  # fmt: skip
    poses = link_poses(made.table, joints)[0][arrays.sphere_links]
    expected = np.einsum("sij,sj->si", poses[:, :3, :3], arrays.sphere_centers) + poses[:, :3, 3]
    np.testing.assert_allclose(spheres, expected, atol=1e-5)


@pytest.mark.parametrize("name", URDFS)
def test_a_hand_survives_the_way_to_the_physics_engine(name: str, tmp_path: Path) -> None:
    made = hand(name)
    (tmp_path / "hand.urdf").write_text(urdf_text(made.table, made.effort))
    again = table_from_urdf(tmp_path / "hand.urdf")
    assert again.slides.tolist() == made.table.slides.tolist()
    assert len(again.boxes.links) == len(made.table.boxes.links)


def test_a_mirrored_sliding_hand_slides_to_the_mirrored_place() -> None:
    table = table_from_urdf(URDFS["franka"])
    joints = np.array([[0.02]])
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        link_poses(mirrored(table), joints), flip @ link_poses(table, joints) @ flip, atol=1e-12
    )


def test_boxes_around_a_mesh_hold_it_and_little_more() -> None:
    corners = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.1], [0.004, 0.004, 0.1]])
    mesh = convex_hull(corners)
    boxes = mesh_boxes(mesh)
    for vertex in mesh.vertices:
        inside = [
            np.all(np.abs(pose[:3, :3].T @ (vertex - pose[:3, 3])) <= half + 1e-9)
            for pose, half in boxes
        ]
        assert any(inside)
    volume = sum(8.0 * float(half.prod()) for _, half in boxes)
    assert mesh.volume < volume < 4.0 * mesh.volume
