"""The file truth.npz beside a bag: optional, and compared only once the results are written."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_imitation.demo.run_record import DemoTruth
from intent_perception.basics.array_files import read_arrays
from intent_tracking.scene.scene_state import SceneState

_JOINTS = (21, 3)


def truth_of(bag: str, states: Sequence[SceneState]) -> DemoTruth | None:
    """Return what the file truth.npz beside a bag says; None without one. No node reads it.

    Raises:
        ValueError: if there is a file of this name that holds something else.
    """
    path = Path(bag) / "truth.npz"
    if not path.exists():
        return None
    stored = read_arrays(path, "truth of a bag")
    try:
        return _compared(stored, states)
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise ValueError(
            f"{path} is no truth of a bag as bags/make.py writes it ({error}); it is left aside"
        ) from error


def _compared(stored: Mapping[str, NDArray[Any]], states: Sequence[SceneState]) -> DemoTruth:
    stamps, joints, in_view = stored["stamps"], stored["joints_camera"], stored["hand_in_view"]
    if stamps.ndim != 1 or joints.shape != (len(stamps), *_JOINTS) or len(in_view) != len(stamps):
        raise ValueError(
            f"expected joints_camera {(len(stamps), *_JOINTS)} and hand_in_view for each of the "
            f"stamps, got {joints.shape} and {in_view.shape}"
        )
    rows = {int(stamp): index for index, stamp in enumerate(stamps)}
    errors = [
        np.linalg.norm(state.joints_camera - joints[rows[state.stamp]], axis=1)
        for state in states
        if state.hand_tracked and state.stamp in rows and in_view[rows[state.stamp]]
    ]
    tasks, grasps = np.atleast_1d(stored["task"]), np.atleast_1d(stored["grasp_stamp"])
    return DemoTruth(
        task=str(tasks[0]) if len(tasks) else None,
        grasp_stamp=int(grasps[0]) if len(grasps) else None,
        joint_error=float(np.mean(errors)) if errors else None,
        synthetic="label_names" in stored,  # only a simulation can label grasps
    )
