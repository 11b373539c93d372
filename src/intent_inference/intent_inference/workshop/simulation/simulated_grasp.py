"""One simulated, shaken grasp, and archives of many (npz, so that labels can be renewed)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from intent_inference.grasping.contacts import Contacts
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays

ARCHIVE_VERSION = 1
_ARRAYS = (
    "object_name", "preshape", "T_object_hand", "joints", "pregrasp", "approach", "held",
    "stability", "penetration", "residual", "contact_counts", "contact_points", "contact_normals",
    "contact_links", "contact_forces",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class SimulatedGrasp:
    """A grasp that passed the static filter and was shaken."""

    object_name: str
    preshape: str
    T_object_hand: Array
    """Settled pose (4, 4)."""
    joints: Array
    """Settled posture (J,) [rad]."""
    contacts: Contacts
    """Contacts with their forces, object frame."""
    held: bool
    """Whether the object stayed in all six directions."""
    stability: float
    """1 = it did not move, 0 = as far as allowed, below 0 = lost."""
    penetration: float
    """Deepest contact after settling [m]."""
    residual: float
    """Share of the weight that the contacts before settling could not hold."""
    pregrasp: Array
    """(J,) open posture before closing [rad]."""
    approach: Array
    """(3,) direction of the approach in the object frame."""


def save_grasps(path: Path, grasps: Sequence[SimulatedGrasp], **counters: Array) -> None:
    """Write grasps and counters to an npz file; an older file is replaced at once or not at all."""
    counts = np.array([len(grasp.contacts.points) for grasp in grasps], dtype=np.int64)
    contacts = [grasp.contacts for grasp in grasps]
    joints = len(grasps[0].joints) if grasps else 0
    arrays = {
        "version": np.array(ARCHIVE_VERSION),
        "object_name": np.array([grasp.object_name for grasp in grasps], dtype=str),
        "preshape": np.array([grasp.preshape for grasp in grasps], dtype=str),
        "T_object_hand": np.array([g.T_object_hand for g in grasps]).reshape(-1, 4, 4),
        "joints": np.array([g.joints for g in grasps]).reshape(-1, joints),
        "pregrasp": np.array([g.pregrasp for g in grasps]).reshape(-1, joints),
        "approach": np.array([g.approach for g in grasps]).reshape(-1, 3),
        "held": np.array([g.held for g in grasps], dtype=bool),
        "stability": np.array([g.stability for g in grasps], dtype=np.float64),
        "penetration": np.array([g.penetration for g in grasps], dtype=np.float64),
        "residual": np.array([g.residual for g in grasps], dtype=np.float64),
        "contact_counts": counts,
        "contact_points": np.concatenate([np.zeros((0, 3)), *[c.points for c in contacts]]),
        "contact_normals": np.concatenate([np.zeros((0, 3)), *[c.normals for c in contacts]]),
        "contact_links": np.concatenate([np.zeros(0, np.int64), *[c.links for c in contacts]]),
        "contact_forces": np.concatenate([np.zeros(0), *[c.forces for c in contacts]]),
        **counters,
    }
    write_arrays(path, arrays)


def load_grasps(path: Path) -> tuple[list[SimulatedGrasp], dict[str, Array]]:
    """Return the grasps of an npz file and the other arrays stored with them.

    Raises:
        ValueError: if the file is damaged or of another version.
    """
    try:
        arrays = read_arrays(path, "archive of grasps")
    except ValueError as error:
        raise ValueError(f"{path}: expected an archive of grasps ({error}); delete it") from error
    if int(arrays.get("version", -1)) != ARCHIVE_VERSION:
        raise ValueError(
            f"{path}: expected version {ARCHIVE_VERSION}; delete it and simulate again"
        )
    if missing := [name for name in _ARRAYS if name not in arrays]:
        raise ValueError(f"{path}: expected the arrays {', '.join(missing)}; delete it")
    ends = np.cumsum(arrays["contact_counts"])
    grasps = []
    for index, end in enumerate(ends):
        part = slice(int(end - arrays["contact_counts"][index]), int(end))
        grasps.append(
            SimulatedGrasp(
                str(arrays["object_name"][index]),
                str(arrays["preshape"][index]),
                arrays["T_object_hand"][index],
                arrays["joints"][index],
                Contacts(
                    arrays["contact_points"][part],
                    arrays["contact_normals"][part],
                    arrays["contact_links"][part],
                    arrays["contact_forces"][part],
                ),
                bool(arrays["held"][index]),
                float(arrays["stability"][index]),
                float(arrays["penetration"][index]),
                float(arrays["residual"][index]),
                arrays["pregrasp"][index],
                arrays["approach"][index],
            )
        )
    return grasps, arrays
