"""Figures on real hand motions: DexYCB motion capture, worn by the demonstrator's skin.

Motion is real, pixels are rendered. The bare hand and forearm move before a plain wall without
table or object; the tracker starts and ends on its own.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import KINECT, RgbdFrame
from intent_perception.geometry.mesh import Mesh
from intent_perception.geometry.rendering import render
from intent_perception.geometry.transforms import (
    make_pose,
    rotation_from_vector,
    transform_points,
    vector_from_rotation,
)
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_perception.workshop.scenes.sensor_noise import KinectNoise, observe
from intent_tracking.tracker.recording import Recording, track_frames
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_bags import LOST_ERROR
from intent_tracking.workshop.figures.benchmark_views import joint_deviation
from intent_tracking.workshop.person.body.person_hand import (
    LOWER,
    UPPER,
    DemonstratorHand,
    sample_hand,
)
from intent_tracking.workshop.person.body.skin import Skin, make_skin
from intent_tracking.workshop.person.filming.film import in_view

FRAMES = 45
WALL = 1.5
"""Distance of the wall [m]."""
_ORDER = [0, 13, 14, 15, 16, 1, 2, 3, 17, 4, 5, 6, 18, 10, 11, 12, 19, 7, 8, 9, 20]
"""The contract's 21 joints in the order of the data."""


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """One sequence as the demonstrator's hand performs it."""

    poses: Array
    """(F, 4, 4) wrist in the camera's frame."""
    angles: Array
    """(F, 20) [rad]."""


def data_file() -> Path:
    """Return where the motion capture is, see `INTENT_DATA`."""
    folder = Path(os.environ.get("INTENT_DATA", "../shared/data"))
    return folder / "hands" / "dexycb_poses_subjects_1_to_5_right.npz"


def motion_figures(seed: int, sequences: int) -> dict[str, Any] | None:
    """Return error and share of kept sequences; None where the data is absent.

    Every frame counts in which the hand is in view as the bags define it. Kept: it is known in nine
    of ten of these and 30 mm off on average at most. The error is the mean over the frames of all
    sequences, lost frames at `LOST_ERROR`.
    """
    if not data_file().is_file():
        return None
    rng = np.random.default_rng([seed, 3])
    errors, kept, lost, seconds, covered = [], [], [], [], []
    for joints in recorded(sequences, rng):
        hand = sample_hand(rng)
        motion = performed(joints, hand)
        frames = list(filmed(motion, make_skin(hand, 0.003), rng))
        config = TrackerConfig(seed=seed, table=False)
        nothing = RecognizedObjects(0, (), np.eye(4))
        recording = track_frames(frames, nothing, {}, config)
        truth = np.stack(
            [
                transform_points(pose, hand.joint_positions(angles))
                for pose, angles in zip(motion.poses, motion.angles, strict=True)
            ]
        )
        seen = np.array([in_view(t, f.depth) for t, f in zip(truth, frames, strict=True)])
        if not seen.any():
            continue
        error = np.linalg.norm(recording.joints_camera - truth, axis=2).mean(axis=1)[seen]
        known = ~np.isnan(error)
        kept.append(bool(known.mean() >= 0.9 and error[known].mean() <= 0.03))
        errors.append(np.where(known, error, LOST_ERROR))
        lost.append(~known)
        seconds.append(recording.seconds[3:])
        covered += _covered(recording, truth, seen)
    return {
        "joint_error_mm": 1e3 * float(np.concatenate(errors).mean()),
        "kept_fraction": float(np.mean(kept)),
        "lost_fraction": float(np.concatenate(lost).mean()),
        "coverage_2sigma": float(np.mean(covered)),
        "sequences": len(kept),
        "cpu_ms_per_frame": 1e3 * float(np.concatenate(seconds).mean()),
        "each_mm": [round(1e3 * float(e.mean()), 1) for e in errors],
    }


def _covered(recording: Recording, truth: Array, seen: NDArray[np.bool_]) -> list[float]:
    """Return the share of covered landmark coordinates, every fourth frame with a known hand."""
    shares = []
    for number in range(0, len(truth), 4):
        state = recording.states[number]
        if state.hand_tracked and seen[number]:
            offset = np.abs(state.joints_table - truth[number])  # the table's frame is the camera's
            shares.append(float((offset <= 2.0 * joint_deviation(state)).mean()))
    return shares


def recorded(sequences: int, rng: np.random.Generator) -> Iterator[Array]:
    """Yield the joints (FRAMES, 21, 3) [m] of random stretches with a valid hand."""
    with np.load(data_file()) as data:
        joints, number, valid = data["joints"], data["seq"], data["hand_valid"]
    stretches = []
    for sequence in np.unique(number):
        rows = np.flatnonzero((number == sequence) & valid)
        if len(rows) >= FRAMES and np.all(np.diff(rows[:FRAMES]) == 1):
            stretches.append(rows[:FRAMES])
    for choice in rng.permutation(len(stretches))[:sequences]:
        yield joints[stretches[choice]][:, _ORDER].astype(np.float64)


def performed(joints: Array, hand: DemonstratorHand) -> RecordedMotion:
    """Return the poses of a hand nearest to recorded joints (F, 21, 3) [m]."""
    poses, angles = [], []
    start = _first_guess(joints[0])
    for target in joints:
        start = least_squares(_residuals, start, args=(target, hand), max_nfev=12, x_scale="jac").x
        start[6:] = np.clip(start[6:], LOWER, UPPER)
        poses.append(make_pose(rotation_from_vector(start[3:6]), start[:3]))
        angles.append(start[6:].copy())
    return RecordedMotion(np.array(poses), np.array(angles))


def _first_guess(target: Array) -> Array:
    x = target[9] - target[0]
    x /= np.linalg.norm(x)
    z = np.cross(x, target[17] - target[5])
    z /= np.linalg.norm(z)
    rotation = np.stack([x, np.cross(z, x), z], axis=1)
    relaxed = np.radians([25, 0, 10, 10, *([0, 20, 20, 10] * 4)])
    return np.concatenate([target[0], vector_from_rotation(rotation), relaxed])


def _residuals(state: Array, target: Array, hand: DemonstratorHand) -> Array:
    placed = hand.joint_positions(state[6:]) @ rotation_from_vector(state[3:6]).T + state[:3]
    beyond = np.minimum(state[6:] - LOWER, 0.0) + np.maximum(state[6:] - UPPER, 0.0)
    return np.concatenate([(placed - target).ravel(), 0.1 * beyond])


def filmed(motion: RecordedMotion, skin: Skin, rng: np.random.Generator) -> Iterator[RgbdFrame]:
    """Yield the frames of a motion before a plain wall."""
    tone = np.array([0.80, 0.60, 0.50]) * rng.uniform(0.8, 1.1)
    wall = rng.uniform(0.35, 0.6) * np.array([1.0, 1.02, 1.05])
    for number, (pose, angles) in enumerate(zip(motion.poses, motion.angles, strict=True)):
        mesh = Mesh.of(skin.posed(angles), skin.faces())
        view = render(KINECT, [mesh], pose[None], tone[None])
        assert view.color is not None
        empty = view.label < 0
        depth = np.where(empty, np.float32(WALL), view.depth).astype(np.float32)
        color = np.where(empty[..., None], (255.0 * wall).astype(np.uint8), view.color)
        depth, color = observe(depth, color.astype(np.uint8), rng, KinectNoise())
        yield RgbdFrame(round(number * 1e9 / 30), color, depth, KINECT)
