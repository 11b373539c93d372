"""Figures on bags with truth: the tracker starts by itself, every frame with a hand counts."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import transform_points
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.recording import Recording, track_bag
from intent_tracking.tracker.tracker_config import TrackerConfig
from intent_tracking.workshop.figures.benchmark_views import joint_deviation

LOST_ERROR = 0.1
"""Error that a frame without an answer counts as [m]: about a hand's half length."""


@dataclass(frozen=True, eq=False)
class BagErrors:
    """What a tracker got wrong on one bag."""

    name: str
    joints: Array
    """(V,) mean error of 21 landmarks in each frame with the hand in view, lost ones at
    `LOST_ERROR` [m]."""
    lost: Array
    """(V,) frames without an answer."""
    side_right: bool
    """Whether the last answer names the right hand."""
    seconds: Array
    """(F,) CPU time of each step [s]."""
    covered: Array
    """Share of landmark coordinates within two published deviations, every fourth frame."""
    objects: int
    """Number of objects that are followed."""


def bags_with_truth(folder: Path) -> list[Path]:
    """Return the bags below a folder that have a truth with a hand, sorted by name.

    Of a shipped bag and one of the same name that was generated again, the latter counts.
    """
    found = [*folder.glob("*/truth.npz"), *folder.glob("generated/*/truth.npz")]
    newest = {path.parent.name: path.parent for path in found}
    bags = [newest[name] for name in sorted(newest)]
    return [bag for bag in bags if np.any(np.load(bag / "truth.npz")["hand_in_view"])]


def bag_errors(bag: Path, config: TrackerConfig) -> BagErrors:
    """Return the errors on one bag, tracked as the command `track` does it.

    Objects start where the recogniser finds them in the first frame, the hand where the tracker
    finds it; nothing comes from the truth but the comparison.
    """
    with np.load(bag / "truth.npz") as file:
        truth = {name: file[name] for name in file.files}
    own = bag / "models.yaml"
    database = ObjectDatabase.load(own if own.exists() else None)
    return _compared(bag.name, track_bag(bag, database, config), truth)


def _compared(name: str, recording: Recording, truth: dict[str, Array]) -> BagErrors:
    stamps = np.array([state.stamp for state in recording.states])
    rows = np.searchsorted(truth["stamps"], stamps)
    seen = truth["hand_in_view"][rows]
    offset = np.linalg.norm(recording.joints_camera - truth["joints_camera"][rows], axis=2)
    error = offset.mean(axis=1)[seen]
    sides = [state.hand_side for state in recording.states if state.hand_tracked]
    return BagErrors(
        name,
        np.where(np.isnan(error), LOST_ERROR, error),
        np.isnan(error),
        bool(sides) and sides[-1] == str(truth["hand_side"]),
        recording.seconds,
        _covered(recording.states[::4], rows[::4], truth),
        len(recording.states[-1].object_ids),
    )


def _covered(
    states: tuple[SceneState, ...], rows: NDArray[np.int64], truth: dict[str, Array]
) -> Array:
    """Return (F,) for each tracked frame in view."""
    shares = []
    for state, row in zip(states, rows, strict=True):
        if state.hand_tracked and truth["hand_in_view"][row]:
            expected = transform_points(state.T_table_camera, truth["joints_camera"][row])
            offset = np.abs(state.joints_table - expected)
            shares.append(float((offset <= 2.0 * joint_deviation(state)).mean()))
    return np.array(shares)
