"""The demonstration as pictures: what was recognised, and the hand that was tracked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from intent_imitation.demo.hand_mesh import hand_mesh
from intent_imitation.demo.mesh_pictures import (
    DrawnBody,
    Image,
    Tag,
    Window,
    annotate,
    overlay,
    window_around,
)
from intent_imitation.demo.run_record import DemoRecord, moments
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.transforms import inverse, transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects
from intent_tracking.scene.scene_state import SceneState

OBJECT_COLORS = (
    (0.13, 0.55, 0.93),
    (0.98, 0.66, 0.12),
    (0.62, 0.36, 0.86),
    (0.10, 0.70, 0.55),
    (0.90, 0.30, 0.35),
    (0.55, 0.60, 0.10),
)
HAND_COLOR = (0.96, 0.70, 0.54)
_SCALE = 2
_WIDTH = 1100


@dataclass(frozen=True, eq=False)
class Moment:
    """One picture of the tracked scene."""

    image: Image
    """The whole view, enlarged."""
    seconds: float
    """Time since the first frame [s]."""
    caption: str
    pixels: Array
    """(N, 2) corners of what is drawn, in pixels of the enlarged view."""


def picture_of_objects(
    frame: RgbdFrame,
    objects: RecognizedObjects,
    known: ObjectDatabase,
    numbers: Sequence[float | None] | None = None,
    marked: str | None = None,
) -> Image:
    """Return the frame with outline, name and a number at every recognised object.

    Args:
        frame: the image.
        objects: what was recognised in it.
        known: the database with their meshes.
        numbers: what is written at each object, None: nothing; default: the confidence.
        marked: id of an object to be filled in green.
    """
    bodies, weights = [], []
    for index, item in enumerate(objects.objects):
        color = MARKED_COLOR if item.id == marked else OBJECT_COLORS[index % len(OBJECT_COLORS)]
        bodies.append(DrawnBody((item.shape or known[item.model]).mesh, item.T_table_object, color))
        weights.append(0.6 if item.id == marked else 0.32)
    canvas = overlay(frame.color, frame.camera, objects.T_table_camera, bodies, weights, _SCALE)
    corners = [_pixels(frame.camera, objects.T_table_camera, body) for body in bodies]
    size = (canvas.shape[1], canvas.shape[0])
    window = window_around(np.concatenate(corners) if corners else np.zeros((0, 2)), size, 0.45)
    zoom = _WIDTH / window.width
    written = numbers or [item.confidence for item in objects.objects]
    tags = []
    for item, body, corner, number in zip(objects.objects, bodies, corners, written, strict=True):
        middle = float(corner[:, 0].min() + corner[:, 0].max()) / 2 - window.left
        top = float(corner[:, 1].min()) - window.top
        words = shown_name(item) + ("" if number is None else f"  {number:.2f}")
        tags.append(Tag(words, body.color, (middle * zoom, top * zoom)))
    return annotate(window.cut(canvas, _WIDTH), tags)


def shown_name(item: RecognizedObject) -> str:
    """Return what an object is called in pictures: its id, and what an estimated one is."""
    if item.object_class and item.shape is None:
        return item.id
    return f"{item.id}: {item.object_class or 'unknown thing'}"


MARKED_COLOR = (0.05, 0.62, 0.45)


def _pixels(camera: Camera, T_table_camera: Array, body: DrawnBody) -> Array:
    """Return the vertices of a body as pixels (N, 2) of the enlarged image."""
    points = transform_points(body.T_table_body, body.mesh.vertices)
    return np.asarray(camera.project(transform_points(inverse(T_table_camera), points)) * _SCALE)


def tracked_moments(record: DemoRecord) -> list[Moment]:
    """Return the pictures of the tracked scene at the moments of the report."""
    states = {state.stamp: state for state in record.states}
    frames = {frame.stamp: frame for frame in record.frames}
    start = start_stamp(record)
    return [
        _moment(record, frames[stamp], states[stamp], (stamp - start) * 1e-9)
        for stamp in moments(list(states), record.grasps)
        if stamp in frames
    ]


def _moment(record: DemoRecord, frame: RgbdFrame, state: SceneState, seconds: float) -> Moment:
    """Return the frame with the tracked hand (shaded) and objects (outlined)."""
    bodies, opacity = [], []
    placed = zip(state.object_models, state.T_table_objects, strict=True)
    for index, (model, pose) in enumerate(placed):
        if np.all(np.isfinite(pose)):
            mesh = record.database[model].mesh
            bodies.append(DrawnBody(mesh, pose, OBJECT_COLORS[index % len(OBJECT_COLORS)]))
            opacity.append(0.25)
    if state.hand_tracked:
        mesh = hand_mesh(state.hand.table, state.joint_angles)
        bodies.append(DrawnBody(mesh, state.T_table_hand, HAND_COLOR))
        opacity.append(0.85)
    image = overlay(frame.color, frame.camera, state.T_table_camera, bodies, opacity, _SCALE)
    corners = [_pixels(frame.camera, state.T_table_camera, body) for body in bodies]
    pixels = np.concatenate(corners) if corners else np.zeros((0, 2))
    return Moment(image, seconds, _phase(record, state), pixels)


def start_stamp(record: DemoRecord) -> int:
    """Return the stamp of time zero [ns]: the first tracked state."""
    stamps = [state.stamp for state in record.states] or [f.stamp for f in record.frames] or [0]
    return min(stamps)


def _phase(record: DemoRecord, state: SceneState) -> str:
    """Return what happens at a state, judged by the tracker and the stable grasp alone."""
    if state.hand_lost:
        return "hand lost"
    if not state.hand_visible:
        seen = any(s.hand_visible for s in record.states if s.stamp < state.stamp)
        return "hand out of view" if seen else "no hand yet"
    if not record.grasps:
        return "hand tracked"
    grasp = record.grasps[0].stamp
    nearest = min((s.stamp for s in record.states), key=lambda other: abs(other - grasp))
    if state.stamp == nearest:
        return "stable grasp"
    return "reaching" if state.stamp < grasp else "carrying out the task"


def view_of_action(shown: Sequence[Moment]) -> Window:
    """Return the common window around everything that is drawn in the moments."""
    size = (shown[0].image.shape[1], shown[0].image.shape[0])
    return window_around(np.concatenate([moment.pixels for moment in shown]), size, 0.12)


def strip(shown: Sequence[Moment], columns: int = 3, width: int = 720) -> Image:
    """Return the moments side by side, cut to the same window and captioned."""
    window = view_of_action(shown)
    tiles = []
    for moment in shown:
        label = f"{moment.seconds:.2f} s   {moment.caption}"
        tile = window.cut(moment.image, width)
        tiles.append(annotate(tile, [Tag(label, (1.0, 1.0, 1.0), (0.0, 0.0))], size=0.72))
    return mosaic(tiles, columns)


def mosaic(tiles: Sequence[Image], columns: int, gap: int = 8) -> Image:
    """Return pictures of one size in rows on white."""
    height, width = tiles[0].shape[:2]
    columns = min(columns, len(tiles))
    rows = -(-len(tiles) // columns)
    canvas = np.full(
        (rows * (height + gap) - gap, columns * (width + gap) - gap, 3), 255, dtype=np.uint8
    )
    for index, tile in enumerate(tiles):
        top, left = index // columns * (height + gap), index % columns * (width + gap)
        canvas[top : top + height, left : left + width] = tile
    return canvas
