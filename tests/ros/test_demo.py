"""The demo of whole bags: the same depth stored in three ways gives the same result."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from ament_index_python import get_package_prefix
from tests.support.harness import shipped_bag

from intent_perception.bags.bag_files import transcode

ROOT = Path(__file__).resolve().parents[2]
FORMATS = ("16UC1", "32FC1", "compressedDepth")
pytestmark = [pytest.mark.bags, pytest.mark.slow]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What scripts/demo.sh wrote for each depth format of a shipped bag, the clock left out."""
    folder, found = tmp_path_factory.mktemp("demo"), {}
    for depth in FORMATS:
        bag, out = folder / depth / "pour_bottle", folder / depth / "out"
        transcode(shipped_bag("pour_bottle"), bag, depth)
        command = ["bash", str(ROOT / "scripts/demo.sh"), str(bag), "--out", str(out)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        found[depth] = json.loads((out / "result.json").read_text())
        assert found[depth].pop("seconds") > 0
    return found


def test_a_run_of_which_no_frame_was_seen_ends_in_an_error_and_writes_nothing(
    tmp_path: Path,
) -> None:
    node = Path(get_package_prefix("intent_imitation")) / "lib/intent_imitation/demo"
    bag, out = shipped_bag("pour_bottle"), tmp_path / "out"
    command = [str(node), str(bag), "--out", str(out), "--patience", "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 1
    assert "stopped after 0 of 84 frames" in done.stderr
    assert "nothing is concluded" in done.stderr
    assert not list(out.glob("*"))


@pytest.mark.parametrize("other", FORMATS[1:])
def test_a_whole_bag_gives_the_same_result_in_every_depth_format(
    results: dict[str, dict[str, Any]], other: str
) -> None:
    assert results[FORMATS[0]]["posterior"]
    assert results[other] == results[FORMATS[0]]
