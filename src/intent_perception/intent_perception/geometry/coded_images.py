"""JPEG and PNG to arrays and back; the size that an image claims is checked before decoding.

Depth of 16 bits comes with every frame of a compressed camera: OpenCV takes 5 ms for 640 x 480,
half of it for inflating and half for undoing the filters of PNG (W3C recommendation, section 9);
ISA-L and a kernel take 2 to 3 ms. The values are the same, and OpenCV decodes whatever is anything
but plain grey of 16 bits.
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from intent_perception.basics.checked_files import read_bytes
from intent_perception.basics.kernels import exact_kernel
from intent_perception.basics.safe_files import write_bytes

MOST_PIXELS = 50_000_000
"""Larger images are refused: no RGB-D camera has them, and a small file may claim any size."""
_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
_JPEG_END = b"\xff\xd9"
_PNG_SIZE = struct.Struct(">II")
_PNG_HEADER = struct.Struct(">IIBBBBB")
_PLAIN = 16, 0, 0, 0, 0
"""Bits, grey, and the usual compression, filters and order of rows."""
_CHUNK = struct.Struct(">I4s")
_INFLATING: type[Exception] = isal_zlib.error  # type: ignore[assignment]
_BYTES = 2
"""Of a pixel of depth."""
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


def decode_depth_png(data: bytes) -> NDArray[np.uint16]:
    """Return the values (H, W) of a PNG of 16-bit depth.

    Raises:
        ValueError: if it is no such image, damaged, or larger than `MOST_PIXELS`.
    """
    plain = _plain_image(data)
    image = decode_image(data, cv2.IMREAD_UNCHANGED) if plain is None else plain
    if image.dtype != np.uint16 or image.ndim != 2:
        raise ValueError(
            f"expected a PNG of 16-bit depth, got {image.dtype} of {image.shape}: depth that was "
            "compressed like colour is lost; record it raw or as compressedDepth"
        )
    return image


def rehearse_depth() -> None:
    """Decode a small depth image, so that the first real one finds everything loaded."""
    done, data = cv2.imencode(".png", np.ones((2, 2), np.uint16))
    if done:
        decode_depth_png(data.tobytes())


def _plain_image(data: bytes) -> NDArray[np.uint16] | None:
    """Return the values (H, W) of plain grey of 16 bits; None where it is anything else."""
    if not data.startswith(_PNG):
        return None
    packed: list[memoryview] = []
    width = height = 0
    for kind, content in _png_chunks(data):
        if kind == b"IHDR" and len(content) == _PNG_HEADER.size:
            width, height, *rest = _PNG_HEADER.unpack(content)
            if tuple(rest) != _PLAIN or width * height > MOST_PIXELS:
                return None
        elif kind == b"IDAT":
            packed.append(content)
        elif kind == b"IEND":
            return _unpacked(b"".join(packed), int(height), int(width))
        elif not kind[0] & 0x20:  # another chunk that must be understood
            return None
    return None


def _unpacked(packed: bytes, height: int, width: int) -> NDArray[np.uint16] | None:
    size = height * (1 + _BYTES * width)
    try:
        raw = isal_zlib.decompressobj().decompress(packed, size + 1)
    except _INFLATING:
        return None
    if len(raw) != size or not size:
        return None
    filtered = np.frombuffer(raw, np.uint8).reshape(height, 1 + _BYTES * width)
    values = np.empty((height, _BYTES * width), np.uint8)
    if not _undo_filters(filtered, values):
        return None
    return values.view(">u2").astype(np.uint16)


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
        for _ in _png_chunks(data):
            pass  # each is held against its checksum
        width, height = _PNG_SIZE.unpack_from(data, 16)
        return int(height), int(width)
    if data.startswith(_JPEG):
        if data.rfind(_JPEG_END) < 0:
            raise ValueError("expected a whole JPEG image, this one is cut off")
        return _jpeg_size(data)
    raise ValueError(f"expected a JPEG or PNG image, cannot decode {len(data)} bytes")


def _png_chunks(data: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Yield kind and content of the chunks of a PNG, up to its end.

    Raises:
        ValueError: where a chunk does not fit its checksum (decoders show what they can), or where
            the end is missing.
    """
    place, view = len(_PNG), memoryview(data)
    while place + 12 <= len(data):
        length, kind = _CHUNK.unpack_from(data, place)
        end = place + 8 + length
        if end + 4 > len(data):
            break
        if zlib.crc32(view[place + 4 : end]) != int.from_bytes(view[end : end + 4], "big"):
            raise ValueError("expected a PNG image, its checksum does not fit (damaged)")
        yield kind, view[place + 8 : end]
        if kind == b"IEND":
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


@exact_kernel
def _undo_filters(filtered: NDArray[np.uint8], values: NDArray[np.uint8]) -> bool:
    """Undo the filter of each row (H, 1 + 2W), named by its first byte; False: there is no such.

    `values`: (H, 2W), filled. Both bytes of a pixel go together: neither waits for the other.
    """
    count = values.shape[1]
    above = np.zeros(count, np.uint8)
    for row in range(len(values)):
        kind, source, target = filtered[row, 0], filtered[row, 1:], values[row]
        if kind == 0:
            target[:] = source
        elif kind == 1:
            high = low = np.uint8(0)
            for k in range(0, count, 2):
                high = np.uint8(source[k] + high)
                low = np.uint8(source[k + 1] + low)
                target[k], target[k + 1] = high, low
        elif kind == 2:
            for k in range(count):
                target[k] = source[k] + above[k]
        elif kind == 3:
            high = low = np.uint8(0)
            for k in range(0, count, 2):
                high = np.uint8(source[k] + ((np.int32(high) + np.int32(above[k])) >> 1))
                low = np.uint8(source[k + 1] + ((np.int32(low) + np.int32(above[k + 1])) >> 1))
                target[k], target[k + 1] = high, low
        elif kind == 4:
            left, left_low = np.int32(0), np.int32(0)
            corner, corner_low = np.int32(0), np.int32(0)
            for k in range(0, count, 2):
                up, up_low = np.int32(above[k]), np.int32(above[k + 1])
                left = (source[k] + _paeth(left, up, corner)) & 255
                left_low = (source[k + 1] + _paeth(left_low, up_low, corner_low)) & 255
                corner, corner_low = up, up_low
                target[k], target[k + 1] = left, left_low
        else:
            return False
        above = target
    return True


@exact_kernel
def _paeth(left: int, up: int, corner: int) -> int:
    """Return the neighbour that is nearest to left + up - corner."""
    to_left, to_up = abs(up - corner), abs(left - corner)
    to_corner = abs(left + up - 2 * corner)
    nearest = up if to_up <= to_corner else corner
    return left if to_left <= to_up and to_left <= to_corner else nearest
