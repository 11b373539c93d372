"""All bags against their truth, one line each: `pytest tests -m bags -s`."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.support.bag_runs import ROOT, Verdict, folders, joint_error, judge

from intent_inference.workshop.recipes.bag_run import BagRun, run_bag

pytestmark = [pytest.mark.bags, pytest.mark.slow]

_FRAMES = 10
"""A grasp found this many frames from the true moment counts."""


@pytest.fixture(scope="module")
def runs(request: pytest.FixtureRequest) -> dict[Path, BagRun]:
    """Every bag that is there; asked for by `-m bags`, the missing ones are made first."""
    if request.config.getoption("markexpr") == "bags":
        _make_missing()
    found = [folder for folder in folders() if folder.name != "robot_table"]
    if not found:
        pytest.skip("no bag: python bags/make.py")
    return {folder: run_bag(folder) for folder in found}


def _make_missing() -> None:
    make = [sys.executable, str(ROOT / "bags" / "make.py")]
    listed = subprocess.run([*make, "--list"], capture_output=True, text=True, check=True).stdout
    there = {folder.name for folder in folders()}
    missing = [line.split()[0] for line in listed.splitlines() if line.split()[0] not in there]
    halves = [half for half in (missing[::2], missing[1::2]) if half]
    for process in [subprocess.Popen([*make, *half]) for half in halves]:
        assert process.wait() == 0


@pytest.fixture(scope="module")
def verdicts(runs: dict[Path, BagRun]) -> list[Verdict]:
    judged = [verdict for folder, run in runs.items() for verdict in judge(folder, run)]
    sys.stdout.write("\n" + "\n".join([*_lines(judged), *_tracks(runs), *_summary(judged)]) + "\n")
    return judged


def _lines(judged: list[Verdict]) -> list[str]:
    title = f"{'bag':20}{'object':15}{'task':14}{'found as':14}{'mm':>6}{'grasp':>7}{'rank':>6}"
    lines = [f"{title}   class alone"]
    for v in judged:
        offset = "-" if v.grasp_offset is None else f"{v.grasp_offset:+d}"
        line = f"{v.bag:20}{v.object:15}{v.task:14}{v.found_as:14}{1e3 * v.pose_error:6.1f}"
        lines.append(f"{line}{offset:>7}{v.rank or '-':>6}   {v.class_rank:>11}")
    return lines


def _tracks(runs: dict[Path, BagRun]) -> list[str]:
    lines = []
    for folder, run in runs.items():
        error, lost, seen = joint_error(folder, run)
        lines.append(f"{folder.name:20}joints {1e3 * error:5.1f} mm, lost {lost:.0%} of {seen}")
    return lines


def _summary(judged: list[Verdict]) -> list[str]:
    lines = []
    for rank in (1, 2):
        ours = np.mean([v.rank is not None and v.rank <= rank for v in _known(judged)])
        alone = np.mean([v.class_rank <= rank for v in _known(judged)])
        lines.append(f"true task among the first {rank}: {ours:.0%}; class alone: {alone:.0%}")
    return lines


def _known(verdicts: list[Verdict]) -> list[Verdict]:
    """Return those whose object is in the database: the others cannot be judged by task."""
    return [v for v in verdicts if v.bag != "unknown_object"]


def test_the_grasped_object_is_recognised_before_it_is_touched(verdicts: list[Verdict]) -> None:
    assert np.mean([v.recognized for v in _known(verdicts)]) >= 0.8


def test_each_demonstration_gives_one_grasp_at_the_right_moment(verdicts: list[Verdict]) -> None:
    found = [
        v.grasp_offset is not None and abs(v.grasp_offset) <= _FRAMES for v in _known(verdicts)
    ]
    assert np.mean(found) >= 0.8


def test_a_bag_without_a_grasp_gives_none(runs: dict[Path, BagRun]) -> None:
    for folder, run in runs.items():
        if folder.name.startswith("no_grasp"):
            assert not run.grasps


def test_the_true_task_comes_first_or_second(verdicts: list[Verdict]) -> None:
    ranks = [v.rank or 99 for v in _known(verdicts)]
    assert np.mean([rank == 1 for rank in ranks]) >= 0.6
    assert np.mean([rank <= 2 for rank in ranks]) >= 0.85


def test_every_frame_gives_a_state_of_the_right_size(
    runs: dict[Path, BagRun],
) -> None:
    for folder, run in runs.items():
        stamps = np.load(folder / "truth.npz")["stamps"]
        assert [state.stamp for state in run.states] == stamps.tolist()
        assert all(len(s.state) == 26 + 6 * len(s.object_ids) for s in run.states)
