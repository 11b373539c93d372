"""Files are written beside their place and take it when they are whole: nothing is half lost."""

import errno
import io
import json
import os
import sys
import tempfile
from argparse import ArgumentTypeError
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_REMEDIES = {
    errno.ENOSPC: "free some space on the disk",
    errno.EDQUOT: "free some of your quota",
    errno.EFBIG: "the file may not grow so large here (ulimit -f)",
    errno.EACCES: "give a folder that you may write to",
    errno.EPERM: "give a folder that you may write to",
    errno.EROFS: "give a folder that you may write to",
    errno.ENOTDIR: "a part of the path is a file",
    errno.EISDIR: "it is a folder: give the name of a file",
}


@contextmanager
def written_beside(path: Path | str) -> Iterator[Path]:
    """Give the path of an empty file beside another one, and put it in that one's place at the end.

    Whatever goes wrong before the end, the other file stays as it was.

    Raises:
        ValueError: if the folder or the file cannot be written, with the remedy.
    """
    target = Path(path)
    part = None
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        target.parent.mkdir(parents=True, exist_ok=True)
        # The suffix says to libraries what to write.
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=".part-", dir=target.parent)
        part = Path(name)
        os.close(handle)
        yield part
        with part.open("rb+") as whole:
            os.fsync(whole.fileno())
        part.chmod(_mode(target))
        part.replace(target)
    except OSError as error:
        raise unwritten(target, error) from error
    finally:
        if part is not None:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def unwritten(path: Path | str, error: OSError) -> ValueError:
    """Return the sentence about a file that cannot be written."""
    reason = error.strerror or str(error)
    remedy = _REMEDIES.get(error.errno or 0, "see the path and the disk")
    return ValueError(f"cannot write {path} ({reason}): {remedy}; what was there is unchanged")


def check_place(path: Path | str) -> None:
    """Refuse a file that could not be written later: to be asked before long work.

    Raises:
        ValueError: if the folder is missing and cannot be made, or the file cannot be written.
    """
    target = Path(path)
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        folder = next(above for above in target.absolute().parents if above.exists())
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"\0" * 4096)
    except OSError as error:
        raise unwritten(target, error) from error


def output_file(text: str) -> Path:
    """Return the path of a command's output, refused at once where it cannot be written.

    For argparse's `type`; "-" is the standard output.
    """
    if text != "-":
        try:
            check_place(text)
        except ValueError as error:
            raise ArgumentTypeError(str(error)) from error
    return Path(text)


def write_bytes(path: Path | str, content: bytes) -> None:
    """Write a file; ValueError where that is impossible, and what was there is unchanged."""
    with written_beside(path) as part:
        part.write_bytes(content)


def write_text(path: Path | str, text: str) -> None:
    """Write a text in UTF-8 as `write_bytes` does."""
    write_bytes(path, text.encode())


def write_json(path: Path | str, content: Any, indent: int | None = 1) -> None:
    """Write JSON as `write_bytes` does; to the standard output where the path is "-"."""
    text = json.dumps(content, indent=indent) + "\n"
    if str(path) == "-":
        sys.stdout.write(text)
    else:
        write_text(path, text)


def write_arrays(
    path: Path | str, arrays: Mapping[str, NDArray[Any]], compressed: bool = True
) -> None:
    """Write arrays by name into one .npz file, without pickle, as `write_bytes` does."""
    # numpy 1 would take the option allow_pickle for one more array.
    if objects := [name for name, array in arrays.items() if np.asarray(array).dtype.hasobject]:
        raise ValueError(f"expected arrays of numbers or texts, got objects in {objects}")
    memory = io.BytesIO()
    save = np.savez_compressed if compressed else np.savez
    save(memory, **arrays)  # type: ignore[arg-type]  # numpy 2 names an option like an array
    write_bytes(path, memory.getvalue())


def _mode(target: Path) -> int:
    """Return the permissions of a file, those of a new one where there is none."""
    with suppress(OSError):
        return target.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
