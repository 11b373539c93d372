"""Where known objects and estimated shapes meet: each saves the other work, and corrects it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Floats, Mask
from intent_perception.basics.kernels import kernel
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.model import OBJECT_CLASSES
from intent_perception.recognition.estimation.class_odds import CLASSES
from intent_perception.recognition.estimation.likeness import likeness_of
from intent_perception.recognition.estimation.outlines import outline_of
from intent_perception.recognition.estimation.shape_estimator import (
    EstimatedShape,
    estimated_shape,
)
from intent_perception.recognition.estimation.things import SeenThing, thing_of
from intent_perception.scene.scene_view import SceneView

_WHOLE = 0.62
"""From this likeness on one shape explains a thing: it is one, and seen to its ends."""
_UNHIDDEN = 0.03
_LOW = 0.03
"""Things that are lower may have parts as flat as the table, which depth does not show [m]."""
_OVERLAP = 0.65
"""Least intersection over union of the windows of a whole thing and of what it may be."""
_TOUCHES = 0.08
"""From this share of its window on a hypothesis may explain a thing that is not whole."""
ELSEWHERE, MISFIT = -1, -2
_POINTS = 100
_CONTRADICTED = 0.15
"""A known object that is this much less like a whole thing than its estimate is not there."""
_DOUBTED, _UNLIKELY = 0.06, 0.33
"""The same where the thing has not the look of the object's class either."""
_LEFT_OVER = 150
"""Fewer pixels that a known object leaves of a thing are its rim."""
_MOSTLY = 0.25
_HARDLY = 0.05
"""Odds of a class below which a thing is hardly of it."""
_HINTED = 0.1
"""Fewer of a thing's pixels under an object do not hint at one."""

Window = tuple[float, float, float, float]


def is_whole(shape: EstimatedShape) -> bool:
    """Return whether a thing is one, seen to its ends: what it is must be as large as it."""
    thing = shape.thing
    seen = thing.hidden <= _UNHIDDEN and thing.height > _LOW
    return seen and shape.likeness.share >= _WHOLE


def things_meant(
    shapes: Sequence[EstimatedShape],
    models: NDArray[np.int64],
    poses: Floats,
    points: Floats,
    offsets: NDArray[np.int64],
    intrinsics: Floats,
) -> NDArray[np.int64]:
    """Return which whole thing each hypothesis (N,) explains, ELSEWHERE where none.

    MISFIT are those that are much smaller or larger in the image than the whole thing there.

    Args:
        shapes: estimates of all things of the scene.
        models: (N,) numbers.
        poses: (N, 12).
        points: (P, 3) of all models, those of each that spread widest first [m].
        offsets: (M + 1,) where each model's points begin.
        intrinsics: (4,).
    """
    meant = np.full(len(models), ELSEWHERE)
    whole = [shape for shape in shapes if is_whole(shape)]
    if not whole or len(models) == 0:
        return meant
    others = [_window(shape.thing) for shape in shapes if not is_whole(shape)]
    windows = np.array([_window(shape.thing) for shape in whole])
    drawn = _drawn_windows(models, poses, points, offsets, intrinsics)
    overlap = _overlaps(drawn, windows)
    elsewhere = overlap.max(axis=1) < 1e-6
    if others:
        elsewhere |= _within(drawn, np.array(others)).max(axis=1) > _TOUCHES
    fits = np.where(overlap.max(axis=1) >= _OVERLAP, overlap.argmax(axis=1), MISFIT)
    return np.where(elsewhere, ELSEWHERE, fits)


def hardly_there(
    shapes: Sequence[EstimatedShape], meant: NDArray[np.int64], classes: Sequence[str]
) -> NDArray[np.bool_]:
    """Return which hypotheses (N,) are of a class that the whole thing there hardly is of.

    Args:
        shapes: estimates of all things of the scene.
        meant: (N,) see `things_meant`.
        classes: N of them; of others than the known ones nothing is said.
    """
    columns = np.array([CLASSES.index(c) if c in OBJECT_CLASSES else -1 for c in classes], int)
    hardly = (meant >= 0) & (columns >= 0)
    odds = np.array([shape.odds for shape in shapes if is_whole(shape)]).reshape(-1, len(CLASSES))
    hardly[hardly] = odds[meant[hardly], columns[hardly]] < _HARDLY
    return hardly


def _window(thing: SeenThing) -> Window:
    h, w = thing.mask.shape
    return (float(thing.left), float(thing.top), float(thing.left + w), float(thing.top + h))


