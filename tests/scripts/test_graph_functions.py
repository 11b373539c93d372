"""Whoever runs the graph hears which node has ended, and may have it started again."""

import os
from pathlib import Path

import pytest
from tests.support.script_runs import SCRIPTS, bash

SOURCED = f"""
set -euo pipefail
source {SCRIPTS}/environment.sh
source {SCRIPTS}/graph.sh
stop_at_exit
"""


@pytest.fixture
def ros2(tmp_path: Path) -> dict[str, str]:
    """A `ros2 run PACKAGE NODE CODE` that runs CODE in bash and keeps a diary."""
    stand_in = tmp_path / "ros2"
    stand_in.write_text(f'#!/bin/bash\necho "$3" >>{tmp_path}/diary\nexec bash -c "$4"\n')
    stand_in.chmod(0o755)
    return {"PATH": f"{tmp_path}:{os.environ['PATH']}"}


def test_a_killed_node_is_named_with_its_signal(ros2: dict[str, str]) -> None:
    code = SOURCED + "start p tracker 'kill -KILL $$'; start p inference 'sleep 4; exit 3'; watch"
    done = bash("-c", code, **ros2)
    assert done.returncode == 1
    # bash may add a word of its own ("Killed")
    first, second, last = (s for s in done.stderr.splitlines() if s.startswith("error: "))
    assert "tracker has ended (killed by SIGKILL)" in first
    assert "inference has ended (status 3)" in second
    assert last == "error: no node is left"


def test_a_bag_is_not_played_on_without_one_of_the_nodes(ros2: dict[str, str]) -> None:
    code = SOURCED + (
        "start p tracker 'kill -SEGV $$'; nodes=(${pids[@]}); start p replay 'sleep 30'; "
        "finish ${pids[-1]} ${nodes[@]}"
    )
    done = bash("-c", code, **ros2)
    assert done.returncode == 1
    (line,) = (s for s in done.stderr.splitlines() if s.startswith("error: "))
    assert "tracker has ended (killed by SIGSEGV)" in line


def test_a_node_is_started_again_by_choice(ros2: dict[str, str], tmp_path: Path) -> None:
    code = SOURCED + (
        "respawn=yes; start p tracker 'sleep .1; kill -KILL $$'; nodes=(${pids[@]}); "
        "start p replay 'sleep 3'; finish ${pids[-1]} ${nodes[@]}"
    )
    done = bash("-c", code, **ros2)
    assert done.returncode == 0
    assert "tracker has ended (killed by SIGKILL); it is started again" in done.stderr
    assert (tmp_path / "diary").read_text().split().count("tracker") > 1


def test_what_was_played_to_its_end_is_a_success(ros2: dict[str, str]) -> None:
    code = SOURCED + (
        "start p tracker 'sleep 30'; nodes=(${pids[@]}); start p replay 'sleep .3'; "
        "finish ${pids[-1]} ${nodes[@]}"
    )
    done = bash("-c", code, **ros2)
    assert (done.returncode, done.stderr) == (0, "")
