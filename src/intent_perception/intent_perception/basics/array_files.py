"""Arrays out of .npz files: the size that a file claims is checked before it is unpacked."""

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from intent_perception.basics.checked_files import read_bytes

_LARGEST = 1 << 30
"""Bytes of all arrays of a file together."""


def read_arrays(path: Path | str, what: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz file by name.

    Args:
        path: the file.
        what: it should hold, for the message.

    Raises:
        ValueError: if the file is missing, damaged, holds Python objects, or claims arrays
            larger than it or than one gigabyte.
    """
    content = read_bytes(path)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST:
                raise ValueError("it unpacks to more than a gigabyte")
            return {
                member.filename.removesuffix(".npy"): _array(archive, member)
                for member in archive.infolist()
            }
    except Exception as error:  # zipfile's, zlib's, numpy's and those of Python's tokenizer
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} is damaged or no {what}: {reason[:200]}") from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """Return one array, read only after its shape fits the bytes that are there."""
    # One byte more than claimed tells a member that is longer than its entry says.
    with archive.open(member) as packed:
        plain = packed.read(member.file_size + 1)
    if len(plain) != member.file_size:
        raise ValueError(f"{member.filename} is not as long as it should be")
    memory = io.BytesIO(plain)
    version = npy.read_magic(memory)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"{member.filename} is an array of version {version}")
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, kind = read(memory)
    if kind.hasobject:
        raise ValueError(f"{member.filename} holds Python objects")
    if any(n < 0 for n in shape) or math.prod(shape) * kind.itemsize != len(plain) - memory.tell():
        raise ValueError(f"{member.filename} claims the shape {shape} and has other bytes")
    memory.seek(0)
    array: NDArray[Any] = npy.read_array(memory, allow_pickle=False)
    return array


def require_finite(arrays: dict[str, NDArray[Any]], limit: float = 1e6) -> None:
    """Refuse arrays with NaN, infinity or numbers beyond all measure.

    Raises:
        ValueError: that names the array.
    """
    for name, array in arrays.items():
        if array.dtype.kind in "fiu" and array.size and not np.abs(array).max() <= limit:
            raise ValueError(f"{name} holds NaN, infinity or values beyond {limit:g}")
