"""Demonstrations that somebody shows, kept as a table for `train add` and as timelines."""

import csv
import io
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from intent_inference.quantisation.grasp_cells import Row, feature_cells, write_cells
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_text
from intent_perception.basics.safe_files import check_place, write_arrays
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.scene.scene_state import SceneState

_LARGEST = 64 << 20
"""Bytes of a table."""
_FRAMES = 3600
"""Frames of a timeline that are kept, two minutes."""
_FREE_AFTER = 1_000_000_000
"""A demonstration has ended when no hand has been in view for so long [ns]."""


class DemonstrationLog:
    """One row for each grasp, and what led to it and followed from it as a file of its own."""

    def __init__(self, table: Path, timelines: Path | None = None) -> None:
        """Begin, or go on with a table that is there.

        Args:
            table: .csv or .csv.gz, columns as `simulate` writes them.
            timelines: folder for one .npz for each grasp, as `observe` reads them; None: none.

        Raises:
            ValueError: if the table cannot be read or written.
        """
        check_place(table)
        self._table, self._timelines = table, timelines
        self._rows: list[Row] = list(_rows_of(table)) if table.exists() else []
        self._states: deque[SceneState] = deque(maxlen=_FRAMES)
        self._grasp: StableGrasp | None = None
        self._seen = -1

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._rows)

    def add(self, grasp: StableGrasp, labels: dict[str, int]) -> None:
        """Write a grasp down.

        Args:
            grasp: as the detector found it.
            labels: 1 for each task that it was shown for, 0 for each that it does not serve;
                others stay unknown.
        """
        self.finish()
        self._grasp = grasp
        row: Row = {"object_id": grasp.object_id, **feature_cells(grasp.features)}
        self._rows.append({**row, **labels, "hand_side": grasp.hand_side})
        self._write()

    def note_state(self, state: SceneState) -> None:
        """Take a frame of the timeline."""
        if self._states and state.stamp < self._states[-1].stamp:
            self._states.clear()  # another recording
        if state.hand_visible:
            self._seen = state.stamp
        self._states.append(state)
        if self._grasp is not None and state.stamp - self._seen > _FREE_AFTER:
            self.finish()

    def undo(self) -> bool:
        """Take the last row back; False if there is none."""
        if not self._rows:
            return False
        self._rows.pop()
        self._grasp = None
        self._write()
        return True

    def finish(self) -> Path | None:
        """Write the timeline of the last grasp, if there is one and it is wanted."""
        grasp, self._grasp = self._grasp, None
        if grasp is None or self._timelines is None:
            return None
        arrays = timeline_of(list(self._states), grasp)
        if arrays is None:
            return None
        self._timelines.mkdir(parents=True, exist_ok=True)
        path = self._timelines / f"{self._table.name.partition('.')[0]}_{len(self._rows):04d}.npz"
        write_arrays(path, arrays)
        return path

    def _write(self) -> None:
        columns = list(dict.fromkeys(name for row in self._rows for name in row))
        write_cells(self._table, columns or ["object_id"], self._rows)


def timeline_of(states: Sequence[SceneState], grasp: StableGrasp) -> dict[str, Array] | None:
    """Return arrays as `observe` reads them, of the frames in which the hand is tracked.

    `stamp` (F,) [s], `joints` (F, 21, 3) [m] in the table's frame, `T_object` (F, 4, 4) of the
    grasped object, `object_model`, `hand_side`; None if there is no such frame.
    """
    rows = [
        (state.stamp * 1e-9, state.joints_table, pose)
        for state in states
        if state.hand_tracked and grasp.object_id in state.object_ids
        if np.isfinite(pose := state.T_table_objects[state.object_ids.index(grasp.object_id)]).all()
    ]
    if not rows:
        return None
    stamps, joints, poses = (np.array(column) for column in zip(*rows, strict=True))
    return {
        "stamp": stamps,
        "joints": joints,
        "T_object": poses,
        "object_model": np.array(grasp.object_model),
        "hand_side": np.array(grasp.hand_side),
        "grasp_stamp": np.array(grasp.stamp * 1e-9),
    }


def _rows_of(path: Path) -> list[Row]:
    """Return the rows of a table that is there, as they stand."""
    try:
        lines = list(csv.DictReader(io.StringIO(read_text(path, _LARGEST)), strict=True))
    except (ValueError, csv.Error) as error:
        raise ValueError(f"{path}: expected a table of grasps ({error})") from error
    if lines and "object_class" not in lines[0]:
        raise ValueError(f"{path} is no table of grasps: it has no column object_class")
    return [{name: value for name, value in line.items() if value} for line in lines]
