"""Laws of the rigid transforms."""

import numpy as np
import pytest

from intent_perception.geometry import transforms as g


def rotations(count: int = 200) -> g.Array:
    rng = np.random.default_rng(0)
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.concatenate([rng.uniform(0, np.pi, count - 4), [0.0, 1e-10, np.pi, np.pi - 1e-9]])
    return g.rotation_from_vector(axis * angle[:, None])


def test_rotation_matrices_are_orthonormal() -> None:
    rotation = rotations()
    np.testing.assert_allclose(
        rotation @ np.swapaxes(rotation, 1, 2),
        np.tile(np.eye(3), (len(rotation), 1, 1)),
        atol=1e-12,
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-12)


def test_rotation_vector_gives_the_rotation_back() -> None:
    rotation = rotations()
    vectors = g.vector_from_rotation(rotation)
    assert np.all(np.linalg.norm(vectors, axis=1) <= np.pi + 1e-12)
    np.testing.assert_allclose(g.rotation_from_vector(vectors), rotation, atol=1e-9)


def test_quaternion_gives_the_rotation_back() -> None:
    rotation = rotations()
    quaternions = g.quaternion_from_rotation(rotation)
    assert np.all(quaternions[:, 3] >= 0)
    np.testing.assert_allclose(g.rotation_from_quaternion(quaternions), rotation, atol=1e-9)


def test_quarter_turn_about_z_takes_x_to_y() -> None:
    rotation = g.rotation_from_vector([0, 0, np.pi / 2])
    np.testing.assert_allclose(rotation @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(g.quaternion_from_rotation(rotation), [0, 0, 0.5**0.5, 0.5**0.5])


def test_pose_times_inverse_is_identity() -> None:
    pose = g.make_pose(rotations(), np.random.default_rng(1).normal(size=(200, 3)))
    np.testing.assert_allclose(pose @ g.inverse(pose), np.tile(np.eye(4), (200, 1, 1)), atol=1e-12)


def test_pose_vector_gives_the_pose_back() -> None:
    pose = g.make_pose(rotations(), np.random.default_rng(1).normal(size=(200, 3)))
    np.testing.assert_allclose(g.pose_from_vector(g.vector_from_pose(pose)), pose, atol=1e-9)


def test_transform_points_composes() -> None:
    rng = np.random.default_rng(2)
    a, b = g.make_pose(rotations(4)[:2], rng.normal(size=(2, 3)))
    points = rng.normal(size=(5, 7, 3))
    np.testing.assert_allclose(
        g.transform_points(a @ b, points), g.transform_points(a, g.transform_points(b, points))
    )


@pytest.mark.parametrize("end", [[0, 0, 1], [0, 0, -1], [1, 2, 3], [1e-12, 0, 1]])
def test_rotation_between_takes_start_to_end(end: list[float]) -> None:
    turned = g.rotation_between([0, 0, 2], end) @ [0, 0, 1]
    np.testing.assert_allclose(turned, np.array(end) / np.linalg.norm(end), atol=1e-9)


def test_camera_that_looks_at_a_point_has_it_on_its_axis_and_up_above() -> None:
    T_camera_table = g.inverse(g.look_at([0.1, -0.8, 0.5], [0, 0, 0]))
    target, above = g.transform_points(T_camera_table, [[0, 0, 0], [0, 0, 0.1]])
    np.testing.assert_allclose(target, [0, 0, np.sqrt(0.01 + 0.64 + 0.25)], atol=1e-12)
    assert above[1] < 0


def test_zero_quaternion_is_refused() -> None:
    with pytest.raises(ValueError, match="other than zero"):
        g.rotation_from_quaternion([0, 0, 0, 0])
