"""A recorded bag, opened: what is wrong is said, and one bad place does not cost the rest."""

import stat
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader

from intent_perception.bags.bag_checksums import check_summary
from intent_perception.basics.checked_files import read_yaml

STORAGES = {".mcap": "mcap", ".db3": "sqlite3"}
"""Suffix of a bag's files to what metadata.yaml calls them."""
_STEP = 10_000_000
"""Behind a place that cannot be read, reading goes on this much later [ns] …"""
_STEPS = 200
"""… and after so many tries in ever longer steps: a damaged chunk is a second long at most."""


def opened(path: Path | str) -> Reader:
    """Return a reader of a rosbag2 folder or of one of its files, which opens on `with`.

    Raises:
        ValueError: if there is no bag or its index cannot be read, with the remedy.
    """
    place = _place(Path(path))
    try:
        reader = Reader(place)
        reader.open()
        reader.close()
    except Exception as error:  # the storages raise their own, struct's and zlib's errors
        raise damaged(path, error) from error
    return reader


def damaged(path: Path | str, error: object) -> ValueError:
    """Return the sentence about a bag that cannot be read."""
    reason = " ".join(str(error).split())[:300] or type(error).__name__
    return ValueError(
        f"bag {path} is damaged or was not closed ({reason}): record it again or repair it "
        "with 'ros2 bag reindex'"
    )


def _place(path: Path) -> Path:
    """Return what to open, after a look at the kind of each file: a pipe would never end."""
    if not path.exists():
        raise ValueError(f"bag {path} is not there: give a rosbag2 folder")
    if path.suffix == ".bag" and path.is_file():
        raise ValueError(
            f"bag {path} is of ROS 1: convert it with "
            f"'scripts/env.sh rosbags-convert --src {path} --dst {path.with_suffix('')}'"
        )
    stored = _stored_files(path)
    if path.is_file():
        if not stored:
            raise ValueError(f"bag {path} is no .mcap or .db3 file and no rosbag2 folder")
        return path
    known = _metadata(path)
    packed = str(known.get("compression_mode") or "none").lower() in ("file", "message")
    if len(stored) == 1 and stored[0].suffix == ".mcap" and not packed:
        # It says all itself; metadata.yaml may be damaged, or missing after a killed recorder.
        return stored[0]
    if (path / "metadata.yaml").is_file():
        _check_metadata(path, known)
        return path
    if stored:
        raise ValueError(
            f"bag {path} has no metadata.yaml and {len(stored)} files: make one with "
            f"'ros2 bag reindex {path} {STORAGES[stored[0].suffix]}'"
        )
    raise ValueError(f"bag {path} is not a rosbag2 folder (one with metadata.yaml in it)")


def _stored_files(path: Path) -> list[Path]:
    """Return the files with messages in a bag's folder, or the bag itself."""
    files = [path, *path.iterdir()] if path.is_dir() else [path]
    for file in files:
        mode = file.stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise ValueError(f"bag {path} holds {file.name}, a pipe or device: give recorded files")
    stored = [file for file in files if file.is_file() and file.suffix in STORAGES]
    for file in stored:
        if file.stat().st_size == 0:
            raise ValueError(f"bag {path} is empty: {file.name} has no content")
        if file.suffix == ".mcap":
            check_summary(file)
    return stored


def _metadata(path: Path) -> dict[str, Any]:
    """Return what metadata.yaml says of a bag, nothing where it is missing or damaged."""
    try:
        known = read_yaml(path / "metadata.yaml")["rosbag2_bagfile_information"]
        return known if isinstance(known, dict) else {}
    except (ValueError, TypeError, KeyError):
        return {}


def _check_metadata(path: Path, known: dict[str, Any]) -> None:
    """Refuse metadata that is damaged or names no storage, with the remedy."""
    if not known:
        raise damaged(path, "metadata.yaml cannot be read")
    storage = known.get("storage_identifier")
    if storage not in STORAGES.values():
        raise ValueError(
            f"bag {path}: its metadata.yaml names the storage {storage!r}: write "
            "'storage_identifier: mcap' (for .mcap files) or 'sqlite3' (for .db3) into it"
        )


def intact_messages(
    reader: Reader, wanted: Sequence[Any], on_damage: Callable[[str], None] | None, path: Path | str
) -> Iterator[tuple[Any, int, bytes]]:
    """Yield connection, time [ns] and bytes of the messages that can be read.

    Args:
        reader: an open bag.
        wanted: its connections to be read.
        on_damage: told where places were skipped and how many messages are missing; None: the
            first such place raises.
        path: of the bag, for messages.

    Raises:
        ValueError: if a place cannot be read and nobody is told.
    """
    count, start, tries, reason = 0, None, 0, ""
    while True:
        last = reader.start_time if start is None else start
        try:
            for connection, received, data in reader.messages(wanted, start=start):
                last, tries, count = received, 0, count + 1
                yield connection, received, bytes(data)
            break
        except Exception as error:  # whatever the storage raises, the bag is what is wrong
            if on_damage is None:
                raise damaged(path, error) from error
            reason = " ".join(str(error).split())[:200] or type(error).__name__
        tries += 1
        start = last + _STEP * 2 ** max(0, tries - _STEPS)
        if start > reader.end_time:
            break
    missing = sum(connection.msgcount for connection in wanted) - count
    if missing <= 0 and not reason:
        return
    text = f"{missing} messages of the bag {path} are damaged or missing ({reason or 'its index'})"
    if on_damage is None:
        raise damaged(path, text)
    on_damage(f"{text}: they are left out")
