"""The best poses of each model in each part of the image, kept while hypotheses are drawn.

Every cell of the image keeps a few poses of every model, so that neither a large model nor a large
object starves the others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel
from intent_perception.recognition.proposal.proposal_arrays import SlotArrays

CELL = 24
"""Edge of the image cells that keep hypotheses of their own [pixel]."""
_SAME_ROTATION = 0.93  # cosine below which two poses in a cell count as different


@dataclass(frozen=True, eq=False)
class Slots:
    """The best poses so far of each model in each image cell."""

    score: Floats
    """(M, C, K); -1 where the slot is free."""
    pose: Floats
    """(M, C, K, 12) rotation by rows and translation, object -> camera."""
    columns: int
    """Cells per image row."""

    @classmethod
    def empty(cls, models: int, height: int, width: int, depth: int) -> "Slots":
        """Return free slots for an image, depth of them per model and cell."""
        columns = width // CELL + 1
        cells = columns * (height // CELL + 1)
        score = np.full((models, cells, depth), -1.0, np.float32)
        return cls(score, np.zeros((models, cells, depth, 12), np.float32), columns)

    @property
    def arrays(self) -> SlotArrays:
        """The slots for compiled code."""
        return SlotArrays(self.score, self.pose, self.columns)

    def best(self, per_model: int) -> tuple[NDArray[np.int64], Floats]:
        """Return model (N,) and pose (N, 12) of the best slots of every model."""
        models, poses = [], []
        for number in range(len(self.score)):
            score = self.score[number].ravel()
            order = np.argsort(-score, kind="stable")[:per_model]
            order = order[score[order] > 0.0]
            models.append(np.full(len(order), number, np.int64))
            poses.append(self.pose[number].reshape(-1, 12)[order])
        return np.concatenate(models), np.concatenate(poses)


@borrowing_kernel
def keep(  # noqa: C901 (one kernel)
    score: float,
    rotation: Floats,
    translation: Floats,
    axis: Floats,
    intrinsics: Floats,
    columns: int,
    slot_score: Floats,
    slot_pose: Floats,
) -> None:
    """Put a pose of one model into its cell's slots (C, K) if it is better than what is there.

    A pose much like one that is there replaces that one or nothing; axis (3,) is the model's
    symmetry axis, around which poses do not differ (zero: none).
    """
    u = int(intrinsics[0] * translation[0] / translation[2] + intrinsics[2])
    v = int(intrinsics[1] * translation[1] / translation[2] + intrinsics[3])
    rows = slot_score.shape[0] // columns
    column = min(columns - 1, max(0, u // CELL))
    row = min(rows - 1, max(0, v // CELL))
    cell = row * columns + column
    symmetric = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2] > 0.5
    worst = 0
    for k in range(slot_score.shape[1]):
        if slot_score[cell, k] >= 0.0:
            if symmetric:
                alike = np.float32(0.0)
                for r in range(3):
                    mine = np.float32(0.0)
                    other = np.float32(0.0)
                    for c in range(3):
                        mine += rotation[r, c] * axis[c]
                        other += slot_pose[cell, k, 3 * r + c] * axis[c]
                    alike += mine * other
            else:
                trace = np.float32(0.0)
                for r in range(3):
                    for c in range(3):
                        trace += rotation[r, c] * slot_pose[cell, k, 3 * r + c]
                alike = (trace - np.float32(1.0)) * np.float32(0.5)
            if alike > _SAME_ROTATION:
                worst = k
                break
        if slot_score[cell, k] < slot_score[cell, worst]:
            worst = k
    if score <= slot_score[cell, worst]:
        return
    slot_score[cell, worst] = score
    for r in range(3):
        for c in range(3):
            slot_pose[cell, worst, 3 * r + c] = rotation[r, c]
        slot_pose[cell, worst, 9 + r] = translation[r]
