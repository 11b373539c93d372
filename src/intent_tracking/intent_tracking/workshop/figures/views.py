"""Synthetic sequences of one hand that takes a mug and pours, seen from three sides.

They measure the tracker alone: the hand is drawn as capsules like the tracker's, but with other
bone lengths and radii. Views: v0 sees the back of the hand, v120 has the hand behind the object,
v240 sees the fingers edge-on. 125 frames, up to 8.8 degrees per joint and 12.5 mm per frame.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import Camera, RgbdFrame
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.sdf import SignedDistance
from intent_perception.geometry.transforms import make_pose, rotation_from_vector
from intent_tracking.scene.hand_kernel import hand_arrays, hand_buffers, place_hand
from intent_tracking.scene.hand_model import LIMITS, HandModel
from intent_tracking.scene.raster import FAR, draw_capsule, draw_mesh

KINECT = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
FRAMES = 125
_CENTER = np.array([-0.02, 0.03, 0.72])
_BACK = np.array([-0.8, 0.05, -0.6]) / np.linalg.norm([-0.8, 0.05, -0.6])
_SKIN, _BACKGROUND = np.array([205.0, 150.0, 125.0]), np.array([105.0, 110.0, 120.0])
_OPEN = np.radians([25, 0, 5, 5, 6, 8, 8, 6, 1, 8, 8, 6, -3, 8, 8, 6, -8, 8, 8, 6])

_OPPOSED = np.radians([[turn, back, 5, 5] for turn in (-5, 5, 15, 25) for back in (-35, -45)])
"""Postures of the thumb (8, 4) against the fingers, before it closes [rad]."""


@dataclass(frozen=True, eq=False)
class ViewFrame:
    """Truth of one frame, all in the camera's frame."""

    T_camera_hand: Array
    joints: Array
    """(20,) [rad]."""
    T_camera_object: Array


def mismatched_hand(rng: np.random.Generator) -> HandModel:
    """Return a hand with bones up to 4 % and radii up to 6 % off the nominal ones."""
    return HandModel(
        bone_scales=rng.uniform(0.96, 1.04, (5, 4)), thickness=float(rng.uniform(0.94, 1.06))
    )


def pour_sequence(view: float, hand: HandModel, distance: SignedDistance) -> list[ViewFrame]:
    """Return the motion: reach, close, lift, tilt, let go.

    Args:
        view: turn of the whole scene about the vertical through the object [deg].
        hand: hand that closes until it touches.
        distance: signed distance of the filled object (its hull).
    """
    up = np.array([0.0, -1.0, -0.25])
    R_object = rotation_from_vector([np.radians(115.0), 0, 0]) @ rotation_from_vector(
        [0, 0, np.radians(-25.0)]
    )
    z = -_BACK
    y = -(up - z * (up @ z))
    y /= np.linalg.norm(y)
    R_hand = np.stack([np.cross(y, z), y, z], axis=1)
    grasp = _touching_palm(hand, R_hand, R_object, distance)
    closed = _closed_fingers(hand, R_hand, grasp, R_object, distance)
    turned = rotation_from_vector([0.0, -np.radians(view), 0.0])
    frames = []
    for i in np.arange(FRAMES) * 1.2:
        truth = _moment(float(i), grasp, R_hand, R_object, closed)
        hand_pose = make_pose(turned @ truth[1], turned @ (truth[0] - _CENTER) + _CENTER)
        object_pose = make_pose(turned @ truth[4], turned @ (truth[3] - _CENTER) + _CENTER)
        frames.append(ViewFrame(hand_pose, truth[2], object_pose))
    return frames


