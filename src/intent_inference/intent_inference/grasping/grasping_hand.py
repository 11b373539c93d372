"""A hand that can grasp: joint table, pre-shapes, grip torques and the spheres that cover it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from intent_inference import SHARE
from intent_inference.grasping.hand_spheres import SphereArrays, spheres_of
from intent_inference.grasping.schunk import schunk_hand
from intent_inference.grasping.urdf import table_from_urdf
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_yaml
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.joint_table import JointTable

HANDS = SHARE / "hands"
_LARGEST_SPAN = 10.0
"""No length [m], share or speed of a pre-shape is larger."""


@dataclass(frozen=True, eq=False)
class Preshape:
    """An open posture, how it closes, and where it wants the object; see share/hands."""

    name: str
    weight: float
    approach: Array
    """(3,) unit vector in the hand frame along which the hand approaches."""
    closing: Array
    """(3,) unit vector in the hand frame along which the fingers oppose each other."""
    center: Array
    """(3,) point of the hand frame that should meet the object [m]."""
    widest: float
    """Widest object along `closing` [m]."""
    stop: Literal["contact", "center"]
    depth: tuple[float, float]
    """Range of how deep `center` may enter the box face where `stop` is center [m]."""
    offset: tuple[float, float]
    """How far the centre may slide in the box face, shares of its half edges: across, along."""
    side: float
    """0: the object's middle meets `center`; -1 or 1: its surface on this side of `closing`."""
    thickest: float
    """Thickest object along `approach` [m]."""
    jitter: float
    """Factor on the spread of roll and tilt."""
    near_mass: bool
    """Whether places near the centre of mass are preferred."""
    place: Literal["face", "loop", "rim"]
    """What it takes: a box face, the loop of a vessel's handle, the rim of an opening."""
    residual: float | None
    """Limit of the static filter, see `FilterConfig`, where the first contacts say little."""
    open: Array
    """(J,) posture before closing [rad], of sliding joints [m]."""
    rates: Array
    """(J,) relative closing speeds; 0 stays; of sliding joints metres where others turn 1 rad."""


