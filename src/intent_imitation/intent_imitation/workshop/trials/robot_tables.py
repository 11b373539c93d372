"""Random tables for the robot: which objects stand there, how, and whose class is hidden."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from intent_perception.basics.arrays import Array
from intent_perception.basics.parameters import Checked
from intent_perception.geometry.transforms import (
    look_at,
    make_pose,
    rotation_from_vector,
    transform_points,
)
from intent_perception.objects.database import ObjectDatabase, ObjectModel
from intent_perception.recognition.recognizer import RecognizedObject, RecognizedObjects

FITTING = {
    "hand-over": ("bottle", "glass", "mug", "knife", "hammer", "screwdriver"),
    "pouring": ("bottle", "glass", "mug"),
    "tool-use": ("knife", "hammer", "screwdriver"),
    "dish-washing": ("glass", "mug", "knife"),
}
"""Classes with objects that afford a task, by the label rules."""
DOUBTFUL = ("bowl", "can", "spoon", "plate")
"""Clutter about which the label rules say nothing though people might use it: left out."""


@dataclass(frozen=True)
class SceneConfig(Checked):
    """How tables are laid."""

    fewest: int = 3
    """Least number of objects, 1..20."""
    most: int = 4
    """Greatest number of objects, 1..20."""
    radius: float = 0.24
    """Objects stand within this distance of the middle [m], 0.05..1."""
    gap: float = 0.05
    """Least distance between the circles around objects [m], 0..0.5."""
    without: float = 0.25
    """Share of the tables on which no object of a fitting class stands properly (never for
    hand-over, for which every class fits), 0..1."""
    decoys: float = 0.5
    """Share of the tables with a vessel that stands upside down or lies, 0..1."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fewest > self.most:
            raise ValueError(f"expected fewest <= most, got {self.fewest} and {self.most}")


@dataclass(frozen=True, eq=False)
class Scene:
    """One table and the task that is asked for."""

    task: str
    models: tuple[ObjectModel, ...]
    T_table_objects: Array
    """(N, 4, 4)."""
    unseen: tuple[bool, ...]
    """Objects that BN^R was not trained on; their class is hidden from the planner."""

    def recognized(self) -> RecognizedObjects:
        """Return the table as a recogniser without error would report it."""
        items, counts = [], dict[str, int]()
        placed = zip(self.models, self.T_table_objects, self.unseen, strict=True)
        for model, pose, hidden in placed:
            counts[model.name] = counts.get(model.name, 0) + 1
            suffix = f".{counts[model.name]}" if counts[model.name] > 1 else ""
            kind = "" if hidden else model.object_class
            items.append(
                RecognizedObject(f"{model.name}{suffix}", model.name, kind, pose, 1.0, 1.0)
            )
        return RecognizedObjects(0, tuple(items), look_at([0.0, 0.8, 0.6], [0.0, 0.0, 0.05]))


class SceneMaker:
    """Lays tables with known, unknown and unsuitable objects."""

    def __init__(
        self,
        known: ObjectDatabase,
        clutter: ObjectDatabase,
        unseen: frozenset[str],
        config: SceneConfig | None = None,
    ) -> None:
        """Take the objects.

        Args:
            known: annotated objects.
            clutter: things that afford no task but hand-over.
            unseen: names of objects that BN^R was not trained on.
            config: how tables are laid.
        """
        self._config, self._unseen = config or SceneConfig(), unseen
        self._by_class: dict[str, list[ObjectModel]] = {}
        for model in known.models:
            self._by_class.setdefault(model.object_class, []).append(model)
        self._clutter = [model for model in clutter.models if model.name not in DOUBTFUL]

    def make(self, task: str, rng: np.random.Generator) -> Scene:
        """Return a table for a task."""
        config = self._config
        count = int(rng.integers(config.fewest, config.most + 1))
        chosen: list[tuple[ObjectModel, bool]] = []  # with whether it stands as it should
        if task == "hand-over" or rng.random() >= config.without:
            chosen.append((self._one_of(FITTING[task], rng), True))
        if rng.random() < config.decoys:
            vessels = tuple(kind for kind in FITTING[task] if kind in ("glass", "mug", "bottle"))
            if vessels:
                chosen.append((self._one_of(vessels, rng), False))
        # Anything can be handed over; what the label rules say nothing about stays away there.
        everything = task == "hand-over"
        unfit = [kind for kind in self._by_class if everything or kind not in FITTING[task]]
        while len(chosen) < count:
            if everything or rng.random() < 0.6:
                chosen.append((self._one_of(tuple(unfit), rng), True))
            else:
                chosen.append((self._clutter[rng.integers(len(self._clutter))], True))
        order = rng.permutation(len(chosen))
        models = tuple(chosen[k][0] for k in order)
        rests = [_rest(chosen[k][0], chosen[k][1], rng) for k in order]
        poses = _placed(models, rests, config, rng)
        clutter = {model.name for model in self._clutter}
        unseen = tuple(m.name in self._unseen or m.name in clutter for m in models)
        return Scene(task, models, poses, unseen)

    def _one_of(self, classes: Sequence[str], rng: np.random.Generator) -> ObjectModel:
        models = self._by_class[classes[int(rng.integers(len(classes)))]]
        return models[rng.integers(len(models))]


def _rest(model: ObjectModel, proper: bool, rng: np.random.Generator) -> Array:
    """Return how an object rests: as it should, or on its head or side."""
    poses = model.stable_poses
    upright: list[Array] = [pose for pose in poses if pose[2, 2] > 0.9]
    others: list[Array] = [pose for pose in poses if pose[2, 2] < 0.5]
    if proper or not others:
        return upright[0] if upright else np.asarray(poses[0])
    return others[int(rng.integers(len(others)))]


def _placed(
    models: Sequence[ObjectModel],
    rests: Sequence[Array],
    config: SceneConfig,
    rng: np.random.Generator,
) -> Array:
    """Return poses (N, 4, 4) at which the circles around the objects keep their distance."""
    radii = []
    for model, rest in zip(models, rests, strict=True):
        points = transform_points(rest, model.mesh.vertices)[:, :2]
        radii.append(float(np.linalg.norm(points, axis=1).max()))
    spread = config.radius
    while True:
        for _ in range(200):
            angle = rng.uniform(0.0, 2.0 * np.pi, len(models))
            distance = spread * np.sqrt(rng.random(len(models)))
            places = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
            gaps = np.linalg.norm(places[:, None] - places, axis=2) - np.add.outer(radii, radii)
            if np.all(gaps[~np.eye(len(models), dtype=bool)] > config.gap):
                return _turned(places, rests, rng)
        spread *= 1.15  # long tools need a larger table


def _turned(places: Array, rests: Sequence[Array], rng: np.random.Generator) -> Array:
    """Return the rests at their places, each turned about the vertical at random."""
    poses = []
    for place, rest in zip(places, rests, strict=True):
        turn = rotation_from_vector([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
        poses.append(make_pose(turn, [place[0], place[1], 0.0]) @ rest)
    return np.array(poses)


def merged(*databases: ObjectDatabase) -> ObjectDatabase:
    """Return one database with the objects of all."""
    models: Mapping[str, ObjectModel] = {m.name: m for d in databases for m in d.models}
    return ObjectDatabase(tuple(models.values()))
