"""Films demonstrations: RGB-D frames of a person who takes things from a table, with the truth.

Everything is synthetic. The person is not the tracker's hand model (see `demonstrator_hand`), and
nothing here may be imported by the tracker.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import render, visible_pixels
from intent_perception.geometry.transforms import inverse, look_at, transform_points
from intent_perception.objects.database import ObjectModel
from intent_perception.workshop.scenes.sensor_noise import KinectNoise, observe
from intent_tracking.workshop.person.acting.script import Script
from intent_tracking.workshop.person.body.skin import Skin
from intent_tracking.workshop.person.filming.look import Look, plain_look
from intent_tracking.workshop.person.filming.picture import Light, LitPicture, picture, sample_light
from intent_tracking.workshop.person.filming.room import Clothes, Piece, sample_clothes, sample_room

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
_WIDE = Camera(1280, 960, 525.0, 525.0, 639.5, 479.5)
PERIOD = 33_333_333
"""Time between frames [ns]."""
NEAR_MODE = KinectNoise(farthest=3.0)
"""A Kinect in near mode measures nothing beyond 3 m."""
_HIDDEN = 0.04


class Company(Protocol):
    """Whoever else is there: a hand at rest, a bystander, something held before the camera."""

    def pieces(self, f: int) -> list[Piece]:
        """Return what is seen of it in frame `f`, table frame."""


@dataclass(frozen=True, eq=False)
class Set:
    """Where a demonstration is filmed: room, light, clothes, skin colour and camera."""

    T_table_camera: Array
    room: tuple[Piece, ...]
    light: Light
    clothes: Clothes
    complexion: Array
    """(3,) RGB of the back of the hand in 0..1."""
    look: Look | None = None
    """Skin, glove, watch, ring, bare arm; None = a bare hand of that colour."""
    camera: Camera = CAMERA
    company: Company | None = None
    """Others who move about, frame by frame."""
    arm_in_lap: bool = True
    """Whether the demonstrator's other arm hangs down."""


@dataclass(frozen=True, eq=False)
class Shot:
    """One frame with what is true in it."""

    frame: RgbdFrame
    joints_camera: Array
    """(21, 3) [m]."""
    objects_camera: Array
    """(N, 4, 4)."""
    hand_in_view: bool
    """See `in_view`."""
    hand_whole: bool
    """See `wholly_in_view`."""
    visible: NDArray[np.int64]
    """(N,) pixels of each object."""


def sample_set(rng: np.random.Generator, edge: float) -> Set:
    """Return a room with a camera that faces the demonstrator across the table.

    Args:
        rng: source of the set.
        edge: y of the table edge at the demonstrator's side [m].
    """
    distance, down = rng.uniform(0.70, 0.95), np.radians(rng.uniform(25.0, 45.0))
    yaw = np.radians(rng.uniform(-18.0, 18.0))
    target = np.array([rng.uniform(-0.02, 0.02), rng.uniform(0.02, 0.06), rng.uniform(0.07, 0.11)])
    away = np.array([np.sin(yaw) * np.cos(down), -np.cos(yaw) * np.cos(down), np.sin(down)])
    pose = look_at(target + distance * away, target)
    tone = rng.uniform(0.0, 1.0)
    complexion = (1 - tone) * np.array([0.86, 0.62, 0.50]) + tone * np.array([0.52, 0.33, 0.24])
    room = tuple(sample_room(rng, edge))
    return Set(pose, room, sample_light(rng), sample_clothes(rng), complexion)


def film(
    script: Script,
    skin: Skin,
    scene: Set,
    rng: np.random.Generator,
    noise: KinectNoise | None = None,
) -> Iterator[Shot]:
    """Yield the shots of a demonstration.

    Args:
        script: the motion.
        skin: the person's hand.
        scene: where it happens.
        rng: source of the sensor's noise.
        noise: of the sensor; None = a Kinect's in near mode.
    """
    T_camera_table = inverse(scene.T_table_camera)
    stamp = 1_000_000_000 * int(rng.integers(1_000, 9_000))
    for f in range(len(script.hands)):
        pieces = [
            *person_pieces(script, f, skin, scene),
            *_things(script.models, script.objects[f]),
        ]
        others = scene.company.pieces(f) if scene.company else []
        everything = [*pieces, *others, *scene.room]
        seen = picture(everything, scene.camera, scene.T_table_camera, scene.light)
        joints = transform_points(script.hands[f], skin.hand.joint_positions(script.angles[f]))
        joints = transform_points(T_camera_table, joints)
        first = len(pieces) - len(script.models)
        counts = np.bincount(seen.label.ravel() + 1, minlength=len(pieces) + 1)[1:]
        depth, color = observe(seen.depth, seen.color, rng, noise or NEAR_MODE, scene.camera.fx)
        yield Shot(
            RgbdFrame(stamp + f * PERIOD, color, depth, scene.camera),
            joints,
            T_camera_table @ script.objects[f],
            in_view(joints, seen.depth, scene.camera),
            wholly_in_view(joints, seen.depth, scene.camera),
            counts[first : len(pieces)].astype(np.int64),
        )