@kernel
def _drawn_windows(
    models: NDArray[np.int64],
    poses: Floats,
    points: Floats,
    offsets: NDArray[np.int64],
    intrinsics: Floats,
) -> Array:
    """Return the window (N, 4) of each hypothesis in the image; the arguments: `things_meant`."""
    windows = np.empty((len(models), 4))
    for k in range(len(models)):
        start, pose = offsets[models[k]], poses[k]
        left, top, right, bottom = 1e9, 1e9, -1e9, -1e9
        for i in range(start, min(start + _POINTS, offsets[models[k] + 1])):
            a, b, c = points[i, 0], points[i, 1], points[i, 2]
            z = max(pose[6] * a + pose[7] * b + pose[8] * c + pose[11], np.float32(0.05))
            x = pose[0] * a + pose[1] * b + pose[2] * c + pose[9]
            y = pose[3] * a + pose[4] * b + pose[5] * c + pose[10]
            u = intrinsics[0] * x / z + intrinsics[2]
            v = intrinsics[1] * y / z + intrinsics[3]
            left, right = min(left, u), max(right, u)
            top, bottom = min(top, v), max(bottom, v)
        windows[k, 0], windows[k, 1], windows[k, 2], windows[k, 3] = left, top, right, bottom
    return windows


def _overlaps(first: Array, second: Array) -> Array:
    """Return intersection over union (N, M) of windows (N, 4) and (M, 4)."""
    shared, areas = _shared(first, second), (_areas(first), _areas(second))
    return np.asarray(shared / (areas[0][:, None] + areas[1][None] - shared))


def _within(first: Array, second: Array) -> Array:
    """Return the share (N, M) of each of the windows (N, 4) that is in each of (M, 4)."""
    return np.asarray(_shared(first, second) / _areas(first)[:, None])


def _shared(first: Array, second: Array) -> Array:
    low = np.maximum(first[:, None, :2], second[None, :, :2])
    high = np.minimum(first[:, None, 2:], second[None, :, 2:])
    return np.asarray(np.prod(np.clip(high - low, 0.0, None), axis=2))


def _areas(windows: Array) -> Array:
    return np.asarray(np.prod(np.clip(windows[:, 2:] - windows[:, :2], 1.0, None), axis=1))


def contradicted(
    shapes: Sequence[EstimatedShape],
    meshes: Sequence[Mesh],
    classes: Sequence[str],
    T_camera_objects: Sequence[Array],
    scene: SceneView,
    T_table_camera: Array,
) -> list[bool]:
    """Return which placed objects are of another class than, and less like, the thing there."""
    wrong = []
    for mesh, object_class, pose in zip(meshes, classes, T_camera_objects, strict=True):
        T_table_object = T_table_camera @ pose
        shape = _there(shapes, mesh, T_table_object)
        told = object_class in OBJECT_CLASSES  # of other classes an estimate knows nothing
        same = shape is not None and shape.object_class == object_class
        if shape is None or same or not told or not is_whole(shape):
            wrong.append(False)
            continue
        likeness = likeness_of(mesh, T_table_object, shape.thing, scene, T_table_camera)
        lead = shape.likeness.share - likeness.share
        unlikely = shape.odds[CLASSES.index(object_class)] < _UNLIKELY
        wrong.append(lead > (_DOUBTED if unlikely else _CONTRADICTED))
    return wrong


def _there(
    shapes: Sequence[EstimatedShape], mesh: Mesh, T_table_object: Array
) -> EstimatedShape | None:
    """Return the shape that is nearest to a placed object, None where none is near."""
    middle = T_table_object[:3, :3] @ mesh.bounds.mean(axis=0) + T_table_object[:3, 3]
    gaps = [float(np.linalg.norm(s.T_table_object[:3, 3] - middle)) for s in shapes]
    nearest = int(np.argmin(gaps)) if gaps else -1
    return shapes[nearest] if gaps and gaps[nearest] < 0.05 else None


def settled(shapes: Sequence[EstimatedShape], hints: Floats) -> Floats:
    """Return 1 on the pixels (H, W) of whole things that no object may be on, 0 elsewhere.

    Args:
        shapes: of all things of the scene.
        hints: (H, W) 1 = an object may be there.
    """
    pixels = np.zeros_like(hints)
    for shape in shapes:
        thing = shape.thing
        if is_whole(shape) and hints[thing.window][thing.mask].mean() < _HINTED:
            pixels[thing.window][thing.mask] = 1.0
    return pixels


def left_over(
    shapes: Sequence[EstimatedShape],
    scene: SceneView,
    T_table_camera: Array,
    rng: np.random.Generator,
) -> tuple[EstimatedShape, ...]:
    """Return the shapes of what known objects leave unexplained.

    Args:
        shapes: of all things of the scene.
        scene: with the pixels that nothing known explains.
        T_table_camera: (4, 4).
        rng: chooses the points that are looked at.
    """
    rest = []
    for shape in shapes:
        mask = _remaining(shape.thing, scene)
        share = mask.sum() / max(shape.thing.pixels, 1)
        if share > 1.0 - _MOSTLY:
            rest.append(shape)
        elif share > _MOSTLY and mask.sum() > _LEFT_OVER:
            thing = thing_of(scene, mask, T_table_camera, rng)
            again = estimated_shape(thing, outline_of(thing), scene, T_table_camera)
            rest += [] if again is None else [again]
    return tuple(rest)


def _remaining(thing: SeenThing, scene: SceneView) -> Mask:
    mask = np.zeros(scene.shape, dtype=bool)
    mask[thing.window] = thing.mask & (scene.parts.mask[thing.window] == 1)
    return mask
