"""Checksums of MCAP files: written into bags of ours, and that of the index checked in any.

The library that writes bags leaves them zero, which means "not checked": a flipped bit would go
unnoticed. Places and meanings: MCAP specification, records Chunk, Data End and Footer.
"""

import struct
import zlib
from pathlib import Path
from typing import BinaryIO

from rosbags.rosbag2.storage_mcap import decompress

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
"""Kind and length of a record."""
_CHUNK = struct.Struct("<QQQI")
"""First and last time, size and checksum of what a chunk holds."""
_FOOTER = struct.Struct("<QQI")
"""Places of the summary and of its offsets, and the summary's checksum."""
_CHUNK_KIND, _END_KIND = 0x06, 0x0F
_TAIL = _HEAD.size + _FOOTER.size + len(_MAGIC)
_LARGEST_SUMMARY = 256 << 20


def write_checksums(path: Path) -> None:
    """Fill in the checksums of each chunk and of the summary of a finished MCAP file."""
    with path.open("rb+") as file:
        file.seek(len(_MAGIC))
        while head := file.read(_HEAD.size):
            kind, length = _HEAD.unpack(head)
            body = file.tell()
            if kind == _END_KIND:
                break
            if kind == _CHUNK_KIND:
                _write_chunk_checksum(file, length)
            file.seek(body + length)
        _write_summary_checksum(file)


def _write_chunk_checksum(file: BinaryIO, length: int) -> None:
    start = file.tell()
    content = file.read(length)
    *_, size, _ = _CHUNK.unpack_from(content)
    (letters,) = struct.unpack_from("<I", content, _CHUNK.size)
    name_end = _CHUNK.size + 4 + letters
    compression = content[_CHUNK.size + 4 : name_end].decode()
    plain = decompress(content[name_end + 8 :], compression, size, 0)
    file.seek(start + _CHUNK.size - 4)
    file.write(struct.pack("<I", zlib.crc32(plain)))


def _write_summary_checksum(file: BinaryIO) -> None:
    summary = _summary(file)
    if summary is not None:
        file.seek(-len(_MAGIC) - 4, 2)
        file.write(struct.pack("<I", zlib.crc32(summary[0])))


def check_summary(path: Path) -> None:
    """Refuse an MCAP file whose index does not fit its checksum; files without one pass.

    Raises:
        ValueError: if the index is damaged.
    """
    with path.open("rb") as file:
        summary = _summary(file)
    if summary is not None and summary[1] and zlib.crc32(summary[0]) != summary[1]:
        raise ValueError(
            f"the index of {path} is damaged: frames would be missing unseen; "
            f"rebuild the file with 'mcap recover {path}' or record it again"
        )


def _summary(file: BinaryIO) -> tuple[bytes, int] | None:
    """Return the bytes that the summary's checksum covers, and the checksum; None without any."""
    end = file.seek(0, 2)
    if end < _TAIL + len(_MAGIC):
        return None
    file.seek(end - _TAIL)
    tail = file.read(_TAIL)
    start, _, checksum = _FOOTER.unpack_from(tail, _HEAD.size)
    covered = end - len(_MAGIC) - 4
    if not 0 < start < covered or covered - start > _LARGEST_SUMMARY:
        return None
    file.seek(start)
    return file.read(covered - start), checksum
