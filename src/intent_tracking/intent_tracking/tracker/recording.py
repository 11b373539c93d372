"""A whole recording through recognition and tracking, without ROS."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from intent_perception.bags.bag_files import read_frames
from intent_perception.bags.bag_topics import BagInput
from intent_perception.basics.arrays import Array
from intent_perception.geometry.camera import RgbdFrame, depth_advice
from intent_perception.geometry.transforms import inverse
from intent_perception.objects.database import ModelSource, ObjectDatabase
from intent_perception.recognition.detector_config import DetectorConfig
from intent_perception.recognition.recognizer import (
    RecognizedObjects,
    Recognizer,
    RecognizerConfig,
    table_alone,
)
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.tracker.tracker import Tracker
from intent_tracking.tracker.tracker_config import TrackerConfig

_BAD = "left out: "


@dataclass(frozen=True, eq=False)
class Recording:
    """Every state of a recording and the CPU time it took."""

    states: tuple[SceneState, ...]
    seconds: Array
    """(F,) CPU time of each step [s]."""

    @property
    def joints_camera(self) -> Array:
        """(F, 21, 3) hand landmarks in the camera's frame [m]; NaN where the hand is unknown."""
        return np.stack([state.joints_camera for state in self.states])

    @property
    def objects_camera(self) -> Array:
        """(F, N, 4, 4) object poses in the camera's frame."""
        return np.stack([inverse(s.T_table_camera) @ s.T_table_objects for s in self.states])

    @property
    def arrays(self) -> dict[str, Array]:
        """The arrays of the command `track`, by name."""
        sides = [state.hand_side for state in self.states if state.hand_tracked]
        last = self.states[-1]
        return {
            "stamp": np.array([state.stamp for state in self.states]) * 1e-9,
            "state": np.stack([state.state for state in self.states]),
            "state_std": np.stack([state.state_std for state in self.states]),
            "joints_camera": self.joints_camera,
            "objects_camera": self.objects_camera,
            "object_ids": np.array(last.object_ids, dtype=np.str_),
            "hand_side": np.array(sides[-1] if sides else last.hand_side),
            "hand_shape": last.hand_shape,
            "cost": np.array([state.cost for state in self.states]),
            "lost": np.array([state.hand_lost for state in self.states]),
            "visible": np.array([state.hand_visible for state in self.states]),
            "seconds": self.seconds,
        }


def track_frames(
    frames: Iterable[RgbdFrame],
    objects: RecognizedObjects,
    models: ModelSource,
    config: TrackerConfig,
) -> Recording:
    """Return the recording of frames that begin with recognised objects."""
    tracker = Tracker(models, config)
    tracker.start(objects)
    return follow(tracker, frames)


def follow(tracker: Tracker, frames: Iterable[RgbdFrame]) -> Recording:
    """Return the recording of a tracker that has been started.

    Raises:
        ValueError: if there is no frame.
    """
    states, seconds = [], []
    for frame in frames:
        began = time.process_time()
        states.append(tracker.step(frame))
        seconds.append(time.process_time() - began)
    if not states:
        raise ValueError("expected at least one frame to track")
    return Recording(tuple(states), np.array(seconds))


def track_bag(
    bag: Path,
    database: ObjectDatabase,
    config: TrackerConfig,
    chosen: tuple[str, ...] | None = (),
    warn: Callable[[str], None] = lambda _: None,
    given: BagInput | None = None,
) -> Recording:
    """Return the recording of a bag whose first frame shows the objects at rest.

    Where no object or no table is seen the hand is followed alone.

    Args:
        bag: rosbag2 folder.
        database: what may stand on the table.
        config: of the tracker.
        chosen: names of the only objects to look for; empty = the whole database, None = no object.
        warn: told, once each, what is missing and what follows from it, and each damaged frame.
        given: the bag's topics and depth unit; None = both are found.

    Raises:
        ValueError: if the bag cannot be read or no frame of it is whole.
    """
    frames: Iterator[RgbdFrame] = read_frames(
        bag, on_bad_frame=lambda text: warn(f"{_BAD}{text}"), given=given
    )
    first = next(frames)
    config_of_objects = RecognizerConfig(DetectorConfig(estimate=not chosen))
    database = database.select(chosen) if chosen else database
    recognizer = Recognizer(database, config_of_objects)
    found = table_alone(first) if chosen is None else recognizer.step(first)
    assert found is not None  # the first frame always gives an answer
    if not found.table_seen:
        warn(
            "no table is seen in the first frame: only the hand is followed, no objects"
            + depth_advice(first.depth)
        )
    elif not found.objects and chosen is not None:
        warn(
            "no object of the database is seen in the first frame: the hand is followed alone; "
            "give its model by --models, or start the recording with the objects at rest"
        )
    tracker = Tracker(database, config)
    if tracker.trouble:
        warn(tracker.trouble)
    tracker.start(found)
    return follow(tracker, _with_first(first, frames))


def _with_first(first: RgbdFrame, others: Iterator[RgbdFrame]) -> Iterator[RgbdFrame]:
    yield first
    yield from others
