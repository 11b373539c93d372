"""Bags: their bytes, their metadata, the bytes of a message, and the values in one."""

import hashlib
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tests.faults import mutation
from tests.faults.mutation import Rng
from tests.faults.outcome import Answer, Subject

from intent_perception.bags.bag_files import BagMessage, BagWriter, read_frames, read_messages
from intent_perception.bags.bag_images import STORE
from intent_perception.bags.playback import bundles
from intent_perception.geometry.camera import Camera, RgbdFrame

CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
FRAMES = 24
STEP = 33_000_000
_FORMS = (("compressedDepth", "jpeg"), ("16UC1", "raw"), ("32FC1", "raw"))


@cache
def whole_bag(form: int) -> Path:
    """Return a bag of several chunks, made once: noise does not compress."""
    rng = np.random.default_rng(form)
    path = Path(tempfile.mkdtemp(prefix="faults-")) / "bag"
    depth, color = _FORMS[form]
    with BagWriter(path, depth=depth, color=color) as writer:
        for k in range(FRAMES):
            image = rng.integers(0, 256, (120, 160, 3), dtype=np.uint8)
            metres = rng.integers(500, 1500, (120, 160)).astype(np.float32) / np.float32(1000.0)
            writer.write(RgbdFrame(10**15 + k * STEP, image, metres, CAMERA))
    return path


def digest(frame: RgbdFrame) -> str:
    content = frame.color.tobytes() + frame.depth.tobytes() + repr(frame.camera).encode()
    return hashlib.sha256(content).hexdigest()


@cache
def true_frames(form: int) -> dict[int, str]:
    return {frame.stamp: digest(frame) for frame in read_frames(whole_bag(form))}


def _copied(rng: Rng, folder: Path) -> tuple[Path, int]:
    form = int(rng.integers(len(_FORMS)))
    shutil.copytree(whole_bag(form), folder / "bag")
    (folder / "form").write_text(f"{form} -1")
    return folder / "bag", form


def _damaged_file(rng: Rng, folder: Path) -> Path:
    bag, _ = _copied(rng, folder)
    file = bag / "bag.mcap"
    file.write_bytes(mutation.damaged_bytes(rng, file.read_bytes()))
    return bag


def _damaged_metadata(rng: Rng, folder: Path) -> Path:
    bag, _ = _copied(rng, folder)
    file = bag / "metadata.yaml"
    if rng.random() < 0.1:
        file.unlink()
    else:
        file.write_text(mutation.damaged_text(rng, file.read_text()))
    return bag


def _rewritten(rng: Rng, folder: Path, change: Any) -> Path:
    """Write a bag in which one message is changed, with right checksums."""
    form = int(rng.integers(len(_FORMS)))
    number = int(rng.integers(3 * FRAMES))
    (folder / "form").write_text(f"{form} {number // 3}")
    with BagWriter(folder / "bag", depth=_FORMS[form][0], color=_FORMS[form][1]) as writer:
        for k, message in enumerate(read_messages(whole_bag(form))):
            writer.append_raw(change(rng, message) if k == number else message)
    return folder / "bag"


def _bytes_changed(rng: Rng, message: BagMessage) -> BagMessage:
    head = int(rng.choice([16, 60, 120, len(message.data)]))
    changed = mutation.damaged_bytes(rng, message.data[:head]) + message.data[head:]
    return BagMessage(message.topic, message.type, message.received, changed)


def _leaves(message: Any) -> list[tuple[Any, str]]:
    own = [(message.header.stamp, "sec"), (message.header.stamp, "nanosec")]
    own += [(message.header, "frame_id")]
    names = ("height", "width", "step", "encoding", "format", "is_bigendian", "k", "p", "d")
    return own + [(message, name) for name in names if hasattr(message, name)]


def _values_changed(rng: Rng, message: BagMessage) -> BagMessage:
    decoded = message.decoded()
    while True:
        owner, name = _leaves(decoded)[int(rng.integers(len(_leaves(decoded))))]
        value = getattr(owner, name)
        if isinstance(value, str):
            new: Any = str(rng.choice(["", "32FC1", "rgb8", "bayer_rggb8", "16UC1", "é" * 50]))
        elif isinstance(value, int):
            limit = 2**7 if name == "is_bigendian" else 2**31
            new = int(rng.choice([0, 1, 2, value + 1, limit - 1]))
            new = new % limit
        else:
            new = np.array(value, dtype=np.float64)
            wild = [np.nan, np.inf, 0.0, -1.0, 1e300, 1e-300]
            new[int(rng.integers(len(new))) :] = float(rng.choice(wild))
        setattr(owner, name, new)
        data = bytes(STORE.serialize_cdr(decoded, message.type))
        return BagMessage(message.topic, message.type, message.received, data)


def use_bag(path: Path) -> Answer:
    """Read a bag as the commands and as the player do; compare every untouched frame."""
    form, touched = (int(word) for word in (path.parent / "form").read_text().split())
    said: list[str] = []
    right = dict(true_frames(form))
    own = sorted(right)[touched] if touched >= 0 else None
    list(bundles(str(path)))
    sane, seen = True, set()
    for frame in read_frames(path, on_bad_frame=said.append):
        seen.add(frame.stamp)
        if own is not None and abs(frame.stamp - own) < STEP // 2:
            continue  # a damaged message with a right checksum is another picture
        sane &= right.get(frame.stamp) == digest(frame)
    missing = set(right) - seen - {own}
    return Answer(sane and (not missing or bool(said)), left_out=bool(said))


BAG_SUBJECTS = (
    Subject("bag, its bytes", _damaged_file, use_bag),
    Subject("bag, its metadata", _damaged_metadata, use_bag),
    Subject("message, its bytes", lambda r, f: _rewritten(r, f, _bytes_changed), use_bag),
    Subject("message, its values", lambda r, f: _rewritten(r, f, _values_changed), use_bag),
)
