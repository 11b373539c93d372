"""Clearances along approach and closing agree with geometry that is known in closed form."""

import numpy as np
import pytest

from intent_imitation.planner.collision import Obstacle, clearances, hand_spheres
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.geometry.mesh import Mesh, convex_hull
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.scene.joint_table import placed_capsules

DOWN = rotation_from_vector([np.pi, 0.0, 0.0])
OPEN = np.zeros((1, 7))


@pytest.fixture(scope="module")
def hand() -> GraspingHand:
    return GraspingHand.load("schunk")


def block(edge: float) -> Mesh:
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return convex_hull(0.5 * edge * corners)


def room(hand: GraspingHand, height: float, *neighbours: Obstacle) -> tuple[float, float]:
    """Return the gaps to table and neighbours of an open hand that comes from above."""
    pose = make_pose(DOWN, [0.0, 0.0, height])
    away = Obstacle(make_pose(np.eye(3), [0.0, 5.0, 0.0]), SignedDistance.from_mesh(block(0.04)))
    approach = np.array([[0.0, 0.0, -1.0]])
    gaps = clearances(hand, pose[None], approach, OPEN, OPEN, away, neighbours)
    return float(gaps.table[0]), float(gaps.neighbours[0])


def test_gap_to_the_table_is_the_height_of_the_fingertips(hand: GraspingHand) -> None:
    reach = placed_capsules(hand.table, OPEN)[0][..., 2].max() + 0.011
    assert room(hand, 0.30)[0] == pytest.approx(0.30 - reach, abs=1e-4)


def test_lowering_the_hand_lowers_the_gap_by_as_much(hand: GraspingHand) -> None:
    assert room(hand, 0.30)[0] - room(hand, 0.27)[0] == pytest.approx(0.03, abs=1e-9)


def test_without_neighbours_the_gap_to_them_is_infinite(hand: GraspingHand) -> None:
    assert room(hand, 0.30)[1] == np.inf


def test_a_block_under_the_palm_is_hit_and_one_aside_is_not(hand: GraspingHand) -> None:
    distance = SignedDistance.from_mesh(block(0.04))
    under = Obstacle(make_pose(np.eye(3), [0.0, 0.0, 0.28]), distance)
    aside = Obstacle(make_pose(np.eye(3), [0.4, 0.0, 0.28]), distance)
    assert room(hand, 0.30, under)[1] < 0.0
    assert room(hand, 0.30, aside)[1] > 0.2


def test_spheres_lie_inside_the_capsules_that_they_cover(hand: GraspingHand) -> None:
    posture = np.radians([[30.0, -20.0, 40.0, -20.0, 40.0, -20.0, 40.0]])
    centers = hand_spheres(hand, posture)[0]
    assert centers.shape == (len(hand.arrays.sphere_radii), 3)
    low = placed_capsules(hand.table, posture)[0].reshape(-1, 3)
    assert centers[:, 2].max() == pytest.approx(low[:, 2].max(), abs=1e-6)
