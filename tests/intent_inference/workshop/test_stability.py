"""The shake test keeps what is held, loses what is not, and says how well."""

import numpy as np
import pytest

from intent_inference.grasping.grasp_candidates import CandidateSource
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_inference.grasping.task_object import TaskObject
from intent_inference.workshop.simulation.generation import GenerationConfig, plan_grasps
from intent_inference.workshop.simulation.grasp_table import (
    balanced,
    read_rows,
    row_of_grasp,
    without_duplicates,
    write_rows,
)
from intent_inference.workshop.simulation.simulated_grasp import load_grasps, save_grasps
from intent_inference.workshop.simulation.stability import ShakeConfig, ShakeTest
from intent_perception.geometry.transforms import pose_from_vector
from intent_perception.objects.database import ObjectDatabase


@pytest.fixture(scope="module")
def screwdriver():
    return ObjectDatabase.load()["screwdriver_0"]


@pytest.fixture(scope="module")
def hand():
    return GraspingHand.load("schunk")


@pytest.fixture(scope="module")
def candidate(screwdriver, hand):
    return CandidateSource(TaskObject(screwdriver), hand, np.random.default_rng(0)).take(1, 3000)[0]


@pytest.fixture(scope="module")
def planned(screwdriver, hand):
    few = GenerationConfig(per_round=12, shaken_per_round=6)
    return plan_grasps(screwdriver, hand, np.random.default_rng(1), 4, few)


def test_a_grasp_that_holds_stays_within_the_limits(planned):
    assert len(planned) == 4
    for grasp in planned:
        assert grasp.held
        assert 0.0 <= grasp.stability <= 1.0
        assert grasp.penetration < 0.003


def test_without_friction_nothing_holds_against_all_pulls(screwdriver, hand, candidate):
    with ShakeTest(hand, screwdriver, ShakeConfig(friction=1e-6)) as test:
        assert not test.run(candidate.grasp).held


def test_a_shake_repeats_to_the_bit(screwdriver, hand, candidate):
    with ShakeTest(hand, screwdriver) as test:
        first, second = test.run(candidate.grasp), test.run(candidate.grasp)
    np.testing.assert_array_equal(first.T_object_hand, second.T_object_hand)
    assert first.stability == second.stability


def test_a_firm_grasp_hardly_moves_whichever_side_pulls(screwdriver, hand):
    target = TaskObject(screwdriver)
    found = CandidateSource(target, hand, np.random.default_rng(3)).take(20, 3000)
    firm = [c for c in found if c.grasp.preshape == "power" and c.residual < 0.01][:3]
    with ShakeTest(hand, screwdriver) as test:
        for candidate in firm:
            result = test.run(candidate.grasp)
            assert result.directions == 6
            assert result.stability > 0.5
    assert firm


def test_the_settled_contacts_lie_on_the_object(planned, screwdriver):
    field = TaskObject(screwdriver).field
    for grasp in planned:
        assert np.abs(field.distance(grasp.contacts.points)).max() < 0.004


def test_a_shake_that_tests_nothing_is_refused():
    with pytest.raises(ValueError, match="expected duration in"):
        ShakeConfig(duration=0.0)


def test_grasps_survive_their_archive(planned, tmp_path):
    save_grasps(tmp_path / "a.npz", planned, rounds=np.array(2))
    read, arrays = load_grasps(tmp_path / "a.npz")
    assert int(arrays["rounds"]) == 2
    for ours, theirs in zip(planned, read, strict=True):
        np.testing.assert_array_equal(ours.T_object_hand, theirs.T_object_hand)
        np.testing.assert_array_equal(ours.contacts.forces, theirs.contacts.forces)
        assert ours.preshape == theirs.preshape


def test_a_damaged_archive_is_refused_with_the_remedy(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"PK nonsense")
    with pytest.raises(ValueError, match="delete it"):
        load_grasps(tmp_path / "a.npz")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_cut_archive_is_refused_with_the_remedy(planned, tmp_path, share):
    save_grasps(tmp_path / "a.npz", planned)
    content = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "a.npz").write_bytes(content[: int(share * len(content))])
    with pytest.raises(ValueError, match="delete it"):
        load_grasps(tmp_path / "a.npz")


def test_an_archive_with_a_flipped_byte_is_refused_with_the_remedy(planned, tmp_path):
    save_grasps(tmp_path / "a.npz", planned)
    content = bytearray((tmp_path / "a.npz").read_bytes())
    for place in range(60, 400, 7):
        content[place] ^= 0x55
    (tmp_path / "a.npz").write_bytes(bytes(content))
    with pytest.raises(ValueError, match="delete it"):
        load_grasps(tmp_path / "a.npz")


def test_an_archive_without_an_array_is_refused_with_the_remedy(planned, tmp_path):
    save_grasps(tmp_path / "a.npz", planned)
    with np.load(tmp_path / "a.npz") as archive:
        kept = {key: archive[key] for key in archive.files if key != "joints"}
    np.savez(tmp_path / "a.npz", **kept)
    with pytest.raises(ValueError, match="joints"):
        load_grasps(tmp_path / "a.npz")


def test_a_row_has_the_columns_of_the_contract(planned, screwdriver, hand, tmp_path):
    rows = [row_of_grasp(TaskObject(screwdriver), hand, grasp) for grasp in planned]
    write_rows(tmp_path / "d.csv.gz", rows)
    read = read_rows(tmp_path / "d.csv.gz")
    wanted = ["object_id", "object_class", "size_0", "conv", "dir_x", "dir_w", "npos_2", "fcon_6"]
    wanted += ["fvol", "coc_0", "gbvl_2", "hand-over", "pouring", "tool-use", "dish-washing"]
    wanted += ["margin_tool_use", "stability", "preshape", "wrist_0"]
    assert set(wanted) <= set(read[0])
    assert {row["pouring"] for row in read} == {"0"}


def test_near_duplicates_are_dropped_and_others_kept():
    pose = np.stack(
        [pose_from_vector([x, 0.0, 0.0, 0.0, 0.0, turn]) for x, turn in
         ((0.0, 0.0), (0.004, 0.0), (0.006, 0.0), (0.0, 0.1))]
    )  # fmt: skip
    joints = np.zeros((4, 7))
    np.testing.assert_array_equal(without_duplicates(pose, joints), [0, 2, 3])


def test_no_object_gives_more_than_its_share_of_a_tasks_positives():
    rows = [
        {"object_id": f"o{k % 12}", "hand-over": 1, "pouring": 0, "tool-use": 0, "dish-washing": 0}
        for k in range(120)
    ]
    rows += [dict(rows[0]) for _ in range(100)]
    kept = balanced(rows)
    mine = sum(row["object_id"] == "o0" for row in kept)
    assert mine <= 0.1 * len(kept) + 1