def _moment(
    i: float, grasp: Array, R_hand: Array, R_object: Array, closed: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Return hand position, rotation, joints, object position and rotation at time i."""
    reach, lift = _ramp(i / 35), _ramp((i - 65) / 30)
    tilt, release = _ramp((i - 95) / 22), _ramp((i - 128) / 14)
    close = np.repeat([_ramp((i - 25 - 3 * finger) / 14) for finger in range(5)], 4)
    wave = 0.06 * np.sin(i * 0.45 + np.arange(20) * 1.3) * (1 - reach)
    joints = _OPEN + (closed - _OPEN) * close * (1 - release) + wave
    joints = np.clip(joints, LIMITS[:, 0] + 0.01, LIMITS[:, 1] - 0.01)
    away = (1 - reach) * (_BACK * 0.13 + [0.0, -0.05, -0.05]) + release * _BACK * 0.05
    carried = (
        rotation_from_vector([0, 0, 0.5 * lift])
        @ rotation_from_vector([0, -0.35 * lift, 0])
        @ rotation_from_vector([0, 0, 0.8 * tilt])
    )
    moved = np.array([0.075, -0.085, -0.05]) * lift + np.array([-0.06, -0.02, 0.03]) * tilt
    approach = rotation_from_vector(np.array([0.2, -0.5, -0.3]) * (1 - reach))
    position = carried @ (grasp + away - _CENTER) + _CENTER + moved
    return position, carried @ approach @ R_hand, joints, _CENTER + moved, carried @ R_object


def _ramp(x: float) -> float:
    return float(0.5 - 0.5 * np.cos(np.pi * np.clip(x, 0.0, 1.0)))


def _touching_palm(
    hand: HandModel, R_hand: Array, R_object: Array, distance: SignedDistance
) -> Array:
    """Return the wrist position (3,) at which palm and thumb's base just touch the object."""
    ends, radii = hand.capsules(_OPEN)
    points = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * np.linspace(0.0, 1.0, 6)[:, None]
    palm = [0, *range(15, 24)]  # the thumb's metacarpal and what does not move
    local, radii = points[palm] @ R_hand.T, radii[palm, None]
    wrist = _CENTER + _BACK * 0.045 - R_hand @ np.array([0.085, 0.0, 0.015])
    while True:
        placed = (local + wrist - _CENTER) @ R_object
        gap = distance.distance(placed.reshape(-1, 3)).reshape(placed.shape[:2])
        if float((gap - radii).min()) > -0.001:
            return np.asarray(wrist)
        wrist = wrist + 0.0005 * _BACK


def _closed_fingers(
    hand: HandModel, R_hand: Array, position: Array, R_object: Array, distance: SignedDistance
) -> Array:
    """Return the joints (20,) at which every finger touches the object."""
    radii = hand.table.capsules.radii
    steps = np.linspace(0.0, 1.0, 6)[:, None]

    def clearance(joints: Array, finger: int, first: int) -> float:
        ends = hand.capsules(joints)[0][3 * finger + first : 3 * finger + 3] @ R_hand.T + position
        points = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * steps
        local = (points - _CENTER) @ R_object
        gap = distance.distance(local.reshape(-1, 3)).reshape(local.shape[:2])
        return float((gap - radii[3 * finger + first : 3 * finger + 3, None]).min())

    joints = _OPEN.copy()
    joints[:4] = max(_OPPOSED, key=lambda thumb: clearance(np.r_[thumb, joints[4:]], 0, 0))
    for finger in range(5):
        for first in (1, 2):  # all joints together, then those beyond what has touched
            levels = slice(4 * finger + first, 4 * finger + 4)
            reach = 0.95 * LIMITS[levels, 1] - joints[levels]
            start = joints[levels].copy()
            for share in np.arange(0.02, 1.0, 0.02):
                joints[levels] = start + share * reach
                if clearance(joints, finger, first - 1) < -0.0015:
                    joints[levels] = start + (share - 0.02) * reach
                    break
    return joints


@dataclass(frozen=True, eq=False)
class Thing:
    """A coloured object at rest in the scene."""

    mesh: Mesh
    color: Array
    """(3,) RGB in [0, 1]."""
    T_camera_object: Array


def rendered_frames(
    frames: list[ViewFrame],
    hand: HandModel,
    held: tuple[Mesh, Array] | None,
    rng: np.random.Generator,
    resting: Sequence[Thing] = (),
) -> Iterator[RgbdFrame]:
    """Yield each moment as a Kinect would see it: depth noise, edge jitter, dropouts, colours.

    Args:
        frames: the motion.
        hand: the hand that moves.
        held: mesh and colour (3,) of the object that it takes, None: it moves without one.
        rng: of all noise.
        resting: objects that stay where they are.
    """
    arrays, buffers = hand_arrays(hand), hand_buffers()
    step = np.float32(1.0 / KINECT.fx)
    u0, v0 = np.float32(-KINECT.cx / KINECT.fx), np.float32(-KINECT.cy / KINECT.fy)
    palette = [_SKIN, *(255.0 * np.asarray(thing.color) for thing in resting)]
    still = [_drawn(thing.mesh, thing.T_camera_object) for thing in resting]
    if held is not None:
        palette.append(255.0 * np.asarray(held[1]))
    for number, truth in enumerate(frames):
        state = np.concatenate([truth.T_camera_hand[:3, 3], np.zeros(3), truth.joints])
        depth = np.full((640, 640), FAR, np.float32)
        rotation = truth.T_camera_hand[:3, :3].astype(np.float32)
        place_hand(arrays, state.astype(np.float32), rotation, buffers)
        for i, radius in enumerate(arrays.radii):
            draw_capsule(buffers.ends, i, radius, depth, u0, v0, step)
        layers = [depth[:480], *still]
        if held is not None:
            layers.append(_drawn(held[0], truth.T_camera_object))
        yield _observed(number, np.stack(layers), np.stack([_BACKGROUND, *palette]), rng)


def _drawn(mesh: Mesh, pose: Array) -> NDArray[np.float32]:
    """Return the depth (480, 640) of a mesh at a pose (4, 4) in the camera's frame."""
    step = np.float32(1.0 / KINECT.fx)
    u0, v0 = np.float32(-KINECT.cx / KINECT.fx), np.float32(-KINECT.cy / KINECT.fy)
    vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    depth, placed = np.full((640, 640), FAR, np.float32), pose.astype(np.float32)
    turn, origin = np.ascontiguousarray(placed[:3, :3]), placed[:3, 3]
    draw_mesh(vertices, faces, turn, *origin, depth, u0, v0, step, np.zeros_like(vertices))
    return depth[:480]


def _observed(
    number: int, layers: NDArray[np.float32], palette: Array, rng: np.random.Generator
) -> RgbdFrame:
    """Return the noisy frame of depth images (L, 480, 640); palette (1 + L, 3): what they show."""
    import cv2

    depth = np.minimum(layers.min(axis=0), 1.15).astype(np.float32)
    label = np.where(depth >= 1.15, 0, 1 + layers.argmin(axis=0))
    jitter = np.clip(np.round(rng.normal(0.0, 0.5, (2, 480, 640))), -1, 1).astype(int)
    rows = np.clip(np.arange(480)[:, None] + jitter[0], 0, 479)
    columns = np.clip(np.arange(640) + jitter[1], 0, 639)
    noisy = depth[rows, columns]
    noisy = noisy + rng.normal(0.0, 1.0, noisy.shape) * (0.0012 + 0.0019 * (noisy - 0.4) ** 2)
    edge = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3)))
    lost = (edge > 0.02) & (rng.random(depth.shape) < 0.5) | (rng.random(depth.shape) < 0.005)
    noisy[lost] = 0.0
    slope = cv2.Sobel(depth, cv2.CV_32F, 1, 0, ksize=3)[..., None]
    shade = 1.0 - 0.25 * np.clip(np.abs(slope) * 40.0, 0.0, 1.0)
    image = palette[label] * shade + rng.normal(0.0, 5.0, (480, 640, 3))
    stamp = round(number * 1e9 / 30)
    color_image = np.clip(image, 0, 255).astype(np.uint8)
    return RgbdFrame(stamp, color_image, noisy.astype(np.float32), KINECT)
