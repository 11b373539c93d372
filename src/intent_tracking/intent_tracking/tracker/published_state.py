"""What the tracker says about a frame, as the contract's 26 + 6 N values."""

from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.recognition.recognizer import RecognizedObjects
from intent_tracking.scene.hand_model import Side
from intent_tracking.scene.scene_state import SceneState
from intent_tracking.scene.state_layout import HAND_SIZE
from intent_tracking.tracker.hypotheses.hypothesis import Hypothesis
from intent_tracking.tracker.uncertainty import state_deviation


@dataclass(frozen=True, eq=False)
class Shown:
    """What is believed after a frame."""

    hypothesis: Hypothesis
    """With a hand or, if there is none, of the objects alone."""
    tracked: bool
    """Whether it has a hand."""
    visible: bool
    """Whether something like a hand is in view."""
    side: Side
    """Of the hand, or of the last one."""
    shape: Array
    """(22,) of the demonstrator's hand."""


def published_state(
    stamp: int, objects: RecognizedObjects, shown: Shown, unseen_frames: int
) -> SceneState:
    """Return the state of a frame; a hand that is not tracked has NaN for its 26 values.

    Args:
        stamp: of the frame [ns].
        objects: that the tracker was started with.
        shown: what is believed.
        unseen_frames: after which an object that should be seen is lost.
    """
    track, lives = shown.hypothesis.track, shown.hypothesis.lives
    values = track.state.vector(objects.T_table_camera)
    fit = shown.hypothesis.fit if shown.tracked else None
    active = shown.hypothesis.active if shown.tracked else ()
    deviation = state_deviation(fit, active, len(lives))
    if not shown.tracked:
        values[:HAND_SIZE] = deviation[:HAND_SIZE] = np.nan
    return SceneState(
        stamp,
        shown.side,
        values,
        deviation,
        shown.shape,
        tuple(o.id for o in objects.objects),
        tuple(o.model for o in objects.objects),
        tuple(o.object_class for o in objects.objects),
        np.asarray(objects.T_table_camera, dtype=np.float64),
        float(track.cost) if shown.tracked else float("nan"),
        shown.visible,
        shown.visible and not shown.tracked,
        tuple(life.unseen > unseen_frames for life in lives),
    )
