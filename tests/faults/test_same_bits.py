"""The same bag and seed give the same bits, whatever lies in the cache of compiled kernels."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow


def track(cache: Path, *arguments: str, threads: int = 1) -> str:
    """Return the checksum of a short track by a process with a cache of its own."""
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(cache),
        **dict.fromkeys(names, f"{threads}"),
    }
    command = [sys.executable, "-m", "tests.faults.short_track", *arguments]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.strip().splitlines()[-1]


def test_cold_warm_and_half_warm_caches_and_any_order_and_threads_give_one_result(
    tmp_path: Path,
) -> None:
    cold = track(tmp_path)
    assert track(tmp_path, threads=2) == cold  # all from disk
    rng = np.random.default_rng(0)
    for index in sorted(tmp_path.rglob("*.nbi")):
        if rng.random() < 0.3:
            index.unlink()
    assert track(tmp_path, "other-order") == cold
