"""One explanation of the frames so far: a track of a right or a left hand, with its record."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_tracking.scene.body_state import start_state
from intent_tracking.scene.hand_model import Side
from intent_tracking.scene.packed_objects import PackedObjects
from intent_tracking.tracker.object_life import ObjectLife
from intent_tracking.tracker.problem import Fit
from intent_tracking.tracker.scene_track import SceneTrack

_USUAL_ROLL = np.radians(40.0)
"""Between the palm that looks down (0) and the thumb that points up (90 degrees)."""


@dataclass
class Hypothesis:
    """A track with its record."""

    track: SceneTrack
    lives: list[ObjectLife]
    mean_cost: float
    """Smoothed cost per hand pixel."""
    age: int = 0
    thin: int = 0
    """Frames in a row with hardly a hand pixel."""
    fit: Fit | None = None
    active: tuple[int, ...] = ()
    gap: float | None = None
    """Smoothed distance of the joints from where the networks see them [m]; None: not seen yet."""
    vain: int = 0
    """Other starts that explained the frames no better, in a row."""
    patience: int = 0
    """Frames for which no others are tried."""

    def note_vain(self, most: int) -> None:
        """Take note that other starts were no better: the next are tried the later, the more."""
        self.vain += 1
        self.patience = min(self.vain, most)

    def join(
        self, objects: PackedObjects, poses: list[Array], lives: list[ObjectLife | None]
    ) -> None:
        """Follow these objects from now on, and the hand as before.

        Args:
            objects: their shapes.
            poses: (4, 4) of each in the camera's frame.
            lives: of those that are followed already, None = at rest.
        """
        track = self.track
        rest = start_state(poses)
        track.before, track.state = rest.replaced([], track.before), rest.replaced([], track.state)
        track.objects = objects
        self.lives = [life or ObjectLife(pose) for life, pose in zip(lives, poses, strict=True)]
        self.fit, self.active = None, ()


def unusual_roll(side: Side, R_table_hand: Array) -> float:
    """Return how far a hand is turned about its forearm from the usual reach, 0 to 1.

    Fingers alone look like those of a right hand and, turned over or with the little finger for
    the thumb, of a left one; but people reach with the palm down or inwards, hardly ever with the
    palm or the little finger up.

    Args:
        side: of the hand.
        R_table_hand: (3, 3) axes of `hand_wrist` in the table frame, z up.
    """
    thumb = -1.0 if side == "right" else 1.0
    down, up = -R_table_hand[2, 2], thumb * R_table_hand[2, 1]
    return float(0.5 - 0.5 * (np.cos(_USUAL_ROLL) * down + np.sin(_USUAL_ROLL) * up))
