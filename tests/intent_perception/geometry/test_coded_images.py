"""Depth images of 16 bits, decoded by our own kernel, are those that OpenCV decodes."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from intent_perception.geometry.coded_images import decode_depth_png

SHAPES = (1, 1), (3, 5), (48, 7), (120, 160)


def encoded(image, *settings):
    done, data = cv2.imencode(".png", image, list(settings))
    assert done
    return data.tobytes()


def depth(shape, seed):
    """Return depth as cameras measure it: smooth, noisy, with holes."""
    rng = np.random.default_rng(seed)
    rows, columns = np.indices(shape)
    image = 700 + 3 * rows + columns + rng.normal(0.0, 2.0, shape)
    image[rng.random(shape) < 0.1] = 0.0
    return image.astype(np.uint16)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("strategy", [cv2.IMWRITE_PNG_STRATEGY_DEFAULT, 1, 2, 3, 4])
def test_depth_is_decoded_as_opencv_does(shape, strategy):
    image = depth(shape, strategy)
    data = encoded(image, cv2.IMWRITE_PNG_STRATEGY, strategy, cv2.IMWRITE_PNG_COMPRESSION, 6)
    np.testing.assert_array_equal(decode_depth_png(data), image)


def filtered(image, kind):
    """Return a PNG in which every row has one filter (W3C recommendation, section 9)."""
    rows = image.astype(">u2").view(np.uint8).astype(int)
    left, up, corner = (np.zeros_like(rows) for _ in range(3))
    left[:, 2:], up[1:], corner[1:, 2:] = rows[:, :-2], rows[:-1], rows[:-1, :-2]
    to = [np.abs(left + up - corner - neighbour) for neighbour in (left, up, corner)]
    paeth = np.choose(np.argmin(to, axis=0), [left, up, corner])
    expected = [0, left, up, (left + up) // 2, paeth][kind]
    coded = np.insert((rows - expected) % 256, 0, kind, axis=1).astype(np.uint8)

    def chunk(name, content):
        check = zlib.crc32(content, zlib.crc32(name))
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 16, 0, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(coded.tobytes()))
    return b"\x89PNG\r\n\x1a\n" + data + chunk(b"IEND", b"")


@pytest.mark.parametrize("kind", range(5))
def test_every_filter_is_undone(kind):
    image = np.random.default_rng(kind).integers(0, 65536, (9, 13)).astype(np.uint16)
    data = filtered(image, kind)
    np.testing.assert_array_equal(decode_depth_png(data), image)
    np.testing.assert_array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), -1), image)


def test_damaged_depth_is_refused():
    data = encoded(depth((48, 64), 0))
    for place in (20, 60, len(data) // 2, len(data) - 14):
        damaged = bytearray(data)
        damaged[place] ^= 0x55
        with pytest.raises(ValueError, match="PNG"):
            decode_depth_png(bytes(damaged))
    for length in (0, 7, 40, len(data) - 6):
        with pytest.raises(ValueError):
            decode_depth_png(data[:length])


@pytest.mark.parametrize("channels", [1, 3])
def test_images_of_8_bits_are_no_depth(channels):
    image = np.full((6, 8, channels), 90, np.uint8)
    with pytest.raises(ValueError, match="16-bit depth"):
        decode_depth_png(encoded(image))
