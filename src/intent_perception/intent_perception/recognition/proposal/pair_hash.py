"""One hash table for the oriented point pairs of all models (Sec. III-A, offline phase).

The signature of a pair is its distance and the three angles between the normals and the line that
joins the points: it does not change when the object moves, and two pairs of one signature fix the
rigid transform between them. The paper uses one distance; several make thin and flat objects, too
small for the large distance and too featureless for the small one, findable.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Floats
from intent_perception.basics.kernels import borrowing_kernel, kernel
from intent_perception.basics.safe_files import write_arrays
from intent_perception.recognition.proposal.model_surface import ModelSurface
from intent_perception.recognition.proposal.proposal_arrays import PairArrays

BINS = 24
"""Bins of each angle over [0, pi]."""
_FORMAT = 1


@dataclass(frozen=True, eq=False)
class PairTable:
    """Pairs of all models, sorted by signature; immutable, `with_model` returns a larger one."""

    distances: Floats
    """(S,) distances between the points of a pair [m]."""
    tolerance: float
    """Largest deviation of a pair's distance from one of them [m]."""
    capacity: int
    """Most pairs kept of one model at one distance; drawn evenly when there are more."""
    keys: NDArray[np.int32]
    """(E,) signatures in increasing order."""
    entries: NDArray[np.uint16]
    """(E, 3) number of the model, first and second point of the pair."""
    starts: NDArray[np.int64]
    """(S * BINS^3 + 1,) where each signature's entries begin."""

    @classmethod
    def empty(cls, distances: tuple[float, ...], tolerance: float, capacity: int) -> "PairTable":
        """Return a table without models."""
        starts = np.zeros(len(distances) * BINS**3 + 1, np.int64)
        entries = np.zeros((0, 3), np.uint16)
        steps = np.array(distances, np.float32)
        return cls(steps, tolerance, capacity, np.zeros(0, np.int32), entries, starts)

    @property
    def arrays(self) -> PairArrays:
        """The table for compiled code."""
        return PairArrays(self.distances, self.tolerance, self.starts, self.entries)

    @property
    def models(self) -> int:
        """How many models the table holds."""
        return int(self.entries[:, 0].max()) + 1 if len(self.entries) else 0

    def with_model(
        self, number: int, surface: ModelSurface, sector: NDArray[np.bool_]
    ) -> "PairTable":
        """Return this table and the pairs of one more model; those it holds are not recomputed.

        Args:
            number: the model's number in the database.
            surface: its oriented points.
            sector: (P,) points that may come first in a pair: for an object symmetric about an
                axis a sector suffices, the rest are the same pairs turned.
        """
        return self.with_models([(number, surface, sector)])

    def with_models(self, added: list[tuple[int, ModelSurface, NDArray[np.bool_]]]) -> "PairTable":
        """Return this table and the pairs of several more models (see `with_model`)."""
        keys, entries = [self.keys], [self.entries]
        for number, surface, sector in added:
            rng = np.random.default_rng(number)
            for shell in range(len(self.distances)):
                key, first, second = _pairs(
                    surface.points,
                    surface.normals,
                    surface.seen,
                    sector,
                    self.distances[shell],
                    np.float32(self.tolerance),
                    shell,
                )
                if len(key) > self.capacity:
                    chosen = rng.choice(len(key), self.capacity, replace=False)
                    key, first, second = key[chosen], first[chosen], second[chosen]
                model = np.full(len(key), number, np.uint16)
                keys.append(key)
                entries.append(np.stack([model, first, second], axis=1))
        all_keys, all_entries = np.concatenate(keys), np.concatenate(entries)
        order = np.argsort(all_keys, kind="stable")
        sorted_keys = all_keys[order]
        starts = np.searchsorted(sorted_keys, np.arange(len(self.starts))).astype(np.int64)
        return PairTable(
            self.distances,
            self.tolerance,
            self.capacity,
            sorted_keys,
            np.ascontiguousarray(all_entries[order]),
            starts,
        )

    def save(self, path: Path) -> None:
        """Write the table as a compressed npz file."""
        arrays = {
            "format": np.array(_FORMAT),
            "distances": self.distances,
            "tolerance": np.array(self.tolerance),
            "capacity": np.array(self.capacity),
            "keys": self.keys,
            "entries": self.entries,
        }
        write_arrays(path, arrays)

    @classmethod
    def load(cls, path: Path) -> "PairTable":
        """Return a saved table.

        Raises:
            ValueError: if the file is not one, or is damaged.
        """
        try:
            file = read_arrays(path, "pair table")
            if int(file["format"]) != _FORMAT:
                raise ValueError(f"expected pair-table format {_FORMAT}, got {file['format']}")
            keys, distances = file["keys"], file["distances"]
            starts = np.searchsorted(keys, np.arange(len(distances) * BINS**3 + 1))
            return cls(
                distances,
                float(file["tolerance"]),
                int(file["capacity"]),
                keys,
                file["entries"],
                starts.astype(np.int64),
            )
        except (KeyError, ValueError, TypeError) as error:
            raise ValueError(f"{path} is not a pair table: {error}; rebuild it") from error


