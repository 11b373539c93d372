"""Recall, precision, pose errors and calibration over many scenes, as CONTRACT.md defines them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.geometry.transforms import transform_points
from intent_perception.objects.model import ObjectModel
from intent_perception.workshop.figures.matching import (
    FOUND,
    PoseError,
    pose_error,
    surface_gap,
    surface_points,
)
from intent_perception.workshop.scenes.table_scenes import PlacedObject, TabletopScene

LEAST_PIXELS = 150
"""Objects of which fewer pixels are seen do not count."""
_BINS = 10


@dataclass(frozen=True, eq=False)
class Claim:
    """One object that a method says is there."""

    model: ObjectModel
    """Which."""
    T_camera_object: Array
    """(4, 4) where."""
    confidence: float
    """How sure."""


@dataclass(frozen=True)
class Judged:
    """One claim after comparison with the truth."""

    confidence: float
    right: bool
    """The very model at its pose."""
    right_class: bool
    """That, or a sibling of the class at the same place."""
    error: PoseError | None
    """Of a right claim."""


@dataclass
class Score:
    """Adds up scenes."""

    seen: list[tuple[float, bool, bool]] = field(default_factory=list)
    """Visibility of each counted object; whether it and its class were found."""
    judged: list[Judged] = field(default_factory=list)
    """All claims."""
    false_in_empty: list[int] = field(default_factory=list)
    """Claims in each scene that holds none of the models."""
    cpu: list[float] = field(default_factory=list)
    """CPU seconds of each scene."""
    wall: list[float] = field(default_factory=list)
    """Wall seconds of each scene."""

    def add(self, scene: TabletopScene, claims: Sequence[Claim], known: set[str]) -> list[Judged]:
        """Compare claims, best first, with a scene; known names the models that count."""
        results, found = judge(scene.objects, claims)
        self.judged += results
        truth = [item for item in scene.objects if item.model.name in known]
        if not truth:
            self.false_in_empty.append(len(claims))
        for item in truth:
            if item.pixels >= LEAST_PIXELS:
                mine = found.get(id(item))
                self.seen.append((item.visibility, mine == "model", mine is not None))
        return results

    def figures(self) -> dict[str, Any]:
        """Return the contract's keys; None where nothing was counted."""
        seen = np.array(self.seen, dtype=np.float64).reshape(-1, 3)
        visible = seen[:, 0] >= 0.7
        half = (seen[:, 0] >= 0.3) & ~visible
        errors = [j.error for j in self.judged if j.error is not None]
        shift = [1000.0 * e.translation for e in errors]
        turn = [float(np.degrees(e.rotation)) for e in errors]
        right = [j.right for j in self.judged]
        return {
            "scenes": len(self.cpu),
            "recall_visible": _mean(seen[visible, 1]),
            "recall_half": _mean(seen[half, 1]),
            "recall_class_visible": _mean(seen[visible, 2]),
            "recall_model_visible": _mean(seen[visible, 1]),
            "objects_visible": int(visible.sum()),
            "objects_half": int(half.sum()),
            "precision": _mean(right),
            "precision_class": _mean([j.right_class for j in self.judged]),
            "false_per_empty_scene": _mean(self.false_in_empty),
            "empty_scenes": len(self.false_in_empty),
            "translation_mm_median": _percentile(shift, 50),
            "translation_mm_p90": _percentile(shift, 90),
            "rotation_deg_median": _percentile(turn, 50),
            "rotation_deg_p90": _percentile(turn, 90),
            "wall_s_median": _percentile(self.wall, 50),
            "cpu_s_median": _percentile(self.cpu, 50),
            "ece": expected_calibration_error([j.confidence for j in self.judged], right),
        }


def judge(
    truth: Sequence[PlacedObject], claims: Sequence[Claim]
) -> tuple[list[Judged], dict[int, str]]:
    """Return each claim judged, and for found objects (by id) whether "model" or "class" is right.

    A claim takes the object that it matches; a second claim to the same object is wrong.
    """
    found: dict[int, str] = {}
    results = []
    for claim in sorted(claims, key=lambda c: -c.confidence):
        free = [item for item in truth if id(item) not in found]
        same = [item for item in free if item.model.name == claim.model.name]
        points = surface_points(claim.model)
        errors = [
            pose_error(claim.model, points, claim.T_camera_object, item.T_camera_object)
            for item in same
        ]
        best = min(range(len(same)), key=lambda k: errors[k].distance, default=None)
        if best is not None and errors[best].distance < FOUND * claim.model.diameter:
            found[id(same[best])] = "model"
            results.append(Judged(claim.confidence, True, True, errors[best]))
            continue
        sibling = _sibling(claim, free, points)
        if sibling is not None:
            found[id(sibling)] = "class"
        results.append(Judged(claim.confidence, False, sibling is not None, None))
    return results, found


def _sibling(claim: Claim, free: Sequence[PlacedObject], points: Array) -> PlacedObject | None:
    placed = transform_points(claim.T_camera_object, points)
    for item in free:
        if item.model.object_class != claim.model.object_class:
            continue
        true = transform_points(item.T_camera_object, surface_points(item.model))
        if surface_gap(placed, true) < FOUND * item.model.diameter:
            return item
    return None


def expected_calibration_error(confidence: Sequence[float], right: Sequence[bool]) -> float | None:
    """Return the mean gap between confidence and share of right claims over bins of confidence."""
    if not confidence:
        return None
    said, true = np.array(confidence), np.array(right, dtype=np.float64)
    bins = np.minimum((said * _BINS).astype(int), _BINS - 1)
    gaps = [
        np.sum(bins == k) * abs(said[bins == k].mean() - true[bins == k].mean())
        for k in np.unique(bins)
    ]
    return float(np.sum(gaps) / len(said))


def _mean(values: Any) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _percentile(values: Sequence[float], percent: float) -> float | None:
    return float(np.percentile(values, percent)) if len(values) else None
