"""Files of others are measured before they are believed: kind, size, depth, then content."""

import gzip
import io
import json
import os
import stat
import zlib
from pathlib import Path
from typing import Any

import yaml

_LARGEST = 512 << 20
"""Most bytes of a file that is read at once, packed or unpacked."""
_LARGEST_TEXT = 32 << 20
_DEEPEST = 60
"""Levels of lists in lists that a description may have."""
_LONGEST = 1_000_000
"""Values of a YAML file after its aliases are written out."""


def read_bytes(path: Path | str, largest: int = _LARGEST) -> bytes:
    """Return the content of a regular file.

    Raises:
        ValueError: if it is missing, no regular file (a pipe would never end), unreadable or too
            large.
    """
    place = Path(path)
    try:
        # Opening a pipe waits for a writer unless told not to.
        with open(os.open(place, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise ValueError(f"{place} is no file but a folder, pipe or device: give a file")
            if status.st_size > largest:
                raise ValueError(f"{place} has {status.st_size >> 20} MB, more than is read here")
            return file.read(largest)
    except OSError as error:
        raise ValueError(f"cannot read {place}: {error.strerror or error}") from error


def read_text(path: Path | str, largest: int = _LARGEST_TEXT) -> str:
    """Return the text of a UTF-8 file, unpacked where its name ends in .gz.

    Raises:
        ValueError: if it cannot be read, is no text, or too large.
    """
    content = read_bytes(path, largest)
    if Path(path).suffix == ".gz":
        content = _unpacked(path, content, largest)
    try:
        text = content.decode()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text in UTF-8: {error}") from error
    if "\0" in text:
        raise ValueError(f"{path} is no text: it holds zero bytes (damaged?)")
    return text


def _unpacked(path: Path | str, content: bytes, largest: int) -> bytes:
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            plain = file.read(largest + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    if len(plain) > largest:
        raise ValueError(f"{path} unpacks to more than {largest >> 20} MB: it is not read")
    return plain


def read_json(path: Path | str) -> Any:
    """Return the content of a JSON file; NaN and Infinity are numbers in it.

    Raises:
        ValueError: if it cannot be read or is no JSON.
    """
    try:
        return json.loads(read_text(path))
    except RecursionError as error:
        raise ValueError(f"{path} is nested too deeply") from error
    except json.JSONDecodeError as error:
        raise ValueError(f"{path} is no JSON: {error}") from error


def read_yaml(path: Path | str) -> Any:
    """Return the content of a YAML file of plain values.

    Raises:
        ValueError: if it cannot be read, is no YAML, or grows without measure by its aliases.
    """
    text = read_text(path)
    try:
        _measure(path, text)
        return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (yaml.YAMLError, RecursionError, OverflowError) as error:
        raise ValueError(f"{path} is no YAML: {_in_one_line(error)}") from error
    except ValueError as error:
        raise ValueError(f"cannot read {path}: {error}") from error


def _in_one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _measure(path: Path | str, text: str) -> None:
    """Refuse YAML that is too deep, or of which few aliases make very many values."""
    sizes: dict[str, int] = {}
    open_ones: list[tuple[str | None, int]] = []
    total = 0
    for event in yaml.parse(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        if isinstance(event, yaml.AliasEvent):
            total += sizes.get(event.anchor, 1)
        elif isinstance(event, yaml.CollectionStartEvent):
            total += 1
            open_ones.append((event.anchor, total))
        elif isinstance(event, yaml.ScalarEvent):
            total += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_ones.pop()
            if anchor:
                sizes[anchor] = total - before + 1
        if total > _LONGEST or len(open_ones) > _DEEPEST:
            raise ValueError(
                f"more than {_LONGEST} values or {_DEEPEST} levels: write it without aliases"
            )
