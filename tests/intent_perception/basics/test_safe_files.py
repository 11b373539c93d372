"""A write that fails leaves what was there, and one sentence."""

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.safe_files import (
    check_place,
    write_arrays,
    write_bytes,
    write_text,
    written_beside,
)


@contextmanager
def full_disk() -> Iterator[None]:
    """No file of this process may grow beyond a kilobyte, as on a disk that is full.

    For the one call only: pytest's own output may be a file, too.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_full_disk_loses_nothing_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    write_bytes(path, b"taught")
    counts = {"counts": np.random.default_rng(0).random(1000)}
    sentence = r"cannot write .*model\.npz.*what was there is unchanged"
    with pytest.raises(ValueError, match=sentence), full_disk():
        write_arrays(path, counts)
    assert path.read_bytes() == b"taught"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_write_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_text(path, "old")

    def interrupted() -> None:
        with written_beside(path) as part:
            part.write_text("half of the ne")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_permissions_of_a_replaced_file_stay(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_text(path, "old")
    path.chmod(0o640)
    write_text(path, "new")
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("name", ["file/inside.npz", "."])
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, name: str
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="cannot write"):
        check_place(tmp_path / name)


def test_arrays_come_back_as_they_were_written(tmp_path: Path) -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3).T, "names": np.array(["x", "yz"]), "n": np.array(3)}
    write_arrays(tmp_path / "a.npz", arrays)
    back = read_arrays(tmp_path / "a.npz", "arrays")
    assert back.keys() == arrays.keys()
    assert all(np.array_equal(back[name], arrays[name]) for name in arrays)


def test_objects_are_no_arrays_to_write(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="got objects in"):
        write_arrays(tmp_path / "a.npz", {"a": np.array([{}, None], dtype=object)})