@borrowing_kernel
def angle_bin(cosine: float) -> int:
    """Return the bin of the angle with this cosine."""
    angle = np.arccos(min(1.0, max(-1.0, cosine)))
    return min(BINS - 1, int(angle * (BINS / np.pi)))


@kernel
def _pairs(
    points: Floats,
    normals: Floats,
    seen: NDArray[np.uint64],
    sector: NDArray[np.bool_],
    distance: float,
    tolerance: float,
    shell: int,
) -> tuple[NDArray[np.int32], NDArray[np.uint16], NDArray[np.uint16]]:
    """Return key, first and second point of all pairs at a distance that one view can see."""
    size = len(points)
    room = 4096
    keys = np.empty(room, np.int32)
    firsts = np.empty(room, np.uint16)
    seconds = np.empty(room, np.uint16)
    count = 0
    low = (distance - tolerance) ** 2
    high = (distance + tolerance) ** 2
    for i in range(size):
        if not sector[i]:
            continue
        for j in range(size):
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
            dz = points[j, 2] - points[i, 2]
            squared = dx * dx + dy * dy + dz * dz
            if squared < low or squared > high or i == j or (seen[i] & seen[j]) == 0:
                continue
            length = np.sqrt(squared)
            a = (normals[i, 0] * dx + normals[i, 1] * dy + normals[i, 2] * dz) / length
            b = -(normals[j, 0] * dx + normals[j, 1] * dy + normals[j, 2] * dz) / length
            c = (
                normals[i, 0] * normals[j, 0]
                + normals[i, 1] * normals[j, 1]
                + normals[i, 2] * normals[j, 2]
            )
            if is_degenerate(a, b, c):
                continue
            if count == room:
                room *= 2
                keys = np.concatenate((keys, np.empty(count, np.int32)))
                firsts = np.concatenate((firsts, np.empty(count, np.uint16)))
                seconds = np.concatenate((seconds, np.empty(count, np.uint16)))
            keys[count] = ((shell * BINS + angle_bin(a)) * BINS + angle_bin(b)) * BINS + (
                angle_bin(c)
            )
            firsts[count] = i
            seconds[count] = j
            count += 1
    return keys[:count].copy(), firsts[:count].copy(), seconds[:count].copy()


@borrowing_kernel
def is_degenerate(a: float, b: float, c: float) -> bool:
    """Return whether a pair fixes no pose well: on one plane, or with normals along its line."""
    coplanar = c > 0.985 and abs(a) < 0.15
    along = abs(a) > 0.97 and abs(b) > 0.97
    return bool(coplanar or along)


@borrowing_kernel
def pair_frame(
    point: Floats, normal: Floats, other: Floats, other_normal: Floats, frame: Floats
) -> bool:
    """Write the frame (3, 3) fixed to an oriented pair; False if the normals fix none.

    Its x runs from the first point to the second, its y is the mean of both normals made square to
    x. Frames of the same pair before and after a rigid motion differ by exactly that motion.
    """
    x0 = other[0] - point[0]
    x1 = other[1] - point[1]
    x2 = other[2] - point[2]
    scale = 1.0 / np.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    x0 *= scale
    x1 *= scale
    x2 *= scale
    d = normal[0] * x0 + normal[1] * x1 + normal[2] * x2
    a0 = normal[0] - d * x0
    a1 = normal[1] - d * x1
    a2 = normal[2] - d * x2
    la = 1.0 / np.sqrt(a0 * a0 + a1 * a1 + a2 * a2 + 1e-9)
    d = other_normal[0] * x0 + other_normal[1] * x1 + other_normal[2] * x2
    b0 = other_normal[0] - d * x0
    b1 = other_normal[1] - d * x1
    b2 = other_normal[2] - d * x2
    lb = 1.0 / np.sqrt(b0 * b0 + b1 * b1 + b2 * b2 + 1e-9)
    # a normal along the line has no direction around it: it counts by its part across
    wa = min(1.0, 3.0 / la) * la
    wb = min(1.0, 3.0 / lb) * lb
    y0 = a0 * wa + b0 * wb
    y1 = a1 * wa + b1 * wb
    y2 = a2 * wa + b2 * wb
    length = np.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
    if length < 0.3:
        return False
    y0 /= length
    y1 /= length
    y2 /= length
    frame[0, 0] = x0
    frame[1, 0] = x1
    frame[2, 0] = x2
    frame[0, 1] = y0
    frame[1, 1] = y1
    frame[2, 1] = y2
    frame[0, 2] = x1 * y2 - x2 * y1
    frame[1, 2] = x2 * y0 - x0 * y2
    frame[2, 2] = x0 * y1 - x1 * y0
    return True
