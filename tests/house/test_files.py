"""Files are read and written in one place, where they are measured, and replaced when whole."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CALLS = {
    "np.load": "basics.array_files.read_arrays",
    "np.save": "basics.safe_files.write_arrays",
    "np.savez": "basics.safe_files.write_arrays",
    "np.savez_compressed": "basics.safe_files.write_arrays",
    "yaml.load": "basics.checked_files.read_yaml",
    "yaml.safe_load": "basics.checked_files.read_yaml",
    "json.load": "basics.checked_files.read_json",
    "json.dump": "basics.safe_files.write_json",
    "cv2.imread": "geometry.coded_images.read_picture",
    "cv2.imwrite": "geometry.coded_images.write_picture",
    "cv2.imdecode": "geometry.coded_images.decode_image",
    "gzip.open": "basics.checked_files.read_text",
    "shutil.rmtree": "basics.own_folder",
    ".write_text": "basics.safe_files.write_text",
    ".write_bytes": "basics.safe_files.write_bytes",
    ".read_text": "basics.checked_files.read_text",
    ".read_bytes": "basics.checked_files.read_bytes",
}
"""What a module must not call itself, and what does it instead."""
HOME = {"safe_files", "checked_files", "array_files", "own_folder", "coded_images", "bag_checksums"}
"""Modules that do it."""
OTHERS = {
    # Into folders of their own that vanish with the process.
    "stability": {".write_text"},
    "execution": {".write_text"},
    # Fetched archives are held against a checksum; rules are part of a fingerprint.
    "network_files": {".read_bytes"},
    "campaign": {".read_bytes"},
    # What the kernel tells of a process is no file with a size.
    "realtime_probe_node": {".read_text"},
    "live_messages": {".read_text"},
}
OWN_DATA = {"np.load", "cv2.imread", ".read_text"}
"""Workshops read what the project itself has made."""


def called(node: ast.Call) -> str:
    """Return "np.load" of such a call, ".read_text" of a method, "" of others."""
    if not isinstance(node.func, ast.Attribute):
        return ""
    owner, name = node.func.value, node.func.attr
    full = f"{owner.id}.{name}" if isinstance(owner, ast.Name) else ""
    return full if full in CALLS else f".{name}"


def test_no_module_reads_or_writes_files_by_itself() -> None:
    found = []
    for path in sorted((ROOT / "src").glob("intent_*/intent_*/**/*.py")):
        allowed = OTHERS.get(path.stem, set()) | (OWN_DATA if "workshop" in path.parts else set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = called(node) if isinstance(node, ast.Call) else ""
            if name in CALLS and path.stem not in HOME and name not in allowed:
                place = f"{path.relative_to(ROOT)}:{node.lineno}"
                found.append(f"{place}: {name}; use {CALLS[name]}")
    assert found == []
