"""Shared memory of killed nodes goes; what a running program holds, or is about to, stays."""

import fcntl
import os
import time
from pathlib import Path

from intent_perception.basics.orphaned_files import drop_shared_memory


def test_only_segments_that_nobody_holds_are_dropped(tmp_path: Path) -> None:
    for name in ("0dead", "0dead_el", "1live", "1live_el", "port7411", "port7411_el", "2new"):
        (tmp_path / f"fastrtps_{name}").write_text("x")
    (tmp_path / "somebody_else").write_text("x")
    old = time.time() - 600
    for file in tmp_path.iterdir():
        if not file.name.endswith("2new"):
            os.utime(file, (old, old))
    with (tmp_path / "fastrtps_1live_el").open() as live:
        fcntl.flock(live, fcntl.LOCK_EX)
        drop_shared_memory(tmp_path)
    left = {file.name.removeprefix("fastrtps_") for file in tmp_path.iterdir()}
    assert left == {"1live", "1live_el", "port7411", "port7411_el", "2new", "somebody_else"}
