"""Seeded damage: to bytes, to texts, to arrays. Every function takes a generator and a content."""

import io
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

Rng = np.random.Generator
WILD_NUMBERS = ("nan", "inf", "-inf", "1e300", "-1", "0", "1e-300", "99999999999999999999", "yes")
WILD_TEXTS = ("", "\x07", "é☃", "'", '"', "null", "[]", "{}", "true", "-", "#", "../../etc/passwd")


def damaged_bytes(rng: Rng, content: bytes) -> bytes:
    """Return content with one damage of the kinds that disks, downloads and bugs make."""
    changed = bytearray(content)
    place = int(rng.integers(len(changed)))
    length = int(min(rng.geometric(0.02), len(changed) - place))
    match int(rng.integers(8)):
        case 0:
            changed[place] ^= 1 << int(rng.integers(8))
        case 1:
            del changed[place:]
        case 2:
            changed[place : place + length] = bytes(length)
        case 3:
            changed[place : place + length] = rng.bytes(length)
        case 4:
            changed[place:place] = rng.bytes(length)
        case 5:
            del changed[place : place + length]
        case 6:
            changed[place : place + 4] = struct.pack("<I", int(rng.integers(2**32)))
        case _:
            other = int(rng.integers(len(changed)))
            changed[place : place + length] = changed[other : other + length]
    return bytes(changed)


def damaged_text(rng: Rng, text: str) -> str:
    """Return a text with one damage of the kinds that people and editors make."""
    lines = text.split("\n")
    row = int(rng.integers(len(lines)))
    match int(rng.integers(9)):
        case 0:
            del lines[row]
        case 1:
            lines.insert(row, lines[int(rng.integers(len(lines)))])
        case 2 | 3 | 4:
            return _other_number(rng, text)
        case 5:
            lines[row] = "  " * int(rng.integers(4)) + lines[row].lstrip()
        case 6:
            lines[row] += str(rng.choice(WILD_TEXTS))
        case 7:
            place = int(rng.integers(len(text)))
            return text[:place] + str(rng.choice(WILD_TEXTS)) + text[place + 1 :]
        case _:
            return text[: int(rng.integers(len(text)))]
    return "\n".join(lines)


def _other_number(rng: Rng, text: str) -> str:
    """Return the text with one of its numbers replaced by one that is none, or wild."""
    digits = [k for k, letter in enumerate(text) if letter.isdigit()]
    if not digits:
        return text + str(rng.choice(WILD_NUMBERS))
    start = end = int(rng.choice(digits))
    number = set("0123456789.e-+")
    while start > 0 and text[start - 1] in number:
        start -= 1
    while end < len(text) and text[end] in number:
        end += 1
    return text[:start] + str(rng.choice(WILD_NUMBERS)) + text[end:]


def damaged_arrays(rng: Rng, arrays: dict[str, Any]) -> bytes:
    """Return an .npz file of arrays of which one has been changed, or the file itself."""
    if rng.random() < 0.4:
        return damaged_bytes(rng, packed(arrays))
    changed = dict(arrays)
    name = str(rng.choice(sorted(changed)))
    array = np.array(changed[name])
    match int(rng.integers(10)):
        case 0:
            del changed[name]
        case 1:
            changed[name + "_"] = changed.pop(name)
        case 2:
            changed[name] = array[None]
        case 3:
            changed[name] = array.ravel()[:-1] if array.size else np.zeros(3)
        case 4:
            changed[name] = array.T if array.ndim > 1 else np.zeros((2, 2))
        case 5:
            kinds = ["U20", "c16", "u1", "?", "f2", "S3"] if array.dtype.kind in "fiub" else ["S3"]
            with np.errstate(all="ignore"):
                changed[name] = array.astype(rng.choice(kinds))
        case 6:
            return _false_header(rng, changed, name)
        case _:
            changed[name] = wild(rng, array)
    return packed(changed)


def wild(rng: Rng, array: Any) -> Any:
    """Return an array with one value, or all, replaced."""
    if array.dtype.kind not in "fiu" or not array.size:
        return np.zeros_like(array)
    value = rng.choice([np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0, 1e6])
    changed = array.astype(np.float64) if array.dtype.kind == "f" else array.copy()
    if array.dtype.kind != "f":
        value = rng.choice([-1, 0, 10**6, 2**31 - 1])
        value = min(max(value, np.iinfo(array.dtype).min), np.iinfo(array.dtype).max)
    if rng.random() < 0.3:
        changed[...] = value
    else:
        changed.reshape(-1)[int(rng.integers(array.size))] = value
    return changed


def _false_header(rng: Rng, arrays: dict[str, Any], name: str) -> bytes:
    """Return a file of which one array claims a shape of terabytes, or holds no array at all."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as archive:
        for other, array in arrays.items():
            plain = io.BytesIO()
            np.lib.format.write_array(plain, np.asarray(array), allow_pickle=False)
            content = plain.getvalue()
            if other == name:
                shape = rng.choice(["(1000000000000,)", "(2, -1)", "(3,", "'x'", "()"])
                head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
                head += b" " * (118 - len(head) - 1) + b"\n"
                content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + content[128:]
            archive.writestr(f"{other}.npy", content)
    return memory.getvalue()


def packed(arrays: dict[str, Any]) -> bytes:
    """Return an .npz file of arrays."""
    memory = io.BytesIO()
    np.savez_compressed(memory, **arrays)
    return memory.getvalue()


def damaged_values(rng: Rng, message: Any, leaves: Callable[[Any], list[tuple[Any, str]]]) -> str:
    """Change one field of a message in place; return its name."""
    owner, name = leaves(message)[int(rng.integers(len(leaves(message))))]
    value = getattr(owner, name)
    numbers = [float("nan"), float("inf"), -1.0, 0.0, 1e300, -1e6, 57.3]
    if isinstance(value, bool):
        changed: Any = not value
    elif isinstance(value, int):
        changed = int(rng.choice([0, 1, 255, 65535]))
    elif isinstance(value, float):
        changed = float(rng.choice(numbers))
    elif isinstance(value, str):
        changed = str(rng.choice(["", "knife", "é☃", "x" * 1000, "object_0"]))
    else:
        changed = np.array(value, dtype=np.float64)
        match int(rng.integers(4)):
            case 0:
                changed = changed[:-1]
            case 1:
                changed = np.concatenate([changed, [1.0]])
            case 2:
                changed[...] = float(rng.choice(numbers))
            case _:
                if len(changed):
                    changed[int(rng.integers(len(changed)))] = float(rng.choice(numbers))
        changed = changed.tolist()
    setattr(owner, name, changed)
    return name
