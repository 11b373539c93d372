"""A grasp is carried out by contact and friction alone."""

import numpy as np
import pytest

from intent_imitation.planner.plan import GraspCandidate
from intent_imitation.workshop.trials.motions import MotionConfig, interpolate, stages
from intent_perception.geometry.transforms import make_pose, rotation_angle, rotation_from_vector
from intent_perception.objects.database import CLUTTER, ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

TASKS = ("hand-over", "pouring", "tool-use", "dish-washing", "unheard-of")
SIDE = np.stack([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], axis=1)
"""The hand comes along +x, its fingers closing along the vertical."""
FLAT = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], axis=1)
"""The hand comes along +x, its fingers closing across."""


def candidate(place: list[float]) -> GraspCandidate:
    """Return a grasp from the side that closes firmly on whatever stands in its way."""
    opened = np.radians([0.0, -38.0, 22.0, -38.0, 22.0, -38.0, 22.0])
    closed = np.radians([0.0, -2.0, 34.0, -2.0, 34.0, -2.0, 34.0])
    pose = make_pose(FLAT, place)
    return GraspCandidate("thing", pose, FLAT[:, 2], opened, closed, 1.0)


@pytest.mark.parametrize("task", TASKS)
def test_every_motion_approaches_closes_and_lifts_before_the_task(task: str) -> None:
    grasp = candidate([-0.15, 0.0, 0.1])
    motion = stages(grasp, task, np.array([0.0, 0.0, 0.06]), MotionConfig())
    assert [stage.name for stage in motion[:4]] == ["start", "approach", "close", "lift"]
    np.testing.assert_allclose(motion[1].T_table_hand, grasp.T_table_hand)
    assert motion[3].T_table_hand[2, 3] - grasp.T_table_hand[2, 3] == pytest.approx(0.18)
    assert len(motion) > 4


@pytest.mark.parametrize(("task", "angle"), [("pouring", np.pi / 2), ("dish-washing", np.pi)])
def test_pouring_tilts_by_a_right_angle_and_washing_turns_over(task: str, angle: float) -> None:
    motion = stages(candidate([-0.15, 0.0, 0.1]), task, np.zeros(3), MotionConfig())
    lifted, last = motion[3].T_table_hand, motion[-1].T_table_hand
    turn = last[:3, :3] @ lifted[:3, :3].T
    assert float(rotation_angle(turn)) == pytest.approx(angle)
    assert (turn @ [0.0, 0.0, 1.0])[2] == pytest.approx(np.cos(angle), abs=1e-9)


def test_interpolation_starts_and_ends_where_it_should() -> None:
    start = make_pose(np.eye(3), [0.0, 0.0, 0.0])
    end = make_pose(rotation_from_vector([0.3, -0.4, 0.9]), [0.1, 0.2, -0.3])
    np.testing.assert_allclose(interpolate(start, end, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(interpolate(start, end, 1.0), end, atol=1e-12)
    middle = interpolate(start, end, 0.5)
    np.testing.assert_allclose(middle[:3, 3], 0.5 * end[:3, 3], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "held"), [(0.8, True), (0.0, False)])
def test_a_can_is_lifted_with_friction_and_slips_without(friction: float, held: bool) -> None:
    pytest.importorskip("pybullet")
    from intent_imitation.workshop.trials.execution import ExecutionConfig, World
    from intent_inference.grasping.grasping_hand import GraspingHand

    can = ObjectDatabase.load(CLUTTER)["can"]
    pose = can.stable_poses[0]
    hand = GraspingHand.load("schunk")
    config = ExecutionConfig(friction=friction)
    with World(hand, [can], pose[None], config) as world:
        outcome = world.execute(candidate([-0.165, 0.0, 0.075]), 0, "pouring")
    assert outcome.held == held
    assert [snapshot.stage for snapshot in outcome.snapshots][-1] == "tilt"


@pytest.mark.slow
def test_an_object_stands_where_it_was_placed_whatever_its_centre_of_mass() -> None:
    pytest.importorskip("pybullet")
    from intent_imitation.workshop.trials.execution import World
    from intent_inference.grasping.grasping_hand import GraspingHand

    hammer = ObjectDatabase.load()["hammer_4"]
    assert np.linalg.norm(hammer.require_volume().center_of_mass) > 0.03
    pose = make_pose(np.eye(3), [0.1, -0.2, 0.0]) @ hammer.stable_poses[0]
    with World(GraspingHand.load("schunk"), [hammer], pose[None]) as world:
        outcome = world.execute(candidate([0.8, 0.8, 0.3]), 0, "pouring")
    first = outcome.snapshots[0].T_table_objects[0]
    np.testing.assert_allclose(first[:3, 3], pose[:3, 3], atol=0.002)
    assert not outcome.held


@pytest.mark.slow
def test_most_grasps_of_a_heavy_tool_that_lies_flat_hold_through_its_use() -> None:
    pytest.importorskip("pybullet")
    from intent_imitation.planner.planner import GraspPlanner
    from intent_imitation.planner.planner_config import PlannerConfig
    from intent_imitation.workshop.trials.execution import World
    from intent_inference.grasping.grasping_hand import GraspingHand

    database = ObjectDatabase.load()
    hammer = database["hammer_5"]
    pose = hammer.stable_poses[0]
    planner = GraspPlanner(database, PlannerConfig(minimum_grasp=0.5))
    item = RecognizedObject("hammer_5", "hammer_5", "hammer", pose, 1.0, 1.0)
    planner.start(RecognizedObjects(0, (item,), np.eye(4)))
    grasps, held = planner.plan("tool-use").grasps[:3], 0
    for grasp in grasps:
        with World(GraspingHand.load("schunk"), [hammer], pose[None]) as world:
            held += world.execute(grasp, 0, "tool-use").held
    assert held >= 2
