"""The most CPU time that the recognizer takes for one frame, over all kinds of frames.

Rendered scenes full of things, views of tables from anywhere, frames turned upside down, noise,
and every real frame at hand: objects on tables, hands, whole rooms.
"""

import os
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from intent_perception.bags.bag_files import read_frames
from intent_perception.basics.checked_files import read_json
from intent_perception.geometry.camera import KINECT, Camera, RgbdFrame
from intent_perception.geometry.coded_images import read_picture
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import Recognizer
from intent_perception.workshop.figures.benchmark_plan import Plan
from intent_perception.workshop.figures.real_scenes import COUNTED, ycb_frame
from intent_perception.workshop.scenes.table_scenes import tabletop_scene
from intent_perception.workshop.scenes.table_views import table_views

_SR305 = Camera(640, 480, 476.007, 476.007, 313.683, 242.755)
_SR305_UNIT = 0.000125
_EVERY = 25  # of the frames of a recording, one in so many
_MOST = 4  # frames of one recording
_CROWD = 14  # things in the fullest scene


def worst_frame(plan: Plan, count: int) -> dict[str, Any]:
    """Return the CPU time of the slowest frame, its name, and the slowest of each kind [s].

    Args:
        plan: seed and data.
        count: rendered frames of each kind.
    """
    recognizer = Recognizer(ObjectDatabase.load())
    slowest: dict[str, tuple[float, str]] = {}
    for number, (kind, name, frame) in enumerate(_frames(plan, count)):
        if number == 0:
            recognizer.step(frame)  # compiles
        recognizer.reset()
        start = time.process_time()
        recognizer.step(frame)
        seconds = time.process_time() - start
        slowest[kind] = max(slowest.get(kind, (0.0, "")), (seconds, name))
    worst = max(slowest.values())
    return {
        "worst_frame_cpu_s": worst[0],
        "worst_frame": worst[1],
        "worst_frame_of": {kind: round(seconds, 3) for kind, (seconds, _) in slowest.items()},
    }


def _frames(plan: Plan, count: int) -> Iterator[tuple[str, str, RgbdFrame]]:
    """Yield kind, name and frame of all that is tried."""
    known, clutter = list(ObjectDatabase.load()), list(ObjectDatabase.clutter())
    for number in range(count):
        seed = plan.seed + number
        rng = np.random.default_rng(seed)
        chosen = rng.choice(len(known), _CROWD if number % 2 else 6, replace=False)
        crowd = tabletop_scene([*(known[k] for k in chosen), *clutter[: number % 5]], rng).frame
        yield "crowded", f"crowd {seed}", crowd
        yield "upside down", f"crowd {seed} upside down", _upside_down(crowd)
        yield "noise", f"noise {seed}", _noise(rng, number)
    for number, view in enumerate(table_views(plan.seed, count, [*known, *clutter])):
        yield "any side", f"view {plan.seed + number} {view.placement}", view.frame
    for kind, name, frame in _real(plan.data):
        yield kind, name, frame
        yield f"{kind}, upside down", f"{name} upside down", _upside_down(frame)


def _noise(rng: np.random.Generator, number: int) -> RgbdFrame:
    """Return a frame of nothing: fine, coarse or wavy depth."""
    size = (480, 640)
    coarse = rng.uniform(0.4, 1.6, (480 >> number % 6, 640 >> number % 6)).astype(np.float32)
    depth = cv2.resize(coarse, size[::-1], interpolation=cv2.INTER_CUBIC)
    depth[rng.random(size) < 0.1] = 0.0
    color = rng.integers(0, 255, (*size, 3), dtype=np.uint8)
    return RgbdFrame(0, color, np.clip(depth, 0.0, 4.0), KINECT)


def _upside_down(frame: RgbdFrame) -> RgbdFrame:
    color, depth = frame.color[::-1, ::-1], frame.depth[::-1, ::-1]
    return RgbdFrame(0, np.ascontiguousarray(color), np.ascontiguousarray(depth), frame.camera)


def _real(data: Path) -> Iterator[tuple[str, str, RgbdFrame]]:
    folder = data / "recognizer"
    if (folder / "ycbv_posecnn_demo").is_dir():
        for number in COUNTED:
            yield "ycb", f"ycb {number}", ycb_frame(folder / "ycbv_posecnn_demo", number)
    for path in sorted((folder / "nv_realsense").glob("*_depth.png")):
        stored = read_json(path.with_name(path.name.replace("_depth.png", "_camera.json")))
        color = read_picture(path.with_name(path.name.replace("_depth", "_color")), 1)
        camera = Camera.from_matrix(stored["K"], stored["width"], stored["height"])
        raw = read_picture(path, cv2.IMREAD_UNCHANGED).astype(np.float32)
        depth = raw * np.float32(stored["depth_unit_m"])
        yield "realsense", path.stem, RgbdFrame(0, color[..., ::-1].copy(), depth, camera)
    for path in sorted((data / "hands" / "sr305_gestures").rglob("*.png")):
        raw = read_picture(path, cv2.IMREAD_UNCHANGED)
        grey = np.zeros((*raw.shape, 3), np.uint8)
        depth = raw.astype(np.float32) * np.float32(_SR305_UNIT)
        yield "sr305", path.stem, RgbdFrame(0, grey, depth, _SR305)
    recordings = Path(os.environ.get("INTENT_REAL_HANDS", "out/real/hands"))
    for bag in sorted(recordings.glob("*/metadata.yaml")):
        frames = islice(read_frames(bag.parent), 0, _EVERY * _MOST, _EVERY)
        for number, frame in enumerate(frames):
            yield "hands", f"{bag.parent.name} {number * _EVERY}", frame
