"""The object database: the shipped 48 objects, the shipped clutter, or a user's own meshes.

A database is a YAML file (or a folder that holds one): `{objects: [{name, mesh, unit, class}, …]}`.
Its objects are added to the shipped ones, of which those of the same name make way; with
`only: true` beside `objects` they are all there is.
Those four keys are enough for any mesh; the optional ones are `up`, `color`, `mass`, `density`,
`friction`, `functions`, `symmetry` and `stable_poses` (see `loading`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Protocol

from intent_perception import SHARE
from intent_perception.basics.checked_files import read_yaml
from intent_perception.geometry.mesh import Mesh
from intent_perception.objects.loading import load_entry
from intent_perception.objects.model import (
    OBJECT_CLASSES,
    Edge,
    Face,
    Functions,
    ObjectModel,
    Opening,
    Part,
    Symmetry,
)

__all__ = [
    "CLUTTER",
    "OBJECT_CLASSES",
    "SHIPPED",
    "Edge",
    "Face",
    "Functions",
    "Mesh",
    "ModelSource",
    "ObjectDatabase",
    "ObjectModel",
    "Opening",
    "Part",
    "Symmetry",
]

SHIPPED = SHARE / "objects" / "objects.yaml"
"""The database of 6 classes x 8 objects."""
REVISION = "~"
"""Stands in a name between an estimated thing and the revision of its shape."""
_KEPT = 3
"""Revisions of one thing's shape that are remembered."""
CLUTTER = SHARE / "objects" / "clutter.yaml"
"""Household things of other classes: toy car, box, ball …"""


class ModelSource(Protocol):
    """Where an object is looked up by the name of its model: a database, or any mapping."""

    def __getitem__(self, name: str, /) -> ObjectModel:
        """Return the object with a name."""
        ...

    def __contains__(self, name: object, /) -> bool:
        """Return whether there is one."""
        ...


@dataclass(frozen=True, eq=False)
class ObjectDatabase:
    """Objects in a fixed order, found by name."""

    models: tuple[ObjectModel, ...]
    """The objects; names are unique."""
    notes: tuple[str, ...] = ()
    """What looks wrong with entries of the file, one sentence each."""
    estimated: dict[str, ObjectModel] = field(default_factory=dict)
    """Shapes of things that are in no file, learnt while a run goes on; by name."""

    def __post_init__(self) -> None:
        """Refuse two objects of one name."""
        names = [model.name for model in self.models]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"expected unique object names, got twice: {', '.join(twice)}")

    @classmethod
    def load(cls, path: str | Path | None = None, alone: bool = False) -> "ObjectDatabase":
        """Return the database in a YAML file or in a folder with one; None = the shipped 48.

        Args:
            path: of a user's own objects, which are added to the shipped ones unless the file says
                `only: true`.
            alone: whether only the file's own objects are wanted, whatever it says.

        Raises:
            ValueError: if it cannot be read or an entry is wrong, with file, entry and remedy.
        """
        file = _database_file(SHIPPED if path is None else Path(path))
        try:
            content = read_yaml(file)
        except ValueError as error:
            raise ValueError(f"cannot read the object database: {error}") from error
        entries = content.get("objects") if isinstance(content, dict) else None
        if not isinstance(entries, list) or not entries:
            raise ValueError(
                f"expected {file} to hold `objects:` with a list of entries "
                "{name, mesh, unit, class}"
            )
        loaded = [load_entry(entry, file) for entry in entries]
        notes = tuple(note for _, some in loaded for note in some)
        own = cls(tuple(model for model, _ in loaded), notes)
        only = content.get("only", False)
        if not isinstance(only, bool):
            raise ValueError(f"expected `only: true` or false in {file}, got {only!r}")
        if alone or only or file.parent.resolve() == SHIPPED.parent.resolve():
            return own
        return cls(own.models + tuple(m for m in _shipped().models if m.name not in own), notes)

    @classmethod
    def clutter(cls) -> "ObjectDatabase":
        """Return the shipped things that belong to none of the six classes."""
        return cls.load(CLUTTER)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all objects, in order."""
        return tuple(model.name for model in self.models)

    @cached_property
    def _by_name(self) -> dict[str, ObjectModel]:
        return {model.name: model for model in self.models}

    @property
    def example(self) -> ObjectModel:
        """The first model that comes with its boxes, else the first: little is left to compute."""
        known = (model for model in self.models if model.stored_boxes is not None)
        return next(known, self.models[0])

    def learn(self, model: ObjectModel) -> None:
        """Take an estimated shape; who looks it up by its name finds it from now on.

        A shape has the name of its thing with a revision behind `REVISION`. The one before is kept
        for those who still follow it, older ones are forgotten.
        """
        self.estimated.pop(model.name, None)
        thing = model.name.rpartition(REVISION)[0]
        of_thing = [name for name in self.estimated if name.rpartition(REVISION)[0] == thing]
        for name in of_thing[: -(_KEPT - 1)]:
            del self.estimated[name]
        self.estimated[model.name] = model

    def __getitem__(self, name: str) -> ObjectModel:
        """Return the object or the estimated shape with a name."""
        if name in self.estimated:
            return self.estimated[name]
        if name in self._by_name:
            return self._by_name[name]
        raise ValueError(f"expected one of {', '.join(self.names)}, got {name!r}")

    def __contains__(self, name: object) -> bool:
        """Return whether an object or an estimated shape has this name."""
        return name in self.estimated or name in self._by_name

    def __iter__(self) -> Iterator[ObjectModel]:
        """Go through the objects in order."""
        return iter(self.models)

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.models)

    def of_class(self, object_class: str) -> tuple[ObjectModel, ...]:
        """Return the objects of a class, possibly none."""
        return tuple(model for model in self.models if model.object_class == object_class)

    def select(self, names: list[str] | tuple[str, ...]) -> "ObjectDatabase":
        """Return the database of the named objects only, in the given order."""
        return ObjectDatabase(tuple(self[name] for name in names))

    def joined(self, other: "ObjectDatabase") -> "ObjectDatabase":
        """Return the objects of both databases."""
        return ObjectDatabase(self.models + other.models, self.notes + other.notes)


@cache
def _shipped() -> ObjectDatabase:
    return ObjectDatabase.load()


def _database_file(path: Path) -> Path:
    if path.is_dir():
        files = sorted([*path.glob("*.yaml"), *path.glob("*.yml")])
        if len(files) != 1:
            found = ", ".join(file.name for file in files) or "none"
            raise ValueError(f"expected one YAML file in the object database {path}, got {found}")
        return files[0]
    if not path.is_file():
        raise ValueError(f"expected an object database (YAML file or folder), {path} is missing")
    return path
