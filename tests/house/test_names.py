"""Each name means one thing, and no folder is too large to see at a glance."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODULES = [
    path
    for package in sorted((ROOT / "src").glob("intent_*"))
    for path in (package / package.name).rglob("*.py")
]
SHARED = {"__init__", "convert", "benchmark"}
"""Names that every package has for the same thing."""
MOST_FILES = 15


def test_no_module_name_is_used_twice() -> None:
    places = defaultdict(list)
    for path in MODULES:
        if path.stem not in SHARED:
            places[path.stem].append(str(path.relative_to(ROOT)))
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_no_class_name_is_used_twice() -> None:
    places = defaultdict(list)
    for path in MODULES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                places[node.name].append(str(path.relative_to(ROOT)))
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_no_folder_of_source_holds_more_files_than_one_looks_through() -> None:
    counts: dict[str, int] = defaultdict(int)
    for path in MODULES:
        counts[str(path.parent.relative_to(ROOT))] += path.stem != "__init__"
    assert {folder: count for folder, count in counts.items() if count > MOST_FILES} == {}


def test_doors_only_lead_somewhere() -> None:
    doors = [path for path in MODULES if len(path.relative_to(ROOT).parts) == 4]
    long = {
        path.stem: len(path.read_text(encoding="utf-8").splitlines())
        for path in doors
        if path.stem != "__init__"
    }
    assert {name: lines for name, lines in long.items() if lines > 10} == {}
