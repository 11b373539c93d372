"""Made-up grasp tables whose labels follow from the pose: quick data for tests of learning."""

import numpy as np

from intent_inference.workshop.training.labelled_table import GraspTable
from intent_perception.geometry.transforms import quaternion_from_rotation, rotation_from_vector

CLASSES = ("bottle", "mug", "hammer")


def made_up_grasps(rows: int, seed: int = 0) -> GraspTable:
    """Hands at random sides of three kinds of object; each task is a rule on class and pose."""
    rng = np.random.default_rng(seed)
    kind = rng.integers(0, 3, rows)
    base = np.array([[0.07, 0.07, 0.23], [0.1, 0.08, 0.1], [0.12, 0.035, 0.3]])
    item = rng.integers(0, 4, rows)
    size = base[kind] * (0.85 + 0.1 * item[:, None]) + rng.normal(0.0, 0.001, (rows, 3))
    position = rng.normal(size=(rows, 3))
    position /= np.linalg.norm(position, axis=1, keepdims=True)
    turn = rng.normal(0.0, 0.8, (rows, 3))
    rotation = rotation_from_vector(turn)
    joints = rng.normal(0.0, 0.3, (rows, 3)) @ np.random.default_rng(1).normal(size=(3, 20))
    volume = np.clip(0.6 + 0.2 * position[:, :1] + rng.normal(0.0, 0.05, (rows, 1)), 0.0, 1.0)
    noise = rng.normal(0.0, 0.1, (2, rows))
    pouring = (kind < 2) & (position[:, 2] + noise[0] < 0.2) & (rotation[:, 2, 1] < 0.3)
    handing = volume[:, 0] + noise[1] > 0.6
    return GraspTable(
        features={
            "obcl": np.array(CLASSES)[kind],
            "size": size,
            "conv": np.clip(np.array([0.9, 0.7, 0.55])[kind] + rng.normal(0, 0.02, rows), 0, 1)[
                :, None
            ],
            "dir": quaternion_from_rotation(rotation),
            "npos": position,
            "fcon": joints,
            "fvol": volume,
        },
        labels={"pouring": pouring.astype(float), "hand-over": handing.astype(float)},
        columns={
            "object_id": np.array([f"{CLASSES[k]}_{i}" for k, i in zip(kind, item, strict=True)])
        },
    )
