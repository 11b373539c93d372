"""JPEG and PNG to arrays and back; the size that an image claims is checked before decoding."""

import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.checked_files import read_bytes
from intent_perception.basics.safe_files import write_bytes

MOST_PIXELS = 50_000_000
"""Larger images are refused: no RGB-D camera has them, and a small file may claim any size."""
_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
_JPEG_END = b"\xff\xd9"
_PNG_LENGTH = struct.Struct(">I")
_PNG_SIZE = struct.Struct(">II")
_JPEG_SIZE = struct.Struct(">HH")
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
"""Markers of JPEG segments that state the image's size."""


def decode_image(data: bytes, flags: int) -> NDArray[Any]:
    """Return the pixels of a JPEG or PNG image, as OpenCV's flags ask for them.

    Raises:
        ValueError: if it is neither, damaged, or larger than `MOST_PIXELS`.
    """
    data = bytes(data)
    height, width = _claimed_size(data)
    if height * width > MOST_PIXELS:
        raise ValueError(f"expected an image of a camera, this one claims {width} x {height}")
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error as error:
        raise ValueError(f"expected a compressed image, cannot decode it: {error}") from error
    if image is None:
        raise ValueError(f"expected a JPEG or PNG image, cannot decode {len(data)} bytes")
    return np.asarray(image)


def read_picture(path: Path, flags: int) -> NDArray[Any]:
    """Return the pixels of a JPEG or PNG file; ValueError names the file and what is wrong."""
    try:
        return decode_image(read_bytes(path), flags)
    except ValueError as error:
        message = str(error)
        raise ValueError(message if str(path) in message else f"{path}: {message}") from error


def write_picture(path: Path | str, image: NDArray[Any], quality: int = 95) -> None:
    """Write RGB (H, W, 3) as the file's name says; ValueError where that is impossible."""
    suffix = Path(path).suffix.lower() or ".png"
    settings = [cv2.IMWRITE_JPEG_QUALITY, quality] if suffix in (".jpg", ".jpeg") else []
    try:
        done, coded = cv2.imencode(suffix, np.ascontiguousarray(image[..., ::-1]), settings)
    except cv2.error:
        done = False
    if not done:
        raise ValueError(f"cannot write {path}: expected a name that ends in .png or .jpg")
    write_bytes(path, coded.tobytes())


def _claimed_size(data: bytes) -> tuple[int, int]:
    """Return the rows and columns that the header of an image states, if the image is whole."""
    if data.startswith(_PNG) and len(data) > 24:
        _check_png(data)
        width, height = _PNG_SIZE.unpack_from(data, 16)
        return int(height), int(width)
    if data.startswith(_JPEG):
        if data.rfind(_JPEG_END) < 0:
            raise ValueError("expected a whole JPEG image, this one is cut off")
        return _jpeg_size(data)
    raise ValueError(f"expected a JPEG or PNG image, cannot decode {len(data)} bytes")


def _check_png(data: bytes) -> None:
    """Refuse a PNG of which a part does not fit its checksum: decoders show what they can."""
    place = len(_PNG)
    while place + 12 <= len(data):
        (length,) = _PNG_LENGTH.unpack_from(data, place)
        end = place + 8 + length
        if end + 4 > len(data):
            break
        (stated,) = _PNG_LENGTH.unpack_from(data, end)
        if zlib.crc32(memoryview(data)[place + 4 : end]) != stated:
            raise ValueError("expected a PNG image, its checksum does not fit (damaged)")
        if data[place + 4 : place + 8] == b"IEND":
            return
        place = end + 4
    raise ValueError("expected a whole PNG image, this one is cut off")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    place = 2
    while place + 9 <= len(data):
        if data[place] != 0xFF:
            break
        marker = data[place + 1]
        if marker == 0xFF:  # padding
            place += 1
            continue
        if marker in _FRAMES:
            height, width = _JPEG_SIZE.unpack_from(data, place + 5)
            return int(height), int(width)
        place += 2
        if not 0xD0 <= marker <= 0xD9 and marker != 0x01:
            place += int.from_bytes(data[place : place + 2], "big")
    raise ValueError("expected a JPEG image, its size is not stated (damaged?)")
