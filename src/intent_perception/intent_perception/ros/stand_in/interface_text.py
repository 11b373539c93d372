"""The definition of a message type as text, nested types below their fields."""

import re
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from intent_perception.basics.checked_files import read_text


def interface_text(kind: str) -> str:
    """Return a definition, with the fields of each nested message indented by one tab more.

    Args:
        kind: sensor_msgs/msg/Image or sensor_msgs/Image.

    Raises:
        ValueError: if there is no such type.
    """
    return "".join(f"{line}\n" for line in _lines(kind))


def _lines(kind: str) -> list[str]:
    package, _, name = re.sub("/(msg|srv|action)/", "/", kind).partition("/")
    found: list[str] = []
    for line in read_text(_file(package, name, kind)).splitlines():
        found.append(line)
        nested = _nested(package, line)
        if not nested:
            continue
        inner = [part for part in _lines(nested) if part.strip() and part.strip()[0] != "#"]
        found += [f"\t{part}" for part in inner]
    return found


def _nested(package: str, line: str) -> str:
    """Return the message type of a field, "" where a line has none."""
    field = re.match(r"([A-Za-z]\w*(?:/\w+)?)(\[[^]]*\])?\s+\w+", line)
    if field is None or not field[1].rpartition("/")[2][0].isupper():
        return ""
    return field[1] if "/" in field[1] else f"{package}/{field[1]}"


def nested_types(kind: str) -> list[str]:
    """Return the types in a message, e.g. geometry_msgs/msg/Point, the innermost first."""
    package = kind.partition("/")[0]
    found: list[str] = []
    for line in read_text(interface_file(kind)).splitlines():
        nested = _nested(package, line)
        if nested:
            owner, _, name = nested.partition("/")
            one = f"{owner}/msg/{name}"
            found += [*nested_types(one), one]
    return list(dict.fromkeys(found))


def interface_file(kind: str) -> Path:
    """Return the file that defines a message type such as sensor_msgs/msg/Image."""
    package, _, name = kind.partition("/msg/")
    return _file(package, name, kind)


def _file(package: str, name: str, kind: str) -> Path:
    try:
        share = Path(get_package_share_directory(package))
    except (PackageNotFoundError, ValueError) as error:
        raise ValueError(f"{kind}: there is no package {package!r} in this environment") from error
    for folder in ("msg", "srv", "action"):
        file = share / folder / f"{name}.{folder}"
        if file.is_file():
            return file
    raise ValueError(f"{kind} is no interface of the package {package}")
