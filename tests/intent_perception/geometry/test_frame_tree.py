"""Fixed transforms chain up to the frame that two have in common."""

import numpy as np

from intent_perception.geometry.frame_tree import FrameTree
from intent_perception.geometry.transforms import inverse, make_pose, rotation_from_vector

A = make_pose(rotation_from_vector([0.1, 0.2, 0.3]), [1.0, 2.0, 3.0])
B = make_pose(rotation_from_vector([-0.4, 0.0, 0.9]), [0.0, 0.5, -1.0])


def test_two_branches_meet_in_their_common_frame() -> None:
    tree = FrameTree()
    tree.add("base", "link", A)
    tree.add("link", "optical", B)
    tree.add("link", "imu", A)
    found = tree.between("imu", "optical")
    assert found is not None
    np.testing.assert_allclose(found, inverse(A) @ B, atol=1e-12)
    np.testing.assert_allclose(tree.between("base", "optical"), A @ B, atol=1e-12)  # type: ignore[arg-type]


def test_frames_of_two_trees_are_not_connected() -> None:
    tree = FrameTree()
    tree.add("base", "link", A)
    assert tree.between("base", "optical") is None
    assert tree.parent("optical") is None


def test_a_ring_of_frames_ends() -> None:
    tree = FrameTree()
    tree.add("a", "b", A)
    tree.add("b", "a", B)
    assert tree.between("a", "c") is None
