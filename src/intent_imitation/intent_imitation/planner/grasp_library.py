"""Preplanned grasps of the robot's hand, stored per object and never with labels or margins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_imitation import SHARE
from intent_imitation.planner.class_from_shape import Kinds
from intent_inference.grasping.grasping_hand import GraspingHand
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays
from intent_perception.geometry.transforms import require_pose
from intent_tracking.grasp.grasp_features import GraspedShape, grasp_features

LIBRARIES = SHARE / "libraries"


_BOUNDS: dict[str, tuple[tuple[int, ...] | None, float]] = {
    "approach": ((3,), 1.01),
    "pregrasp_joints": (None, 10.0),
    "grasp_joints": (None, 10.0),
    "stability": ((), 1.0),
    "free_volume": ((1,), 1.0),
    "contact_center": ((3,), 10.0),
    "grasped_box": ((3,), 2.0),
}
"""Shape of a row of each array, and the greatest value that it may hold."""


@dataclass(frozen=True, eq=False)
class GraspSet:
    """G grasps of one object, all in the object frame."""

    T_object_hand: Array
    """(G, 4, 4) base of the hand when the fingers have closed."""
    approach: Array
    """(G, 3) unit direction of the approach in the object frame."""
    pregrasp_joints: Array
    """(G, J) [rad]."""
    grasp_joints: Array
    """(G, J) [rad]."""
    stability: Array
    """(G,) in [0, 1]: shaken grasps by their rest after the shake, others by the static filter."""
    free_volume: Array
    """(G, 1) `fvol` of Table I."""
    contact_center: Array
    """(G, 3) `coc` of Table I."""
    grasped_box: Array
    """(G, 3) `gbvl` of Table I [m]."""
    shaken: NDArray[np.bool_]
    """(G,) whether the grasp passed the shake test."""

    def __post_init__(self) -> None:
        count = len(self.T_object_hand)
        for field in fields(self):
            if len(getattr(self, field.name)) != count:
                raise ValueError(f"expected {count} rows of {field.name}")
        require_pose(self.T_object_hand, "T_object_hand")
        for name, (width, largest) in _BOUNDS.items():
            values = getattr(self, name)
            expected = values.shape[1:] if width is None else width
            if values.shape != (count, *expected) or not np.all(np.abs(values) <= largest):
                raise ValueError(
                    f"expected {name} of {(count, *expected)} within {largest:g}, "
                    f"got {values.shape} or others"
                )

    def __len__(self) -> int:
        return len(self.T_object_hand)


def grasp_set(
    geometry: GraspedShape,
    hand: GraspingHand,
    T_object_hand: Array,
    approach: Array,
    pregrasp_joints: Sequence[Array],
    grasp_joints: Sequence[Array],
    stability: Array,
    shaken: bool,
) -> GraspSet:
    """Return grasps of one object together with their constraint features of Table I.

    Args:
        geometry: the object.
        hand: the robot's hand.
        T_object_hand: (G, 4, 4) final poses.
        approach: (G, 3) unit directions in the object frame.
        pregrasp_joints: G open postures (J,) [rad].
        grasp_joints: G closed postures (J,) [rad].
        stability: (G,) in 0..1.
        shaken: whether they passed the shake test.
    """
    if len(T_object_hand) == 0:
        return empty_set(len(hand.table.joint_names))
    features = [
        grasp_features(geometry, pose, joints, hand.table)
        for pose, joints in zip(T_object_hand, grasp_joints, strict=True)
    ]
    return GraspSet(
        T_object_hand,
        approach,
        np.array(pregrasp_joints),
        np.array(grasp_joints),
        np.clip(stability, 0.0, 1.0),
        np.array([f.fvol for f in features]),
        np.array([f.coc for f in features]),
        np.array([f.gbvl for f in features]),
        np.full(len(features), shaken),
    )


def empty_set(joints: int) -> GraspSet:
    """Return no grasps of a hand with J joints."""
    return GraspSet(
        np.zeros((0, 4, 4)),
        np.zeros((0, 3)),
        np.zeros((0, joints)),
        np.zeros((0, joints)),
        np.zeros(0),
        np.zeros((0, 1)),
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        np.zeros(0, dtype=bool),
    )


NOTHING_KNOWN = Kinds((), (), np.zeros((0, 0)))


@dataclass(frozen=True, eq=False)
class GraspLibrary:
    """Grasp sets of the objects that the robot has practised with."""

    hand: str
    """Name or file of the robot's hand, see `GraspingHand.load`."""
    sets: Mapping[str, GraspSet]
    """By model name."""
    kinds: Kinds = NOTHING_KNOWN
    """What the objects that the robot has practised with look like."""

    @classmethod
    def load(cls, path: Path | None = None, hand: str = "schunk") -> "GraspLibrary":
        """Return the library of a file, or the shipped one of a hand.

        Raises:
            ValueError: if the file is missing or damaged, with the remedy.
        """
        source = path if path is not None else LIBRARIES / f"{hand}.npz"
        remedy = "rebuild it: python -m intent_imitation.build_library"
        if not source.exists():
            raise ValueError(f"no grasp library {source}; {remedy}")
        try:
            columns = read_arrays(source, "grasp library")
            name = str(columns.pop("hand"))
            models, rows = columns.pop("models"), columns.pop("model")
            kinds = _kinds(columns)
            sets = {str(m): _rows(columns, rows == k) for k, m in enumerate(models)}
        except (KeyError, ValueError, IndexError, TypeError, AttributeError) as error:
            raise ValueError(f"damaged grasp library {source} ({error}); {remedy}") from error
        joints = len(GraspingHand.load(name).table.joint_names)
        for model, grasps in sets.items():
            widths = grasps.grasp_joints.shape[1:], grasps.pregrasp_joints.shape[1:]
            if widths != ((joints,), (joints,)):
                raise ValueError(f"library {source}: {model} is for another hand; {remedy}")
        return cls(name, sets, kinds)

    def save(self, path: Path) -> None:
        """Write the library to an .npz file without pickle; lengths and angles as float32."""
        models = sorted(self.sets)
        columns: dict[str, NDArray[np.generic]] = {
            "hand": np.array(self.hand),
            "models": np.array(models),
            "model": np.concatenate(
                [np.full(len(self.sets[m]), k, dtype=np.int16) for k, m in enumerate(models)]
            ),
            "kind_names": np.array(self.kinds.names, dtype=np.str_),
            "kind_classes": np.array(self.kinds.classes, dtype=np.str_),
            "kind_shapes": self.kinds.shapes.astype(np.float32),
        }
        for field in fields(GraspSet):
            values = np.concatenate([getattr(self.sets[m], field.name) for m in models])
            columns[field.name] = values if values.dtype == bool else values.astype(np.float32)
        write_arrays(path, columns)


def _kinds(columns: dict[str, NDArray[np.generic]]) -> Kinds:
    """Take the practised objects' shapes out of the columns of a file."""
    names, classes = columns.pop("kind_names"), columns.pop("kind_classes")
    shapes = columns.pop("kind_shapes").astype(np.float64)
    return Kinds(tuple(map(str, names)), tuple(map(str, classes)), shapes)


def _rows(columns: Mapping[str, NDArray[np.generic]], chosen: NDArray[np.bool_]) -> GraspSet:
    """Return the chosen rows as a grasp set of float64."""
    values = {}
    for field in fields(GraspSet):
        column = columns[field.name][chosen]
        values[field.name] = column if column.dtype == bool else column.astype(np.float64)
    return GraspSet(**values)  # type: ignore[arg-type]
