"""What is computed once for each object of a database."""

from collections.abc import Callable

from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel


class ModelMemory[Value]:
    """One value for each model of a database, as long as the database holds that very model.

    Estimated shapes come and go, and another recogniser may give the name of an old one to a new
    shape: what was computed of a shape goes with it.
    """

    def __init__(self, database: ObjectDatabase, make: Callable[[ObjectModel], Value]) -> None:
        """Begin with no value.

        Args:
            database: where models are looked up.
            make: computes the value of a model.
        """
        self._database, self._make = database, make
        self._kept: dict[str, tuple[ObjectModel, Value]] = {}

    def __getitem__(self, name: str) -> Value:
        """Return the value of a model.

        Raises:
            ValueError: if the database has no such model.
        """
        model = self._database[name]
        kept = self._kept.get(name)
        if kept is not None and kept[0] is model:
            return kept[1]
        value = self._make(model)
        for other in list(self._kept):
            if other not in self._database:
                self._kept.pop(other, None)
        self._kept[name] = model, value
        return value

    def get(self, name: str) -> Value | None:
        """Return the value of a model, None where the database has none of that name."""
        return self[name] if name in self._database else None

    def __len__(self) -> int:
        """Return of how many models the value is kept."""
        return len(self._kept)
