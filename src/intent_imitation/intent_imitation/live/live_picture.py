"""The camera's picture with objects, hand, stage and posterior drawn in."""

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from intent_imitation.demo.hand_mesh import hand_mesh
from intent_imitation.demo.mesh_pictures import (
    FONT,
    DrawnBody,
    Image,
    Tag,
    annotate,
    overlay,
    rgb,
    task_color,
)
from intent_imitation.demo.panels import HAND_COLOR, OBJECT_COLORS
from intent_imitation.live.belief import Belief
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, ColorImage
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.model import ObjectModel
from intent_tracking.scene.scene_state import SceneState

_PANEL = 260
"""Width of what stands beside the picture [pixels]."""
_HEIGHT = 480
"""The picture is brought to this height [pixels]."""
_BACK, _TEXT, _FAINT, _RAIL = (24, 29, 36), (240, 243, 246), (139, 149, 160), (52, 61, 72)


def live_picture(
    color: ColorImage, camera: Camera, belief: Belief, model: Callable[[str], ObjectModel | None]
) -> Image:
    """Return the picture of one moment, 480 rows high.

    Args:
        color: (H, W, 3) RGB, rectified.
        camera: of the image.
        belief: what is believed at its moment.
        model: returns the object of a name, None for one that is not known (yet).
    """
    scale = _HEIGHT / color.shape[0]
    size = (round(color.shape[1] * scale), _HEIGHT)
    image: Image = np.asarray(cv2.resize(color, size, interpolation=cv2.INTER_AREA), np.uint8)
    if belief.state is not None:
        image = _drawn(image, camera.scaled(scale), belief.state, model)
    panel = np.full((_HEIGHT, _PANEL, 3), _BACK, dtype=np.uint8)
    _write_panel(panel, belief)
    return np.concatenate([image, panel], axis=1)


def _drawn(
    image: Image, camera: Camera, state: SceneState, model: Callable[[str], ObjectModel | None]
) -> Image:
    """Return the image with outlines and names of the objects and the shaded hand."""
    bodies, opacity, tags = list[DrawnBody](), list[float](), list[Tag]()
    placed = zip(
        state.object_ids, state.object_models, state.object_classes, state.T_table_objects,
        strict=True,
    )  # fmt: skip
    for index, (name, kind, known, pose) in enumerate(placed):
        thing = model(kind)
        if thing is None or not np.all(np.isfinite(pose)):
            continue
        paint = OBJECT_COLORS[index % len(OBJECT_COLORS)]
        bodies.append(DrawnBody(thing.mesh, pose, paint))
        opacity.append(0.2)
        tags.append(
            Tag(_label(name, known), paint, _above(camera, state.T_table_camera, pose, thing))
        )
    if state.hand_tracked:
        mesh = hand_mesh(state.hand.table, state.joint_angles)
        bodies.append(DrawnBody(mesh, state.T_table_hand, HAND_COLOR))
        opacity.append(0.7)
    if not bodies:
        return image
    image = overlay(image, camera, state.T_table_camera, bodies, opacity, scale=1)
    return annotate(image, tags, size=0.42)


def _label(name: str, object_class: str) -> str:
    spoken = name.replace("_", " ")
    return spoken if object_class else f"{spoken}: unknown thing"


def _above(
    camera: Camera, T_table_camera: Array, pose: Array, model: ObjectModel
) -> tuple[float, float]:
    """Return the pixel of the highest point of an object's axis."""
    top = pose[:3, 3] + np.array([0.0, 0.0, 0.5 * float(np.abs(pose[2, :3]) @ model.size)])
    point = inverse(T_table_camera) @ np.append(top, 1.0)
    if point[2] <= 0.0:
        return 0.0, 0.0
    column, row = camera.project(point[None, :3])[0]
    return float(np.clip(column, 0, camera.width)), float(np.clip(row, 0, camera.height))


def _write_panel(panel: Image, belief: Belief) -> None:
    """Write stage, object, a bar for each task and the robot's answer."""
    _write(panel, "the hand", 34, _FAINT, 0.42)
    _write(panel, belief.stage, 60, _TEXT, 0.68, 2)
    _write(panel, belief.object_name, 86, _TEXT, 0.6)
    head = "what it is for"
    if belief.chances and not belief.current:
        head = "what it was for"
    elif belief.preliminary:
        head = "what it may be for (forecast)"
    _write(panel, head, 128, _FAINT, 0.42)
    row = 156
    tasks = [chance.task for chance in belief.chances]
    best = max((chance.probability for chance in belief.chances), default=0.0)
    for chance in belief.chances[:6]:
        faded = not belief.current
        code = rgb(task_color(chance.task, tasks))
        paint = _mixed(code, 0.45) if faded else code
        strong = chance.probability == best and not faded
        _write(panel, chance.task, row, _FAINT if faded else _TEXT, 0.48, 2 if strong else 1)
        _write(panel, f"{chance.probability:.2f}", row, _TEXT, 0.48, at=_PANEL - 58)
        left, right = 18, _PANEL - 18
        end = left + round((right - left) * chance.probability)
        cv2.rectangle(panel, (left, row + 9), (right, row + 17), _RAIL, -1)
        if belief.preliminary:
            cv2.rectangle(panel, (left, row + 9), (max(end, left + 1), row + 17), paint, 2)
        else:
            cv2.rectangle(panel, (left, row + 9), (max(end, left + 1), row + 17), paint, -1)
        row += 46
    if not belief.chances:
        _write(panel, "nothing yet", row, _FAINT, 0.48)
    if belief.answer:
        _write(panel, "the robot", 388, _FAINT, 0.42)
        for line, words in enumerate(_wrapped(belief.answer, 26)[:3]):
            _write(panel, words, 412 + 22 * line, _TEXT, 0.48)


def _mixed(color: tuple[int, int, int], share: float) -> tuple[int, int, int]:
    """Return a colour sunk into the background."""
    red, green, blue = (
        round(share * c + (1.0 - share) * b) for c, b in zip(color, _BACK, strict=True)
    )
    return red, green, blue


def _write(
    panel: Image,
    text: str,
    row: int,
    color: Sequence[int],
    size: float,
    weight: int = 1,
    at: int = 18,
) -> None:
    plain = text.encode("ascii", "replace").decode()
    cv2.putText(panel, plain, (at, row), FONT, size, tuple(color), weight, cv2.LINE_AA)


def _wrapped(text: str, width: int) -> list[str]:
    """Return the text in lines of at most so many letters."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