def still_life(
    models: tuple[ObjectModel, ...], poses: Array, scene: Set, frames: int, rng: np.random.Generator
) -> Iterator[tuple[RgbdFrame, LitPicture]]:
    """Yield frames of objects (N, 4, 4) on the table without a person."""
    stamp = 1_000_000_000 * int(rng.integers(1_000, 9_000))
    pieces = [*_things(models, poses), *scene.room]
    seen = picture(pieces, CAMERA, scene.T_table_camera, scene.light)
    for f in range(frames):
        depth, color = observe(seen.depth, seen.color, rng, NEAR_MODE, CAMERA.fx)
        yield RgbdFrame(stamp + f * PERIOD, color, depth, CAMERA), seen


def all_seen(script: Script, scene: Set, share: float = 0.85, pixels: int = 300) -> bool:
    """Return whether the camera sees enough of every object before the hand comes."""
    meshes, poses = [model.mesh for model in script.models], script.objects[0]
    poses = inverse(scene.T_table_camera) @ poses
    together = visible_pixels(render(CAMERA, meshes, poses), len(meshes))
    alone = [
        visible_pixels(render(_WIDE, [mesh], pose[None]), 1)[0]
        for mesh, pose in zip(meshes, poses, strict=True)
    ]
    if any(_handle_hidden(model, pose) for model, pose in zip(script.models, poses, strict=True)):
        return False
    return bool(np.all(together >= np.maximum(pixels, share * np.array(alone))))


def _handle_hidden(model: ObjectModel, T_camera_object: Array) -> bool:
    """Return whether a cup's handle points away from the camera: nobody could see its direction."""
    handle = [part.mesh.vertices for part in model.parts if part.name == "handle"]
    if not handle or model.functions is None or model.functions.opening is None:
        return False
    opening = model.functions.opening
    out = np.concatenate(handle).mean(axis=0) - opening.center
    out -= opening.normal * (out @ opening.normal)
    away = T_camera_object[:3, :3].T @ T_camera_object[:3, 3]
    away -= opening.normal * (away @ opening.normal)
    return bool(out @ away > 0.6 * np.linalg.norm(out) * np.linalg.norm(away))


def person_pieces(script: Script, f: int, skin: Skin, scene: Set) -> list[Piece]:
    """Return the hand in its tones with what it wears, both sleeves and the chest."""
    look = scene.look or plain_look(scene.complexion)
    vertices = transform_points(script.hands[f], skin.posed(script.angles[f], script.wrists[f]))
    faces = skin.faces()
    pieces = [
        Piece(Mesh(vertices, np.ascontiguousarray(faces[skin.tones == tone])), color, 0.05)
        for tone, color in enumerate(look.palette)
        if np.any(skin.tones == tone)
    ]
    links = script.hands[f], skin.hand, script.angles[f], script.wrists[f]
    pieces += look.worn(*links)
    clothes, shoulder = scene.clothes, script.shoulders[f]
    pieces += look.bare_arm(script.hands[f], script.elbows[f], shoulder, skin.hand.thickness)
    swap = np.array([-1.0, 1.0, 1.0])
    cuff, bend = script.hands[f, :3, 3], script.elbows[f]
    if look.bare:
        cuff, bend = bend + 0.35 * (shoulder - bend), bend + 0.6 * (shoulder - bend)
    other = shoulder * swap
    elbow = other + np.array([0.06 * np.sign(other[0]), 0.0, -0.29])
    lap = np.array([0.55 * other[0], script.edge + 0.06, -0.15])
    sleeves = [
        clothes.sleeve(cuff, bend, shoulder),
        clothes.chest(shoulder, script.edge),
    ]
    if scene.arm_in_lap:
        sleeves.insert(1, clothes.sleeve(lap, elbow, other))
    return pieces + [Piece(mesh, clothes.color, 0.12) for mesh in sleeves]


def _things(models: tuple[ObjectModel, ...], poses: Array) -> list[Piece]:
    return [
        Piece(model.mesh.transformed(pose), np.asarray(model.color))
        for model, pose in zip(models, poses, strict=True)
    ]


def in_view(joints: Array, depth: NDArray[np.float32], camera: Camera = CAMERA) -> bool:
    """Return whether a third of the joints are in the image with nothing well in front of them.

    Args:
        joints: (21, 3) in the camera frame [m].
        depth: (H, W) exact depth of the scene [m].
        camera: that sees them.
    """
    return bool(np.sum(_seen(joints, depth, camera)) >= len(joints) / 3.0)


def wholly_in_view(joints: Array, depth: NDArray[np.float32], camera: Camera = CAMERA) -> bool:
    """Return whether all joints (21, 3) are in the image, at most a third of them hidden."""
    if np.any(joints[:, 2] <= 0.05):
        return False
    inside = np.all(camera.project(joints) >= 0.0, axis=1)
    inside &= np.all(camera.project(joints) <= [camera.width - 1, camera.height - 1], axis=1)
    return bool(inside.all() and np.mean(_seen(joints, depth, camera)) >= 2.0 / 3.0)


def _seen(joints: Array, depth: NDArray[np.float32], camera: Camera) -> NDArray[np.bool_]:
    """Return which joints (21, 3) are in the image with nothing well in front of them."""
    ahead = joints[joints[:, 2] > 0.05]
    u, v = np.rint(camera.project(ahead)).astype(int).T
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    surface = depth[v[inside], u[inside]]
    seen = np.zeros(len(joints), dtype=bool)
    rows = np.flatnonzero(joints[:, 2] > 0.05)[inside]
    seen[rows] = surface > ahead[inside, 2] - _HIDDEN
    return seen
