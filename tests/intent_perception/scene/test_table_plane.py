"""Table, arm and normals in depth images made of planes."""

import numpy as np
import pytest

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import (
    inverse,
    look_at,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.scene.arm_pixels import ArmConfig, arm_pixels
from intent_perception.scene.oriented_image import OrientedImage, orient
from intent_perception.scene.table_plane import TablePlane
from intent_perception.scene.table_search import find_table

EYE = np.array([0.1, -0.7, 0.55])
T_WORLD_CAMERA = look_at(EYE, np.array([0.0, 0.0, 0.05]), np.array([0.0, 0.0, 1.0]))


def box(size: tuple[float, float, float], center: tuple[float, float, float]) -> Mesh:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return convex_hull(corners * size + np.array(center))


def image_of(*meshes: Mesh, pose: Array = T_WORLD_CAMERA) -> OrientedImage:
    poses = np.stack([inverse(pose)] * (len(meshes) + 1))
    table = box((1.0, 0.8, 0.02), (0.0, 0.0, -0.01))
    depth = render(KINECT, [table, *meshes], poses).depth
    frame = RgbdFrame(0, np.zeros((480, 640, 3), np.uint8), depth, KINECT)
    return orient(frame, 525.0, 0.009, 2.0)


def table_in(image: OrientedImage) -> TablePlane:
    table = find_table(image, np.random.default_rng(0), 0.008, 0.15)
    assert table is not None
    return table


def test_normals_of_a_plane_are_exact() -> None:
    image = image_of()
    normals = image.normals[200:300, 200:400].reshape(-1, 3)
    up = T_WORLD_CAMERA[:3, :3].T @ np.array([0.0, 0.0, 1.0])
    assert np.all(normals @ up > np.cos(np.radians(0.5)))


def test_table_height_is_that_of_the_camera() -> None:
    table = table_in(image_of(box((0.05, 0.05, 0.1), (0.0, 0.0, 0.05))))
    assert table.offset == pytest.approx(EYE[2], abs=0.001)
    assert table.T_table_camera()[2, 3] == pytest.approx(EYE[2], abs=0.001)


def test_table_frame_has_z_up_and_its_origin_on_the_optical_axis() -> None:
    T_table_camera = table_in(image_of()).T_table_camera()
    on_axis = transform_points(inverse(T_table_camera), np.zeros(3))
    assert np.allclose(on_axis[:2], 0.0, atol=1e-9)
    assert np.allclose(T_table_camera[:3, :3] @ T_table_camera[:3, :3].T, np.eye(3), atol=1e-9)


def test_the_outline_holds_what_stands_on_the_table() -> None:
    table = table_in(image_of())
    inside = transform_points(inverse(T_WORLD_CAMERA), np.array([[0.0, 0.0, 0.1], [0.3, 0.2, 0.0]]))
    outside = transform_points(inverse(T_WORLD_CAMERA), np.array([[0.0, 0.7, 0.1]]))
    assert table.over_table(inside.astype(np.float32), 0.0).all()
    assert not table.over_table(outside.astype(np.float32), 0.0).any()


def test_no_table_is_found_on_a_wall() -> None:
    depth = np.full((480, 640), 1.0, np.float32)
    frame = RgbdFrame(0, np.zeros((480, 640, 3), np.uint8), depth, KINECT)
    image = orient(frame, 525.0, 0.009, 2.0)
    assert find_table(image, np.random.default_rng(0), 0.008, 0.15) is None


@pytest.mark.parametrize("degrees", [90.0, 180.0, 270.0])
def test_a_rolled_camera_finds_the_table(degrees: float) -> None:
    roll = rotation_from_vector(np.array([0.0, 0.0, np.radians(degrees)]))
    T_world_camera = T_WORLD_CAMERA @ make_pose(roll, np.zeros(3))
    table = table_in(image_of(box((0.05, 0.05, 0.1), (0.0, 0.0, 0.05)), pose=T_world_camera))
    up = T_world_camera[:3, :3].T @ np.array([0.0, 0.0, 1.0])
    assert table.offset == pytest.approx(EYE[2], abs=0.001)
    assert table.normal @ up > np.cos(np.radians(0.3))
    assert table.T_table_camera()[2, 3] == pytest.approx(EYE[2], abs=0.001)


def from_above(*meshes: Mesh) -> OrientedImage:
    pose = look_at(np.array([0.0, 0.0, 0.8]), np.zeros(3), np.array([0.6, 0.8, 0.0]))
    return image_of(*meshes, pose=pose)


def test_a_table_with_a_cup_is_found_from_straight_above() -> None:
    table = table_in(from_above(box((0.08, 0.08, 0.1), (0.02, 0.0, 0.05))))
    assert table.offset == pytest.approx(0.8, abs=0.001)
    assert table.normal[2] < -np.cos(np.radians(0.3))


def test_a_bare_table_straight_below_is_found_where_the_vertical_is_known() -> None:
    image = from_above()
    up = np.array([0.05, 0.0, -1.0]) / np.linalg.norm([0.05, 0.0, -1.0])
    assert find_table(image, np.random.default_rng(0), 0.008, 0.15) is None  # a wall?
    table = find_table(image, np.random.default_rng(0), 0.008, 0.15, up)
    assert table is not None
    assert table.offset == pytest.approx(0.8, abs=0.001)


def test_with_a_known_vertical_a_wall_is_no_table() -> None:
    image = image_of(box((0.05, 0.05, 0.1), (0.0, 0.0, 0.05)))
    sideways = T_WORLD_CAMERA[:3, :3].T @ np.array([0.0, -1.0, 0.0])
    assert find_table(image, np.random.default_rng(0), 0.008, 0.15, sideways) is None


def test_of_several_planes_the_one_with_things_on_it_is_the_table() -> None:
    wall = box((3.0, 0.02, 3.0), (0.0, 0.55, 0.0))
    floor = box((4.0, 4.0, 0.02), (0.0, 0.0, -0.75))
    image = image_of(wall, floor, box((0.06, 0.06, 0.15), (0.0, 0.0, 0.075)))
    assert table_in(image).offset == pytest.approx(EYE[2], abs=0.001)


def test_an_arm_across_the_table_does_not_cut_it_off() -> None:
    table = table_in(image_of(box((1.4, 0.06, 0.05), (0.0, 0.0, 0.06))))
    places = np.array([[0.0, -0.3, 0.0], [0.0, 0.3, 0.0]])
    inside = transform_points(inverse(T_WORLD_CAMERA), places)
    assert table.over_table(inside.astype(np.float32), 0.0).all()


def test_a_camera_on_its_side_that_looks_along_the_table_has_a_frame() -> None:
    normal = np.array([-0.999, 0.0, -np.sqrt(1.0 - 0.999**2)])
    T_table_camera = TablePlane(normal, 0.4, np.zeros((0, 2), np.float32)).T_table_camera()
    rotation = T_table_camera[:3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert np.allclose(rotation[2], normal)


def test_an_arm_is_told_from_an_object() -> None:
    arm = box((0.07, 0.5, 0.07), (0.0, 0.35, 0.12))
    bottle = box((0.06, 0.06, 0.2), (-0.25, 0.0, 0.1))
    image = image_of(arm, bottle)
    found = arm_pixels(image, table_in(image), ArmConfig())
    points = transform_points(T_WORLD_CAMERA, image.points()[found].astype(np.float64))
    assert found.sum() > 500
    assert np.abs(points[:, 0]).max() < 0.06


def test_no_arm_is_seen_where_none_is() -> None:
    image = image_of(box((0.06, 0.06, 0.2), (-0.25, 0.0, 0.1)))
    assert not arm_pixels(image, table_in(image), ArmConfig()).any()
