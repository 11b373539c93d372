"""True motions of demonstrations, from the first touch on: their pictures end at the grasp."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_inference.workshop.evaluation.shown_people import showing
from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import vector_from_pose


def shown_motions(seeds: Iterable[int]) -> dict[str, NDArray[Any]]:
    """Return the motions of demonstrations, left out where nobody shows anything.

    Args:
        seeds: of D demonstrations.

    Returns:
        `demonstration` (D,) seed; `objects` (D, F, 6) T_table_object as position [m] and rotation
        vector [rad], from the first touch on, zeros behind the last of `frames` (D,); `grasp` (D,)
        frame of the stable grasp; `hand` (D, 6) T_table_hand at that frame; `came_from` (D, 3) the
        wrist at the start [m]; `side` (D,) of the hand.
    """
    found = [(seed, shown) for seed in seeds if (shown := _shown(seed)) is not None]
    longest = max((len(objects) for _, (objects, *_) in found), default=0)
    poses = np.zeros((len(found), longest, 6), dtype=np.float32)
    for row, (_, (objects, *_)) in enumerate(found):
        poses[row, : len(objects)] = objects
    return {
        "demonstration": np.array([seed for seed, _ in found], dtype=np.int64),
        "objects": poses,
        "frames": np.array([len(own[0]) for _, own in found], dtype=np.int64),
        "grasp": np.array([own[1] for _, own in found], dtype=np.int64),
        "hand": np.array([own[2] for _, own in found], dtype=np.float32).reshape(-1, 6),
        "came_from": np.array([own[3] for _, own in found], dtype=np.float32).reshape(-1, 3),
        "side": np.array([own[4] for _, own in found]),
    }


def _shown(seed: int) -> tuple[Array, int, Array, Array, str] | None:
    """Return objects (F, 6), frame of the grasp, hand (6,), start (3,) and side of one motion."""
    try:
        shown = showing(seed)
    except ValueError:
        return None
    script = shown.script
    touch, grasp = script.touch_frames[0], script.grasp_frames[0]
    return (
        vector_from_pose(script.objects[touch:, 0]), grasp - touch,
        vector_from_pose(script.hands[grasp]), script.hands[0, :3, 3], shown.skin.hand.side,
    )  # fmt: skip
