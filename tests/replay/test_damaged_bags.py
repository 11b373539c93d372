"""A bag through the steps with something wrong in it: each damage has one stated outcome."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.bag_runs import folders

from intent_inference.workshop.recipes.bag_run import run_frames
from intent_perception.bags.bag_files import read_frames
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.objects.database import ObjectDatabase

pytestmark = pytest.mark.slow

_WANTED = ["bottle_0", "glass_1", "hammer_0"]


@pytest.fixture(scope="module")
def folder() -> Path:
    found = {path.name: path for path in folders()}
    if "pour_bottle" not in found:
        pytest.skip("no bag: python bags/make.py pour_bottle")
    return found["pour_bottle"]


@pytest.fixture(scope="module")
def frames(folder: Path) -> list[RgbdFrame]:
    """Every third frame around the grasp, after the first ones without a hand."""
    every = list(read_frames(folder))
    grasp = int(np.load(folder / "truth.npz")["grasp_frame"][0])
    return every[:2] + every[grasp - 12 : grasp : 3]


@pytest.fixture(scope="module")
def database() -> ObjectDatabase:
    return ObjectDatabase.load().select(_WANTED)


def _without_depth(frames: list[RgbdFrame]) -> Iterator[RgbdFrame]:
    for frame in frames:
        yield replace(frame, depth=np.zeros_like(frame.depth))


def test_without_depth_nothing_is_recognised_and_no_hand_invented(
    frames: list[RgbdFrame], database: ObjectDatabase
) -> None:
    run = run_frames(_without_depth(frames), database)
    assert all(not answer.objects for _, answer in run.recognized)
    assert all(not state.hand_tracked and np.isnan(state.state[:26]).all() for state in run.states)
    assert not run.grasps


def test_lost_frames_still_give_one_state_each_with_their_own_stamp(
    frames: list[RgbdFrame], database: ObjectDatabase
) -> None:
    run = run_frames(iter(frames), database)
    assert [state.stamp for state in run.states] == [frame.stamp for frame in frames]
    assert any(state.hand_tracked for state in run.states)
    assert len(run.grasps) <= 1


def test_a_bag_that_ends_in_the_reach_gives_no_grasp(
    frames: list[RgbdFrame], database: ObjectDatabase
) -> None:
    run = run_frames(iter(frames[:4]), database)
    assert len(run.states) == 4
    assert not run.grasps


def test_a_hand_that_a_lost_image_hides_is_flagged_and_comes_back(
    frames: list[RgbdFrame], database: ObjectDatabase
) -> None:
    hidden = replace(frames[-2], depth=np.zeros_like(frames[-2].depth))
    run = run_frames(iter([*frames[:-2], hidden, frames[-1]]), database)
    assert not run.states[-2].hand_tracked
    assert np.isnan(run.states[-2].state[:26]).all()
    assert run.states[-1].hand_visible
