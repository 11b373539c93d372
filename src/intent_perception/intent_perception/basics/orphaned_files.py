"""Files of programs that were killed: those that still run hold a lock on theirs.

python3 orphaned_files.py FOLDER PATTERN    prints them, one a line; it needs nothing but Python
"""

import fcntl
import os
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_GRACE = 60.0
"""A program may be about to lock what it has just made [s]."""


def orphaned_files(folder: Path, pattern: str) -> Iterator[Path]:
    """Return one's own files of a pattern in a folder that no running program holds.

    Of the middleware's shared memory, segment `x` is held by a lock on `x_el`, and the mutex
    `sem.x_mutex` by that on `x`.
    """
    for file in sorted(folder.glob(pattern)):
        with suppress(OSError):  # another may be putting it in order as well
            about = file.stat()
            old = time.time() - about.st_mtime > _GRACE
            if file.is_file() and about.st_uid == os.getuid() and old and not _held(file):
                yield file


def drop_shared_memory(folder: Path = Path("/dev/shm")) -> None:
    """Remove what killed nodes left: each holds 34 MB, and some hundred of them fill a machine.

    Segments alone: no two programs ever share one. Ports are small, and another may just take one.
    """
    for file in orphaned_files(folder, "fastrtps_[0-9a-f]*"):
        with suppress(OSError):
            file.unlink()


def _held(file: Path) -> bool:
    lock = file.with_name(file.name.removeprefix("sem.").removesuffix("_mutex"))
    beside = lock.with_name(f"{lock.name.removesuffix('_el')}_el")
    lock = next((one for one in (beside, lock) if one.exists()), file)
    descriptor = os.open(lock, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


if __name__ == "__main__":
    sys.stdout.writelines(f"{file}\n" for file in orphaned_files(Path(sys.argv[1]), sys.argv[2]))