@dataclass(frozen=True, eq=False)
class GraspingHand:
    """Everything that the simulation needs to know about one hand."""

    name: str
    table: JointTable
    chains: tuple[str, ...]
    """Names of the fingers in the order of the table."""
    preshapes: tuple[Preshape, ...]
    effort: Array
    """(J,) torque limit of each joint [N m]."""
    grips: dict[str, Array]
    """Share of the torque limits (J,) that each pre-shape uses: a pinch balances the fingers."""
    arrays: SphereArrays
    strength: float
    """Sum of the normal forces that the static filter lets it exert [N]."""
    squeeze: float
    """The fingers' targets lie this far beyond the contact, times the closing speed [rad]."""

    @property
    def is_human(self) -> bool:
        """Whether the rules about forearm, palm and thumb side apply."""
        return self.name == "human"

    @classmethod
    def load(cls, source: str | Path) -> "GraspingHand":
        """Return a hand by name (`human`, `schunk`) or from a file like those in share/hands.

        Raises:
            ValueError: if the file does not describe a hand, with the reason.
        """
        shipped = HANDS / f"{source}.yaml"
        path = shipped if shipped.is_file() else Path(source)
        if not path.is_file():
            known = sorted(p.stem for p in HANDS.glob("*.yaml"))
            raise ValueError(f"no hand {source!r}: expected one of {known} or a YAML file")
        description = read_yaml(path)
        if not isinstance(description, dict) or "table" not in description:
            raise ValueError(f"{path}: expected the keys table and preshapes")
        try:
            return cls.from_description(path.stem, description, path.parent)
        except (KeyError, TypeError, AttributeError, IndexError, ValueError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ValueError(f"hand {path} cannot be used: {reason}") from error

    @classmethod
    def from_description(
        cls, name: str, description: dict[str, Any], folder: Path
    ) -> "GraspingHand":
        """Return the hand of a parsed description; relative URDF paths start at `folder`."""
        table = _table(description["table"], folder, str(description.get("base", "")))
        if not description.get("preshapes"):
            raise ValueError(f"hand {name}: expected at least one pre-shape")
        chains, starts = _fingers(table, description["preshapes"])
        preshapes = tuple(_preshape(table, entry) for entry in description["preshapes"])
        joints = _joints_of_fingers(table, starts)
        effort = _effort(table, dict(zip(chains, joints, strict=True)), description)
        grips = {
            entry["name"]: _grip(table, dict(zip(chains, joints, strict=True)), entry)
            for entry in description["preshapes"]
        }
        arrays = _arrays(table, chains, starts, description)
        strength = float(description.get("strength", 60.0))
        squeeze = float(description.get("squeeze", 0.05))
        hand = cls(name, table, chains, preshapes, effort, grips, arrays, strength, squeeze)
        hand._check()
        return hand

    def _check(self) -> None:
        """Refuse numbers that no hand has.

        Raises:
            ValueError: that names the key and its range.
        """
        whole = (("strength", self.strength, 1e4), ("squeeze", self.squeeze, 10.0))
        for name, value, most in (*whole, *(("effort", e, 1e3) for e in self.effort)):
            if not 0.0 <= value <= most:
                raise ValueError(f"expected {name} in 0..{most:g}, got {value}")
        for shape in self.preshapes:
            if shape.stop not in ("contact", "center"):
                raise ValueError(f"pre-shape {shape.name}: expected stop contact or center")
            if shape.place not in ("face", "loop", "rim"):
                raise ValueError(f"pre-shape {shape.name}: expected place face, loop or rim")
            spans = (*shape.depth, *shape.offset, shape.side, shape.jitter, shape.weight)
            lengths = np.array([shape.widest, shape.thickest, *shape.center])
            if not np.all(np.abs([*spans, *lengths, *shape.rates]) <= _LARGEST_SPAN) or not (
                len(shape.depth) == len(shape.offset) == 2 and shape.center.shape == (3,)
            ):
                raise ValueError(f"pre-shape {shape.name}: expected lengths in m and shares")
            if shape.weight < 0.0 or shape.widest <= 0.0:
                raise ValueError(f"pre-shape {shape.name}: expected weight and widest above 0")


def _table(source: str, folder: Path, base: str) -> JointTable:
    if source == "human":
        return HandModel().table
    if source == "schunk":
        return schunk_hand()
    return table_from_urdf(folder / source, base)


def _fingers(
    table: JointTable, preshapes: Sequence[dict[str, Any]]
) -> tuple[tuple[str, ...], list[int]]:
    """Return name and first link of each finger: what hangs on the base by joints of its own.

    The two jaws that one motor closes are one finger: it stops when either of them touches. A
    finger is called by the common stem of its links' names, or as its first link where that names
    several.
    """
    branches = [link for link in range(1, len(table.parents)) if table.parents[link] == 0]
    if not branches:
        raise ValueError(f"hand {table.name}: no joint moves anything")
    closing = {
        int(joint)
        for entry in preshapes
        for joint in np.flatnonzero(_posture(table, entry["rates"]))
    }
    ends = [*branches[1:], len(table.parents)]
    moved = [
        set(table.drivers[a:b].tolist()) & closing for a, b in zip(branches, ends, strict=True)
    ]
    starts = [branches[0]]
    for index in range(1, len(branches)):
        before = set[int]().union(*moved[:index])
        if not before & set[int]().union(*moved[index:]):
            starts.append(branches[index])
    stems = [table.link_names[link].rsplit("_", 1)[0] for link in starts]
    names = [
        stem if stems.count(stem) == 1 else table.link_names[link]
        for stem, link in zip(stems, starts, strict=True)
    ]
    return tuple(names), starts


def _joints_of_fingers(table: JointTable, starts: list[int]) -> list[list[int]]:
    """Return the joints of each finger that move no other."""
    ends = [*starts[1:], len(table.parents)]
    moved = [set(table.drivers[a:b].tolist()) - {-1} for a, b in zip(starts, ends, strict=True)]
    return [
        sorted(own - set[int]().union(*moved[:index], *moved[index + 1 :]))
        for index, own in enumerate(moved)
    ]


def _joint_indices(table: JointTable, finger: str) -> list[int]:
    found = [
        index
        for index, name in enumerate(table.joint_names)
        if name == finger or name.startswith(f"{finger}_")
    ]
    if not found:
        raise ValueError(f"hand {table.name}: no joint belongs to {finger!r}")
    return found


def _posture(table: JointTable, entry: dict[str, list[float]]) -> Array:
    values = np.zeros(len(table.joint_names))
    for finger, angles in entry.items():
        indices = _joint_indices(table, finger)
        if len(angles) != len(indices):
            raise ValueError(f"hand {table.name}: {finger} needs {len(indices)} angles")
        values[indices] = angles
    return values


def _unit(vector: Sequence[float] | Array) -> Array:
    array = np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(array))
    if array.shape != (3,) or not 1e-9 < length < np.inf:
        raise ValueError(f"expected a direction of three numbers, got {vector}")
    return np.asarray(array / length)


