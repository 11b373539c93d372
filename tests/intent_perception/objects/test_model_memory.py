"""What is computed of an object is forgotten with it."""

from dataclasses import replace

import pytest

from intent_perception.objects.database import ObjectDatabase
from intent_perception.objects.model import ObjectModel
from intent_perception.objects.model_memory import ModelMemory

SHIPPED = ObjectDatabase.load()


def computed() -> tuple[ObjectDatabase, ModelMemory[float], list[str]]:
    database, log = SHIPPED.select(["mug_0", "bottle_0"]), list[str]()

    def make(model: ObjectModel) -> float:
        log.append(model.name)
        return float(model.size[2])

    return database, ModelMemory(database, make), log


def test_a_value_is_computed_once() -> None:
    database, memory, log = computed()
    assert memory["mug_0"] == memory["mug_0"] == database["mug_0"].size[2]
    assert log == ["mug_0"]


def test_an_unknown_name_has_no_value() -> None:
    _, memory, _ = computed()
    assert memory.get("cup_9") is None
    with pytest.raises(ValueError, match="cup_9"):
        memory["cup_9"]


def test_another_shape_under_an_old_name_has_its_own_value() -> None:
    database, memory, _ = computed()
    for name in ("mug_1", "bottle_1"):
        database.learn(replace(SHIPPED[name], name="thing~0"))
        assert memory["thing~0"] == SHIPPED[name].size[2]


def test_revisions_without_end_do_not_gather() -> None:
    database, memory, _ = computed()
    for revision in range(50):
        database.learn(replace(SHIPPED["mug_1"], name=f"thing~{revision}"))
        memory.get(f"thing~{revision}")
    assert len(memory) == len(database.estimated)
    assert len(memory) < 5