def _preshape(table: JointTable, entry: dict[str, Any]) -> Preshape:
    approach = _unit(entry["approach"])
    closing = np.asarray(entry["closing"], dtype=np.float64)
    posture = _posture(table, entry["open"])
    posture = np.where(table.sliding_joints, posture, np.radians(posture))
    return Preshape(
        str(entry["name"]),
        float(entry.get("weight", 1.0)),
        approach,
        _unit(closing - approach * (approach @ closing)),
        np.asarray(entry["center"], dtype=np.float64),
        float(entry["widest"]),
        entry["stop"],
        tuple(entry.get("depth", (0.0, 0.0))),
        tuple(entry["offset"]),
        float(entry.get("side", 0.0)),
        float(entry.get("thickest", 1.0)),
        float(entry.get("jitter", 1.0)),
        bool(entry.get("near_mass", False)),
        entry.get("place", "face"),
        float(entry["residual"]) if "residual" in entry else None,
        np.clip(posture, table.limits[:, 0], table.limits[:, 1]),
        _posture(table, entry["rates"]),
    )


def _effort(table: JointTable, fingers: dict[str, list[int]], description: dict[str, Any]) -> Array:
    """Return the torque limits (J,) per level of each finger; `knuckle_effort` for the others."""
    effort = np.full(len(table.joint_names), float(description.get("knuckle_effort", 1.0)))
    for finger, joints in fingers.items():
        levels = description["effort"].get(finger, description["effort"]["others"])
        for level, joint in enumerate(joints):
            effort[joint] = levels[min(level, len(levels) - 1)]
    return effort


def _grip(table: JointTable, fingers: dict[str, list[int]], entry: dict[str, Any]) -> Array:
    """Return the share (J,) of the torque limits that a pre-shape uses."""
    grip = np.ones(len(table.joint_names))
    shares = entry.get("grip", {})
    for finger, joints in fingers.items():
        grip[joints] = shares.get(finger, shares.get("others", 1.0))
    return grip


def _arrays(
    table: JointTable, chains: tuple[str, ...], starts: list[int], description: dict[str, Any]
) -> SphereArrays:
    chain_starts = np.array([*starts, len(table.parents)], dtype=np.int32)
    links, centers, radii = spheres_of(table)
    joint_chains = np.full(len(table.joint_names), -1, dtype=np.int32)
    follows = np.full(len(table.joint_names), -1, dtype=np.int32)
    coupling = description.get("coupling")
    for chain, joints in enumerate(_joints_of_fingers(table, starts)):
        finger = chains[chain]
        joint_chains[joints] = chain
        if coupling is not None and finger != "thumb":
            follows[joints[-1]] = joints[-2]
    collide = np.zeros((len(chains), len(chains)), dtype=bool)
    for first, second in description.get("self_collision", []):
        i, j = chains.index(first), chains.index(second)
        collide[i, j] = collide[j, i] = True
    return SphereArrays(
        table.parents.astype(np.int32),
        np.ascontiguousarray(table.origins[:, :3], dtype=np.float32),
        table.axes.astype(np.float32),
        table.drivers.astype(np.int32),
        table.ratios.astype(np.float32),
        table.slides,
        chain_starts,
        links,
        centers,
        radii,
        np.searchsorted(links, np.arange(len(table.parents) + 1)).astype(np.int32),
        joint_chains,
        table.limits[:, 0].astype(np.float32),
        table.limits[:, 1].astype(np.float32),
        follows,
        float((coupling or {}).get("ratio", 0.0)),
        float(np.radians((coupling or {}).get("slack", 0.0))),
        collide,
    )
